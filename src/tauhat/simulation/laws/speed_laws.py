"""Laws of friction that the speed alone decides."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.simulation.laws.law import JointLaw, JointState
from tauhat.simulation.laws.speed_kernel import (
    add_by_direction,
    add_cube_root,
    add_polynomial,
    add_smooth_sign,
    add_stribeck,
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SmoothCoulomb(JointLaw):
    """Coulomb friction that turns round over a range of speed: `torque tanh(dq / width)`.

    The plant's own Coulomb friction has the sharp sign and holds a joint at rest; this one creeps.

    torque : (n_v,) [Nm or N]
    width : (n_v,) [rad/s or m/s]
    """

    key: ClassVar[str] = "smooth-coulomb"
    letters: ClassVar[Mapping[str, str]] = {"torque": "Fc"}
    positive: ClassVar[tuple[str, ...]] = ("width",)
    dissipative: ClassVar[tuple[str, ...]] = ("torque",)
    torque: FloatArray
    width: FloatArray

    def add(self, joints: JointState, memory: FloatArray) -> None:
        """Add the friction of this speed."""
        add_smooth_sign(joints.dq, self.torque, self.width, joints.torque, joints.damping)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CubeRootDrag(JointLaw):
    """Friction that grows ever more slowly with speed: `coefficient |dq|^(1/3) sgn(dq)`.

    coefficient : (n_v,) [Nm (s/rad)^(1/3) or N (s/m)^(1/3)]
    """

    key: ClassVar[str] = "cube-root"
    letters: ClassVar[Mapping[str, str]] = {"coefficient": "Fr"}
    dissipative: ClassVar[tuple[str, ...]] = ("coefficient",)
    coefficient: FloatArray

    def add(self, joints: JointState, memory: FloatArray) -> None:
        """Add the friction of this speed."""
        add_cube_root(joints.dq, self.coefficient, joints.torque, joints.damping)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DirectionalViscous(JointLaw):
    """What viscous friction has more forwards and less backwards: `difference |dq|`.

    By itself it drives a joint backwards: the plant's viscous friction must not be smaller.

    difference : (n_v,) [Nm s/rad or N s/m]
    """

    key: ClassVar[str] = "directional-viscous"
    letters: ClassVar[Mapping[str, str]] = {"difference": "Fva"}
    difference: FloatArray

    def add(self, joints: JointState, memory: FloatArray) -> None:
        """Add the difference at this speed."""
        joints.torque[:] += self.difference * np.abs(joints.dq)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DirectionalFriction(JointLaw):
    """Viscous and Coulomb friction of their own in each direction, in the place of the plant's.

    viscous_forwards, viscous_backwards : (n_v,) [Nm s/rad or N s/m]
    coulomb_forwards, coulomb_backwards : (n_v,) [Nm or N]
    width : (n_v,) of the smooth sign [rad/s or m/s]
    """

    key: ClassVar[str] = "directional"
    letters: ClassVar[Mapping[str, str]] = {
        "viscous_forwards": "Fv+",
        "viscous_backwards": "Fv-",
        "coulomb_forwards": "Fc+",
        "coulomb_backwards": "Fc-",
    }
    positive: ClassVar[tuple[str, ...]] = ("width",)
    dissipative: ClassVar[tuple[str, ...]] = tuple(letters)
    viscous_forwards: FloatArray
    viscous_backwards: FloatArray
    coulomb_forwards: FloatArray
    coulomb_backwards: FloatArray
    width: FloatArray

    def add(self, joints: JointState, memory: FloatArray) -> None:
        """Add the friction of this speed and direction."""
        forwards = np.array([self.viscous_forwards, self.coulomb_forwards])
        backwards = np.array([self.viscous_backwards, self.coulomb_backwards])
        add_by_direction(joints.dq, forwards, backwards, self.width, joints.torque, joints.damping)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StribeckBump(JointLaw):
    """Friction that is higher at low speed: `torque exp(-(dq / speed)^2) tanh(dq / width)`, beside Coulomb's.

    torque : (n_v,) [Nm or N]
    speed, width : (n_v,) [rad/s or m/s]
    """

    key: ClassVar[str] = "stribeck"
    letters: ClassVar[Mapping[str, str]] = {"torque": "Fs"}
    positive: ClassVar[tuple[str, ...]] = ("speed", "width")
    torque: FloatArray
    speed: FloatArray
    width: FloatArray

    def add(self, joints: JointState, memory: FloatArray) -> None:
        """Add the bump at this speed."""
        add_stribeck(joints.dq, self.torque, self.speed, self.width, joints.torque, joints.damping)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PolynomialDrag(JointLaw):
    """Third-order polynomial in speed plus a Stribeck part, in the place of viscous and Coulomb friction.

    `(constant + bump exp(-|dq| / speed)) tanh(dq / width) + linear dq + square |dq| dq + cube dq^3`

    constant, bump : (n_v,) [Nm or N]
    linear, square, cube : (n_v,) [Nm or N, over powers of rad/s or m/s]
    speed, width : (n_v,) [rad/s or m/s]
    """

    key: ClassVar[str] = "polynomial"
    letters: ClassVar[Mapping[str, str]] = {
        "constant": "k0", "linear": "k1", "square": "k2", "cube": "k3", "bump": "k4",
    }  # fmt: skip
    positive: ClassVar[tuple[str, ...]] = ("speed", "width")
    constant: FloatArray
    linear: FloatArray
    square: FloatArray
    cube: FloatArray
    bump: FloatArray
    speed: FloatArray
    width: FloatArray

    def add(self, joints: JointState, memory: FloatArray) -> None:
        """Add the friction of this speed."""
        k = np.array([self.constant, self.linear, self.square, self.cube, self.bump])
        add_polynomial(joints.dq, k, self.speed, self.width, joints.torque, joints.damping)
