"""Friction of the plant that grows with the load on the gear."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.simulation.laws.bristle_kernel import add_bent, bend
from tauhat.simulation.laws.law import JointLaw, JointState
from tauhat.simulation.laws.speed_kernel import add_smooth_sign


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LoadedCoulomb(JointLaw):
    """Coulomb friction in proportion to the load: `ratio load tanh(dq / width)`.

    ratio : (n_v,) friction torque over load [1]
    width : (n_v,) [rad/s or m/s]
    """

    key: ClassVar[str] = "loaded-coulomb"
    letters: ClassVar[Mapping[str, str]] = {"ratio": "Fl"}
    positive: ClassVar[tuple[str, ...]] = ("width",)
    dissipative: ClassVar[tuple[str, ...]] = ("ratio",)
    ratio: FloatArray
    width: FloatArray

    def add(self, joints: JointState, memory: FloatArray) -> None:
        """Add the friction of this load and speed."""
        add_smooth_sign(joints.dq, self.ratio * joints.load, self.width, joints.torque, joints.damping)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LoadedBristles(JointLaw):
    """Pre-sliding friction in proportion to the load: `ratio load z`.

    ratio : (n_v,) friction torque over load [1]
    length : (n_v,) over which the bristles bend [rad or m]
    """

    key: ClassVar[str] = "loaded-bristles"
    letters: ClassVar[Mapping[str, str]] = {"ratio": "Fl"}
    positive: ClassVar[tuple[str, ...]] = ("length",)
    dissipative: ClassVar[tuple[str, ...]] = ("ratio",)
    ratio: FloatArray
    length: FloatArray

    def memory(self) -> FloatArray:
        """Return unbent bristles, (1, n_v)."""
        return np.zeros((1, self.n_v))

    def add(self, joints: JointState, memory: FloatArray) -> None:
        """Add the torque of the bent bristles under this load."""
        add_bent((self.ratio * joints.load)[None], memory, joints.torque)

    def advance(self, moved: FloatArray, memory: FloatArray) -> None:
        """Bend the bristles along a displacement."""
        bend(moved, self.length[None], memory)

    def stiffness(self, load: FloatArray) -> FloatArray:
        """Return the stiffness right after a reversal under this load."""
        return np.asarray(2.0 * self.ratio * load / self.length)
