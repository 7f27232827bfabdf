"""What a term is: a physical effect that adds to a joint's torque and is linear in its parameters.

A term tells which parameters it owns (`parameters`), which of them each joint's torque depends on (`support`), and the
regressor columns along a stretch of motion (`columns`). Columns may be pointwise, stateful (they carry a state from one
stretch of a recording to the next) or iterated (they depend on the rigid-body parameters of a previous pass).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.dynamics.motion import Motion, MotionGradient
from tauhat.errors import ModelError
from tauhat.robots.robot import Robot
from tauhat.robots.shared_motor import SharedMotor


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """One number of a torque model.

    symbol : the field's letter, e.g. Ixx or Fv
    joint : index of the joint or link it describes
    unit : SI, joint side of the gear
    lower : smallest physically possible value
    """

    symbol: str
    joint: int
    unit: str
    lower: float = -np.inf

    @property
    def name(self) -> str:
        """Symbol and joint number, counted from one: Ixx_3."""
        return f"{self.symbol}_{self.joint + 1}"


class Facts(NamedTuple):
    """What a term may learn from the recordings before any fit.

    top_speeds : (n_v,) largest speed of each joint [rad/s or m/s]
    shared_motors : the motors that, after the log's map, turn with two joints
    temperatures : (n_v,) mean of each joint's [deg C], where all recordings have them
    """

    top_speeds: FloatArray
    shared_motors: tuple[SharedMotor, ...] = ()
    temperatures: FloatArray | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Term(ABC):
    """A physical effect, linear in its parameters."""

    key: ClassVar[str]
    dissipates: ClassVar[bool] = False
    stateful: ClassVar[bool] = False
    iterated: ClassVar[bool] = False
    needs: ClassVar[tuple[str, ...]] = ()  # what a recording must have measured beside position and torque
    stands_for: ClassVar[tuple[str, ...]] = ()  # keys of terms that it contains, and cannot be told apart from

    @abstractmethod
    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Return the term's parameters on this robot, in order."""

    @abstractmethod
    def support(self, robot: Robot) -> tuple[IntArray, ...]:
        """Return for each joint the indices of the term's parameters that load it."""

    @abstractmethod
    def columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[tuple[FloatArray, ...], FloatArray | None]:
        """Return for each joint the columns of its support, (n_support, n_t), and the state behind the last sample.

        `state` is None at the start of a recording and for pointwise terms.
        """

    def pull(self, robot: Robot, motion: Motion, bars: tuple[FloatArray, ...], gradient: MotionGradient) -> None:
        """Add to `gradient` what the sensitivities `bars` of the term's columns say about the motion.

        Parameters
        ----------
        bars : for each joint df/d(columns of its support), (n_support, n_t)

        Raises
        ------
        ModelError
            when the term's columns have no gradient.
        """
        raise ModelError(
            f"the columns of term {self.key} have no gradient", remedy="leave it out of the motion's design"
        )

    def informed(self, facts: Facts) -> Term:
        """Return the term with what needs no fit: all but its shape."""
        return self

    def candidates(self, facts: Facts) -> tuple[Term, ...]:
        """Return the forms of the term among which the fit on the recordings decides; most terms have one."""
        return (self,)

    def after(self, inertia: FloatArray, rotors: FloatArray | None = None) -> Term:
        """Return the term for the next pass, given the rigid-body parameters that the last one found.

        Parameters
        ----------
        inertia : (n_v, 10), without rotors
        rotors : (n_v,) that were taken off, where the fit has links and rotor in one number; none by default
        """
        return self
