"""Drives: rotor inertia, springs and gas springs that balance a joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.dynamics.motion import Motion, MotionGradient
from tauhat.dynamics.terms.joint_term import JointTerm
from tauhat.dynamics.terms.term import Parameter, Term
from tauhat.errors import ModelError
from tauhat.robots.joint import Joint
from tauhat.robots.robot import Robot


@dataclass(frozen=True, slots=True, kw_only=True)
class RotorInertia(JointTerm):
    """Inertia of the motor's rotor, reflected to the joint side: `Ia ddq`."""

    key: ClassVar[str] = "rotor"
    symbols: ClassVar[tuple[str, ...]] = ("Ia",)
    smallest: ClassVar[float] = 0.0

    def units(self, joint: Joint) -> tuple[str, ...]:
        """Return kg m^2, or kg on a prismatic joint."""
        return ("kg m^2",) if joint.kind == "revolute" else ("kg",)

    def own_columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[FloatArray, FloatArray | None]:
        """Return ddq; pointwise."""
        return motion.ddq[:, None], state

    def pull(self, robot: Robot, motion: Motion, bars: tuple[FloatArray, ...], gradient: MotionGradient) -> None:
        """Add to the gradient of ddq."""
        for joint in self.present(robot):
            gradient.ddq[joint] += bars[joint][0]


@dataclass(frozen=True, slots=True, kw_only=True)
class Spring(JointTerm):
    """A spring that balances a joint: `Ks q`; its rest position is in `offset`."""

    key: ClassVar[str] = "spring"
    symbols: ClassVar[tuple[str, ...]] = ("Ks",)

    def units(self, joint: Joint) -> tuple[str, ...]:
        """Return torque over position."""
        return ("Nm/rad",) if joint.kind == "revolute" else ("N/m",)

    def own_columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[FloatArray, FloatArray | None]:
        """Return q; pointwise."""
        return motion.q[:, None], state

    def pull(self, robot: Robot, motion: Motion, bars: tuple[FloatArray, ...], gradient: MotionGradient) -> None:
        """Add to the gradient of q."""
        for joint in self.present(robot):
            gradient.q[joint] += bars[joint][0]


@dataclass(frozen=True, slots=True, kw_only=True)
class GasSpring(Term):
    """A closed gas cylinder on a lever that balances one joint, as on the second axis of heavy arms.

    The cylinder turns about a point at `distance` from the joint's axis and holds the link at `lever` from it. With the
    angle `d = q + angle` between the two, the length is `l = sqrt(D^2 + k^2 - 2 D k cos d)`, the gas is compressed by
    `(l - l0) A` from `volume` at the shortest length `l0 = D - k`. At constant temperature pressure times volume stays
    `Gs`, the energy is `-Gs ln(volume - (l - l0) A)`, and the drive must overcome the derivative of that,
        tau = Gs A / (volume - (l - l0) A) * D k sin(d) / l
    which pulls towards `d = 0`.

    joint : index of the joint, from zero
    distance, lever : D and k [m]
    angle : [rad]
    area : A, of the piston [m^2]
    volume : [m^3]
    """

    key: ClassVar[str] = "gas-spring"
    joint: int
    distance: float
    lever: float
    angle: float
    area: float
    volume: float

    def __post_init__(self) -> None:
        if not isinstance(self.joint, int):
            raise ModelError("term gas-spring: the joint is not an index", got=self.joint)
        sizes = (self.distance, self.lever, self.area, self.volume)
        if any(not 0.0 < size < np.inf for size in sizes) or not np.isfinite(self.angle):
            raise ModelError("term gas-spring: distance, lever, area and volume must be positive", got=sizes)
        if self.lever >= self.distance or 2.0 * self.lever * self.area >= self.volume:
            raise ModelError(
                "term gas-spring: the lever must be shorter than the distance, and its stroke less than the volume",
                got=f"lever {self.lever:g} m, distance {self.distance:g} m, volume {self.volume:g} m^3",
            )

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Return the gas's energy."""
        if self.joint not in range(robot.n_v):
            raise ModelError("term gas-spring: no such joint", expected=f"0 to {robot.n_v - 1}", got=self.joint)
        return (Parameter(symbol="Gs", joint=self.joint, unit="J", lower=0.0),)

    def support(self, robot: Robot) -> tuple[IntArray, ...]:
        """Return the parameter on its joint."""
        return tuple(np.arange(1 if joint == self.joint else 0) for joint in range(robot.n_v))

    def columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[tuple[FloatArray, ...], FloatArray | None]:
        """Return the spring's torque per unit of energy; pointwise."""
        turned = motion.q[self.joint] + self.angle
        span = self.distance * self.lever
        length = np.sqrt(self.distance**2 + self.lever**2 - 2.0 * span * np.cos(turned))
        stroke = length - (self.distance - self.lever)
        own = span * np.sin(turned) / length * self.area / (self.volume - stroke * self.area)
        empty = np.zeros((0, motion.n_t))
        return tuple(own[None] if joint == self.joint else empty for joint in range(robot.n_v)), state
