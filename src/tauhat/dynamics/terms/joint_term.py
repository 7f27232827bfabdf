"""Terms that a joint owns alone, with or without a shape value that enters non-linearly."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.dynamics.motion import Motion
from tauhat.dynamics.terms.shaped import Shaped
from tauhat.dynamics.terms.term import Facts, Parameter, Term
from tauhat.errors import ModelError
from tauhat.robots.joint import Joint
from tauhat.robots.robot import Robot


@dataclass(frozen=True, slots=True, kw_only=True)
class JointTerm(Term):
    """A term with the same few parameters on every joint, each of which loads its own joint alone.

    joints : which joints have it, (n_v,); empty means all
    """

    symbols: ClassVar[tuple[str, ...]]
    smallest: ClassVar[float] = -np.inf
    joints: tuple[bool, ...] = ()

    def __post_init__(self) -> None:
        if any(joint not in (False, True) for joint in self.joints):
            raise ModelError(f"term {self.key}: joints", expected="true or false for each", got=tuple(self.joints))
        object.__setattr__(self, "joints", tuple(bool(joint) for joint in self.joints))

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Return the parameters joint by joint."""
        return tuple(
            Parameter(symbol=symbol, joint=int(index), unit=unit, lower=self.smallest)
            for index in self.present(robot)
            for symbol, unit in zip(self.symbols, self.units(robot.joints[index]), strict=True)
        )

    def support(self, robot: Robot) -> tuple[IntArray, ...]:
        """Return each joint's own parameters."""
        count = len(self.symbols)
        starts = {int(joint): count * place for place, joint in enumerate(self.present(robot))}
        return tuple(
            np.arange(starts[joint], starts[joint] + count) if joint in starts else np.zeros(0, dtype=np.intp)
            for joint in range(robot.n_v)
        )

    def present(self, robot: Robot) -> IntArray:
        """Return the indices of the joints that have the term.

        Raises
        ------
        ModelError
            when `joints` does not fit the robot.
        """
        if not self.joints:
            return np.arange(robot.n_v)
        if len(self.joints) != robot.n_v:
            raise ModelError(f"term {self.key}: joints", expected=f"{robot.n_v} values", got=len(self.joints))
        return np.flatnonzero(self.joints)

    def columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[tuple[FloatArray, ...], FloatArray | None]:
        """Return every joint's columns; those of joints without the term are empty."""
        values, after = self.own_columns(robot, motion, state)
        if not self.joints:
            return tuple(values), after
        empty = np.zeros((0, motion.n_t))
        return tuple(own if has else empty for own, has in zip(values, self.joints, strict=True)), after

    @abstractmethod
    def units(self, joint: Joint) -> tuple[str, ...]:
        """Return the unit of each symbol on this joint."""

    @abstractmethod
    def own_columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[FloatArray, FloatArray | None]:
        """Return the columns of all joints, (n_v, n_symbols, n_t), and the state behind the last sample."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShapedTerm(JointTerm, Shaped):
    """A joint term whose columns depend non-linearly on one positive value a joint: a width, a speed, a length."""

    grid_of_speed: ClassVar[bool] = True

    def __post_init__(self) -> None:
        super(ShapedTerm, self).__post_init__()
        values = tuple(float(value) for value in self.shape)
        object.__setattr__(self, self.shape_field, values)
        if any(not 0.0 < value < np.inf for value in values):
            raise ModelError(f"term {self.key}: the {self.shape_field} must be positive", got=values)

    def shaping(self, robot: Robot) -> IntArray:
        """Return each parameter's joint: the values are one a joint, (n_v,)."""
        return np.repeat(self.present(robot), len(self.symbols))

    def chosen(self, n_v: int, typical: float) -> FloatArray:
        """Return the shapes as a column, (n_v, 1); `typical` where none was chosen yet.

        Raises
        ------
        ModelError
            when there is not one a joint.
        """
        if not self.shape:
            return np.full((n_v, 1), typical)
        if len(self.shape) != n_v:
            raise ModelError(
                f"term {self.key}: one of the {self.shape_field} a joint is needed", expected=n_v, got=len(self.shape)
            )
        return np.array(self.shape)[:, None]

    def candidates(self, facts: Facts) -> tuple[Term, ...]:
        """Return the term with each shape of the grid; given shapes stay."""
        if self.shape:
            return (self,)
        moving = facts.top_speeds if self.grid_of_speed else np.ones_like(facts.top_speeds)
        return tuple(self.with_shape([part * (top or 1.0) for top in moving]) for part in self.grid)
