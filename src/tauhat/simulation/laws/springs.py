"""Springs of the plant that balance a joint."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import SimulationError
from tauhat.simulation.laws.law import JointLaw, JointState, PassiveLaw, Side, TrueValues


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BalancingSpring(JointLaw):
    """A linear spring that pulls each joint to position zero: `rate q`.

    rate : (n_v,) [Nm/rad or N/m]
    """

    key: ClassVar[str] = "spring"
    letters: ClassVar[Mapping[str, str]] = {"rate": "Ks"}
    side: ClassVar[Side] = "link"
    rate: FloatArray

    def add(self, joints: JointState, memory: FloatArray) -> None:
        """Add the spring's torque at this position."""
        joints.torque[:] += self.rate * joints.q

    def stiffness(self, load: FloatArray) -> FloatArray:
        """Return the rate itself."""
        return np.abs(self.rate)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GasCylinder(PassiveLaw):
    """A closed gas cylinder between the base and a lever on one joint; isothermal gas, `p V = energy`.

    The piston's pin is `lever` from the joint's axis, the cylinder's pin `distance`; their angle is `d = q + angle`.
    Pulled out to the length l, the gas is squeezed from `volume` to `volume - area (l - l0)`, l0 the shortest length.
    Its work is `-energy ln(V)`, and the torque the derivative of that by q: it pulls towards d = 0.

    joint : from zero
    energy : pressure times volume [J]
    distance, lever : [m]
    angle : [rad]
    area, volume : [m^2, m^3]
    """

    key: ClassVar[str] = "gas-cylinder"
    letters: ClassVar[Mapping[str, str]] = {"energy": "Gs"}
    side: ClassVar[Side] = "link"
    joint: int
    energy: float
    distance: float
    lever: float
    angle: float
    area: float
    volume: float

    def __post_init__(self) -> None:
        if not 0.0 < self.lever < self.distance or not 0.0 < 2.0 * self.lever * self.area < self.volume:
            got = f"lever {self.lever:g} m, distance {self.distance:g} m, volume {self.volume:g} m^3"
            raise SimulationError(f"law {self.key}: the piston does not fit the cylinder", got=got)

    def check(self, n_v: int) -> None:
        """Refuse a robot without the joint."""
        if not 0 <= self.joint < n_v:
            raise SimulationError(f"law {self.key}: no such joint", expected=f"0 to {n_v - 1}", got=self.joint)

    def true_values(self) -> TrueValues:
        """Return the gas's energy."""
        return {("Gs", self.joint): self.energy}

    def rows(self) -> FloatArray:
        """Return joint, energy, distance, lever, angle, area and volume, (7, 1)."""
        values = (self.joint, self.energy, self.distance, self.lever, self.angle, self.area, self.volume)
        return np.array(values, dtype=np.float64)[:, None]

    def add(self, joints: JointState, memory: FloatArray) -> None:
        """Add the cylinder's torque at this position."""
        turned = joints.q[self.joint] + self.angle
        pins = complex(self.distance, 0.0) - self.lever * complex(math.cos(turned), math.sin(turned))
        length = abs(pins)
        # The force's arm about the joint: the pin's position across the cylinder's direction.
        arm = self.distance * self.lever * math.sin(turned) / length
        left = self.volume - self.area * (length - self.distance + self.lever)
        joints.torque[self.joint] += self.energy / left * self.area * arm
