"""Friction that depends on the speed alone: viscous, Coulomb, cube root, by direction, Stribeck, polynomial; offset.

Near zero speed the sign of a measured velocity is noise. Every law here therefore takes a smooth sign,
`tanh(dq / width)`, whose width is either a shape of its own (Coulomb) or a small fixed part of a shape.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.motion import Motion, MotionGradient
from tauhat.dynamics.terms.joint_term import JointTerm, ShapedTerm
from tauhat.robots.joint import Joint
from tauhat.robots.robot import Robot

WIDTHS = (1e-4, 1e-3, 3e-3, 1e-2, 2e-2, 4e-2)  # of the smooth sign, in parts of the top speed
STRIBECK_SPEEDS = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4)  # in parts of the top speed
POLYNOMIAL_SPEEDS = (0.005, 0.007, 0.01, 0.014, 0.02, 0.03, 0.05, 0.07, 0.1, 0.14, 0.2, 0.28, 0.4)  # many local minima
_TYPICAL_SPEED = 0.05  # [rad/s or m/s] a Stribeck speed before any is chosen
_FARTHEST = 300.0  # exponent of a bump that is over: a motion that never is slow sees it badly, not as a zero column
_SHARPNESS = 0.1  # width of the sign beside a Stribeck curve, in parts of its speed


@dataclass(frozen=True, slots=True, kw_only=True)
class Viscous(JointTerm):
    """Viscous friction: `Fv dq`."""

    key: ClassVar[str] = "viscous"
    dissipates: ClassVar[bool] = True
    symbols: ClassVar[tuple[str, ...]] = ("Fv",)
    smallest: ClassVar[float] = 0.0

    def units(self, joint: Joint) -> tuple[str, ...]:
        """Return torque over speed."""
        return (f"{joint.effort_unit} {per_speed(joint)}",)

    def own_columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[FloatArray, FloatArray | None]:
        """Return dq; pointwise."""
        return motion.dq[:, None], state

    def pull(self, robot: Robot, motion: Motion, bars: tuple[FloatArray, ...], gradient: MotionGradient) -> None:
        """Add to the gradient of dq."""
        for joint in self.present(robot):
            gradient.dq[joint] += bars[joint][0]


@dataclass(frozen=True, slots=True, kw_only=True)
class Coulomb(ShapedTerm):
    """Coulomb friction with a smooth sign: `Fc tanh(dq / width)`.

    The sign is smoothed over a width, a small part of each joint's top speed, which the residual on the fitted
    recordings chooses: from practically the plain sign to four hundredths. On eight real robots this predicted better
    than the plain sign, and far better than a sign that is held at rest.

    widths : per joint [rad/s or m/s]; empty until chosen, and then the plain sign is taken
    """

    key: ClassVar[str] = "coulomb"
    dissipates: ClassVar[bool] = True
    symbols: ClassVar[tuple[str, ...]] = ("Fc",)
    smallest: ClassVar[float] = 0.0
    shape_field: ClassVar[str] = "widths"
    grid: ClassVar[tuple[float, ...]] = WIDTHS
    widths: tuple[float, ...] = ()

    def units(self, joint: Joint) -> tuple[str, ...]:
        """Return the unit of the joint's torque."""
        return (joint.effort_unit,)

    def own_columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[FloatArray, FloatArray | None]:
        """Return the smooth sign of dq; pointwise."""
        if not self.widths:
            return np.sign(motion.dq)[:, None], state
        return np.tanh(motion.dq / self.chosen(robot.n_v, 0.0))[:, None], state

    def pull(self, robot: Robot, motion: Motion, bars: tuple[FloatArray, ...], gradient: MotionGradient) -> None:
        """Add to the gradient of dq; the plain sign has none."""
        if self.widths:
            for joint in self.present(robot):
                bent = np.cosh(np.clip(motion.dq[joint] / self.widths[joint], -300.0, 300.0))
                gradient.dq[joint] += bars[joint][0] / (self.widths[joint] * bent**2)


@dataclass(frozen=True, slots=True, kw_only=True)
class CubeRoot(JointTerm):
    """Degressive viscous friction: `Fr |dq|^(1/3) sgn(dq)`.

    Real gears lose less and less per unit of speed. A cubic polynomial bends the same way inside the speeds it was
    fitted on and goes astray outside; the cube root does not, and has no sign to be wrong about at rest.
    """

    key: ClassVar[str] = "cube-root"
    dissipates: ClassVar[bool] = True
    symbols: ClassVar[tuple[str, ...]] = ("Fr",)

    def units(self, joint: Joint) -> tuple[str, ...]:
        """Return torque over the cube root of speed."""
        return (f"{joint.effort_unit} ({per_speed(joint)})^(1/3)",)

    def own_columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[FloatArray, FloatArray | None]:
        """Return the cube root of dq; pointwise."""
        return np.cbrt(motion.dq)[:, None], state


@dataclass(frozen=True, slots=True, kw_only=True)
class ViscousAsymmetry(JointTerm):
    """Viscous friction that differs with the direction, beside `viscous`: `Fva |dq|`.

    It makes the coefficient `Fv + Fva` forwards and `Fv - Fva` backwards.
    On most arms it is noise and makes predictions worse; on some screws it is a third of the residual.
    """

    key: ClassVar[str] = "viscous-asymmetry"
    dissipates: ClassVar[bool] = True
    symbols: ClassVar[tuple[str, ...]] = ("Fva",)

    def units(self, joint: Joint) -> tuple[str, ...]:
        """Return torque over speed."""
        return (f"{joint.effort_unit} {per_speed(joint)}",)

    def own_columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[FloatArray, FloatArray | None]:
        """Return the size of dq; pointwise."""
        return np.abs(motion.dq)[:, None], state


@dataclass(frozen=True, slots=True, kw_only=True)
class Asymmetric(ShapedTerm):
    """Viscous and Coulomb friction apart for each direction: `(Fv+ dq + Fc+ s)` forwards, `(Fv- dq + Fc- s)` backwards.

    With the smooth sign `s = tanh(dq / width)` and `s+ = max(s, 0)`, `s- = min(s, 0)`. It replaces `viscous` and
    `coulomb`, and cannot be told apart from them; an `offset` stands for half the difference of Fc+ and Fc- and must be
    left out as well.

    widths : per joint [rad/s or m/s]; empty until chosen, and then the plain sign is taken
    """

    key: ClassVar[str] = "asymmetric"
    dissipates: ClassVar[bool] = True
    symbols: ClassVar[tuple[str, ...]] = ("Fv+", "Fv-", "Fc+", "Fc-")
    stands_for: ClassVar[tuple[str, ...]] = ("viscous", "viscous-asymmetry", "coulomb", "offset")
    smallest: ClassVar[float] = 0.0
    shape_field: ClassVar[str] = "widths"
    grid: ClassVar[tuple[float, ...]] = WIDTHS
    widths: tuple[float, ...] = ()

    def units(self, joint: Joint) -> tuple[str, ...]:
        """Return torque over speed twice, and torque twice."""
        viscous = f"{joint.effort_unit} {per_speed(joint)}"
        return (viscous, viscous, joint.effort_unit, joint.effort_unit)

    def own_columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[FloatArray, FloatArray | None]:
        """Return the positive and the negative part of dq and of its smooth sign; pointwise."""
        sign = np.tanh(motion.dq / self.chosen(robot.n_v, 0.0)) if self.widths else np.sign(motion.dq)
        parts = [np.maximum(motion.dq, 0.0), np.minimum(motion.dq, 0.0), np.maximum(sign, 0.0), np.minimum(sign, 0.0)]
        return np.stack(parts, axis=1), state


@dataclass(frozen=True, slots=True, kw_only=True)
class Stribeck(ShapedTerm):
    """Friction that is higher at low speed: `Fs exp(-(|dq| / vs)^2) sgn(dq)`, beside `coulomb` and `viscous`.

    speeds : Stribeck speed vs of each joint [rad/s or m/s]; empty until chosen

    Source: Armstrong-Hélouvry, Dupont, Canudas de Wit, "A survey of models, analysis tools and compensation methods for
    the control of machines with friction", 1994.
    """

    key: ClassVar[str] = "stribeck"
    dissipates: ClassVar[bool] = True
    symbols: ClassVar[tuple[str, ...]] = ("Fs",)
    shape_field: ClassVar[str] = "speeds"
    grid: ClassVar[tuple[float, ...]] = STRIBECK_SPEEDS
    speeds: tuple[float, ...] = ()

    def units(self, joint: Joint) -> tuple[str, ...]:
        """Return the unit of the joint's torque."""
        return (joint.effort_unit,)

    def own_columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[FloatArray, FloatArray | None]:
        """Return the bump beside zero speed; pointwise."""
        ratio = motion.dq / self.chosen(robot.n_v, _TYPICAL_SPEED)
        return (_decayed(ratio**2) * np.tanh(ratio / _SHARPNESS))[:, None], state


@dataclass(frozen=True, slots=True, kw_only=True)
class PolynomialFriction(ShapedTerm):
    """Third-order polynomial in speed plus Stribeck: `(k0 + k1 |v| + k2 v^2 + k3 |v|^3 + k4 exp(-|v| / vs)) sgn v`.

    It stands for all of `viscous`, `coulomb` and `stribeck`, and cannot be told apart from them. The usual form
    `exp(-cs |v|)` has `cs = 1 / vs`.

    speeds : vs of each joint [rad/s or m/s]; empty until chosen

    Source: the friction law of virtual force sensors for industrial robots.
    """

    key: ClassVar[str] = "polynomial"
    dissipates: ClassVar[bool] = True
    symbols: ClassVar[tuple[str, ...]] = ("k0", "k1", "k2", "k3", "k4")
    stands_for: ClassVar[tuple[str, ...]] = ("viscous", "coulomb", "stribeck")
    shape_field: ClassVar[str] = "speeds"
    grid: ClassVar[tuple[float, ...]] = POLYNOMIAL_SPEEDS
    speeds: tuple[float, ...] = ()

    def units(self, joint: Joint) -> tuple[str, ...]:
        """Return torque over powers of the speed."""
        torque, speed = joint.effort_unit, per_speed(joint)
        return (torque, f"{torque} {speed}", f"{torque} ({speed})^2", f"{torque} ({speed})^3", torque)

    def own_columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[FloatArray, FloatArray | None]:
        """Return the five functions of the speed; pointwise."""
        v, speeds = motion.dq, self.chosen(robot.n_v, _TYPICAL_SPEED)
        sign, size = np.tanh(v / (_SHARPNESS * speeds)), np.abs(v)
        return np.stack([sign, v, size * v, v**3, _decayed(size / speeds) * sign], axis=1), state


@dataclass(frozen=True, slots=True, kw_only=True)
class Offset(JointTerm):
    """A constant torque a joint: amplifier offset, cable pull, a badly zeroed current sensor."""

    key: ClassVar[str] = "offset"
    symbols: ClassVar[tuple[str, ...]] = ("To",)

    def units(self, joint: Joint) -> tuple[str, ...]:
        """Return the unit of the joint's torque."""
        return (joint.effort_unit,)

    def own_columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[FloatArray, FloatArray | None]:
        """Return ones; pointwise."""
        return np.ones_like(motion.q)[:, None], state

    def pull(self, robot: Robot, motion: Motion, bars: tuple[FloatArray, ...], gradient: MotionGradient) -> None:
        """Add nothing: a constant does not depend on the motion."""


def _decayed(exponent: FloatArray) -> FloatArray:
    return np.asarray(np.exp(-np.minimum(exponent, _FARTHEST)))


def per_speed(joint: Joint) -> str:
    """Return the inverse of the unit of the joint's speed."""
    return "s/rad" if joint.kind == "revolute" else "s/m"
