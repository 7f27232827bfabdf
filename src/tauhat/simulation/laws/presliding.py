"""Pre-sliding friction of the plant: bristles that bend before they slide."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.simulation.laws.bristle_kernel import add_bent, bend
from tauhat.simulation.laws.law import JointLaw, JointState


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bristles(JointLaw):
    """Dahl's friction with two lengths, in the place of Coulomb's: `fine z + coarse z'`.

    Unlike any sign of the speed it holds a joint at rest, as a spring.

    fine, coarse : (n_v,) torque of both when bent [Nm or N]
    fine_length, coarse_length : (n_v,) over which they bend [rad or m]
    """

    key: ClassVar[str] = "bristles"
    letters: ClassVar[Mapping[str, str]] = {"fine": "Fd", "coarse": "Fe"}
    positive: ClassVar[tuple[str, ...]] = ("fine_length", "coarse_length")
    dissipative: ClassVar[tuple[str, ...]] = ("fine", "coarse")
    fine: FloatArray
    coarse: FloatArray
    fine_length: FloatArray
    coarse_length: FloatArray

    def memory(self) -> FloatArray:
        """Return unbent bristles, (2, n_v)."""
        return np.zeros((2, self.n_v))

    def add(self, joints: JointState, memory: FloatArray) -> None:
        """Add the torque of the bent bristles."""
        add_bent(np.array([self.fine, self.coarse]), memory, joints.torque)

    def advance(self, moved: FloatArray, memory: FloatArray) -> None:
        """Bend the bristles along a displacement."""
        bend(moved, np.array([self.fine_length, self.coarse_length]), memory)

    def stiffness(self, load: FloatArray) -> FloatArray:
        """Return the stiffness right after a reversal, twice that of unbent bristles."""
        return np.asarray(2.0 * (self.fine / self.fine_length + self.coarse / self.coarse_length))
