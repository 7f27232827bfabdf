"""A motor of the plant that turns with two joints, as the last one of many wrists does."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import SimulationError
from tauhat.simulation.laws.law import JointState, PassiveLaw, TrueValues
from tauhat.simulation.laws.presliding import Bristles
from tauhat.simulation.laws.speed_laws import SmoothCoulomb


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SharedDrive(PassiveLaw):
    """Rotor inertia, viscous and dry friction of a motor that moves by `q_m = q[own] + ratio q[other]`.

    The motor is whole: its torque acts on `own`, and `ratio` times on `other`. So it adds to rotor inertia and viscous
    friction of both joints as well as coupling them. Its inertia is a tendon's in the MuJoCo model, not a torque.

    own, other : joints, from zero
    inertia, viscous : in units of joint `own` [kg m^2, Nm s/rad]
    dry : dry friction along q_m, a law of one joint
    """

    key: ClassVar[str] = "shared-drive"
    letters: ClassVar[Mapping[str, str]] = {
        "inertia": "Iam", "viscous": "Fvm", "torque": "Fsm", "fine": "Fdm", "coarse": "Fem",
    }  # fmt: skip
    own: int
    other: int
    ratio: float
    inertia: float
    viscous: float
    dry: SmoothCoulomb | Bristles

    def __post_init__(self) -> None:
        if self.own == self.other or min(self.own, self.other) < 0 or self.ratio == 0.0:
            got = f"joints {self.own} and {self.other}, ratio {self.ratio:g}"
            raise SimulationError(f"law {self.key}: a motor turns with two different joints", got=got)
        if min(self.inertia, self.viscous) < 0.0:
            got = f"inertia {self.inertia:g}, viscous {self.viscous:g}"
            raise SimulationError(f"law {self.key}: a parameter is negative", got=got)
        self.dry.check(1)

    def check(self, n_v: int) -> None:
        """Refuse a robot without these joints."""
        if max(self.own, self.other) >= n_v:
            got = max(self.own, self.other)
            raise SimulationError(f"law {self.key}: no such joint", expected=f"0 to {n_v - 1}", got=got)

    def true_values(self) -> TrueValues:
        """Return what couples the joints, and what the motor adds to the own parameters of both."""
        square = self.ratio**2
        values = {
            ("Iam", self.own): self.inertia, ("Ia", self.own): self.inertia, ("Ia", self.other): square * self.inertia,
            ("Fvm", self.own): self.viscous, ("Fv", self.own): self.viscous, ("Fv", self.other): square * self.viscous,
        }  # fmt: skip
        dry = {(self.letters[name], self.own): float(getattr(self.dry, name)[0]) for name in self.dry.letters}
        return values | dry

    def rows(self) -> FloatArray:
        """Return own joint, other joint, ratio and viscous friction, then those of the dry friction, (k, 1)."""
        own = np.array([self.own, self.other, self.ratio, self.viscous], dtype=np.float64)
        return np.concatenate([own[:, None], self.dry.rows()])

    def memory(self) -> FloatArray:
        """Return the start of the dry friction."""
        return self.dry.memory()

    def add(self, joints: JointState, memory: FloatArray) -> None:
        """Add the motor's friction to both joints."""
        speed = self._along(joints.dq)
        motor = JointState(self._along(joints.q), speed, np.zeros(1), self.viscous * speed, np.full(1, self.viscous))
        self.dry.add(motor, memory)
        joints.torque[self.own] += motor.torque[0]
        joints.torque[self.other] += self.ratio * motor.torque[0]
        # Damping is added joint by joint: as much as bounds the motor's own matrix [1, r; r, r^2].
        arm = abs(self.ratio)
        joints.damping[self.own] += (1.0 + arm) * motor.damping[0]
        joints.damping[self.other] += (arm + arm**2) * motor.damping[0]

    def advance(self, moved: FloatArray, memory: FloatArray) -> None:
        """Carry the dry friction along the motor's displacement."""
        self.dry.advance(self._along(moved), memory)

    def stiffness(self, load: FloatArray) -> FloatArray:
        """Return the stiffness of the dry friction on both joints."""
        found = np.zeros_like(load)
        own = float(self.dry.stiffness(np.zeros(1))[0])
        found[[self.own, self.other]] = own, own * self.ratio**2
        return found

    def inertia_matrix(self, n_v: int) -> FloatArray:
        """Return what the motor adds to the mass matrix, (n_v, n_v) [kg m^2]."""
        along = np.zeros(n_v)
        along[[self.own, self.other]] = 1.0, self.ratio
        return self.inertia * np.outer(along, along)

    def _along(self, joints: FloatArray) -> FloatArray:
        return np.array([joints[self.own] + self.ratio * joints[self.other]])
