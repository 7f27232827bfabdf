"""What a passive law of the plant is: a torque that the joints' own motion and load decide, whatever the motor does.

The laws are written apart from the terms of `dynamics`, which identify what these here simulate: same physics, other
code. Each takes torque at the joint in the sense of the motor that must overcome it: friction has the sign of dq.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar, Literal, NamedTuple, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import SimulationError

TrueValues: TypeAlias = Mapping[tuple[str, int], float]
Side: TypeAlias = Literal["motor", "link"]


class JointState(NamedTuple):
    """State of all joints at one instant, (n_v,) each, and what the laws add up.

    q, dq : position and velocity [rad, rad/s] or [m, m/s]
    load : size of the rigid-body torque through the gear [Nm or N]
    torque : what the motors must overcome [Nm or N]; laws add to it
    damping : its derivative by dq [Nm s/rad or N s/m]; laws add to it, never less than nothing
    """

    q: FloatArray
    dq: FloatArray
    load: FloatArray
    torque: FloatArray
    damping: FloatArray


def resting_state(n_v: int) -> JointState:
    """Return a state of zeros, to be filled."""
    return JointState(*(np.zeros(n_v) for _ in JointState._fields))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PassiveLaw(ABC):
    """A passive torque with given parameters; `letters` names the standard parameter that each coefficient is.

    `side` of an elastic transmission it acts on: friction on the motor, springs on the link.
    """

    key: ClassVar[str]
    letters: ClassVar[Mapping[str, str]]
    side: ClassVar[Side] = "motor"

    @abstractmethod
    def check(self, n_v: int) -> None:
        """Refuse a robot of another number of joints."""

    @abstractmethod
    def true_values(self) -> TrueValues:
        """Return what the law contributes to the standard parameters, by symbol and joint."""

    @abstractmethod
    def add(self, joints: JointState, memory: FloatArray) -> None:
        """Add the law's torque and damping at this state."""

    @abstractmethod
    def rows(self) -> FloatArray:
        """Return the law's parameters as rows of numbers, in the order that `program_kernel` reads them."""

    def memory(self) -> FloatArray:
        """Return the law's internal state at the start; empty for laws without one."""
        return np.zeros((0, 0))

    def advance(self, moved: FloatArray, memory: FloatArray) -> None:  # noqa: B027
        """Carry the internal state along a displacement `moved` (n_v,) [rad or m]; nothing for laws without one."""

    def stiffness(self, load: FloatArray) -> FloatArray:
        """Return the stiffest spring that the law puts on each joint under this load, (n_v,) [Nm/rad or N/m]."""
        return np.zeros_like(load)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {"law": self.key} | {name: _plain(value) for name, value in values.items()}


def _plain(value: Any) -> Any:
    if isinstance(value, PassiveLaw):
        return value.to_dict()
    return value.tolist() if isinstance(value, np.ndarray) else value


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointLaw(PassiveLaw):
    """A law that acts on each joint alone, with parameters of one value a joint, (n_v,).

    `positive` are shapes that must be above zero, and `dissipative` coefficients that must not be below it.
    """

    positive: ClassVar[tuple[str, ...]] = ()
    dissipative: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        size = np.size(getattr(self, next(iter(self.letters))))
        for field in fields(self):
            values = frozen(field.name, getattr(self, field.name), (size,), where=f"law {self.key}")
            object.__setattr__(self, field.name, values)
        for name in (*self.positive, *self.dissipative):
            values = getattr(self, name)
            refused = values <= 0.0 if name in self.positive else values < 0.0
            if refused.any():
                joint = int(np.argmax(refused))
                wanted = "above zero" if name in self.positive else "at least zero"
                where = f"law {self.key}, joint {joint + 1}"
                raise SimulationError(f"{name} must be {wanted}", where=where, got=values[joint])

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return int(getattr(self, next(iter(self.letters))).size)

    def check(self, n_v: int) -> None:
        """Refuse a robot of another number of joints."""
        if n_v != self.n_v:
            raise SimulationError(f"law {self.key} of another robot", expected=f"{n_v} joints", got=self.n_v)

    def rows(self) -> FloatArray:
        """Return the parameters in the order of the fields, (k, n_v)."""
        return np.array([getattr(self, field.name) for field in fields(self)])

    def true_values(self) -> TrueValues:
        """Return the coefficients, by symbol and joint."""
        return {
            (letter, joint): float(value)
            for name, letter in self.letters.items()
            for joint, value in enumerate(getattr(self, name))
        }
