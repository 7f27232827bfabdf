"""The room a motion may use: a robot's joint limits with a margin, and sane ones where a robot has none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import ExcitationError, RobotError
from tauhat.robots.joint import Joint, JointKind
from tauhat.robots.robot import Robot

HALF_SPAN: dict[JointKind, float] = {"revolute": float(np.pi), "prismatic": 0.5}  # [rad, m] where unlimited
SPEED: dict[JointKind, float] = {"revolute": 2.0, "prismatic": 0.5}  # [rad/s, m/s] where unlimited
ACCELERATION_PER_SPEED = 3.0  # [1/s] where the acceleration is unlimited: full speed is reached in a third of a second


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MotionLimits:
    """Finite limits of a motion, (n_v,) each; every joint has room to move.

    lower, upper : position [rad or m]
    velocity : largest speed [rad/s or m/s]
    acceleration : largest acceleration [rad/s^2 or m/s^2]
    jerk : largest change of acceleration [rad/s^3 or m/s^3], None where there is no limit
    """

    lower: FloatArray
    upper: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray | None = None

    def __post_init__(self) -> None:
        n_v = np.size(self.lower)
        for name in ("lower", "upper", "velocity", "acceleration"):
            object.__setattr__(self, name, frozen(name, getattr(self, name), (n_v,), where="motion limits"))
        if self.jerk is not None:
            object.__setattr__(self, "jerk", frozen("jerk", self.jerk, (n_v,), where="motion limits"))
            if not (self.jerk > 0.0).all():
                raise ExcitationError("a jerk limit must be positive", got=self.jerk.tolist())


def motion_limits(robot: Robot, *, margin: float = 0.0, jerk: FloatArray | None = None) -> MotionLimits:
    """Return the robot's limits drawn in by `margin`, completed where the robot states none.

    A joint without position limits gets +-pi rad (+-0.5 m) about zero, or twice that from its only limit; without a
    speed limit 2 rad/s (0.5 m/s); without an acceleration limit three times its speed limit per second.

    Parameters
    ----------
    margin : fraction of each limit left unused, in [0, 1); of the half range for positions
    jerk : (n_v,) [rad/s^3 or m/s^3]; unlimited by default

    Raises
    ------
    RobotError
        when a joint cannot move at all.
    """
    if not 0.0 <= margin < 1.0:
        raise ExcitationError("limit margin out of range", expected="0 <= margin < 1", got=margin)
    rows = np.array([_joint_limits(joint) for joint in robot.joints])
    lower, upper, velocity, acceleration = rows.T
    inset = 0.5 * margin * (upper - lower)
    used = 1.0 - margin
    return MotionLimits(
        lower=lower + inset,
        upper=upper - inset,
        velocity=used * velocity,
        acceleration=used * acceleration,
        jerk=None if jerk is None else used * jerk,
    )


def _joint_limits(joint: Joint) -> tuple[float, float, float, float]:
    limits = joint.limits
    half_span = HALF_SPAN[joint.kind]
    lower, upper = limits.lower, limits.upper
    if np.isinf(lower) and np.isinf(upper):
        lower, upper = -half_span, half_span
    elif np.isinf(lower):
        lower = upper - 2.0 * half_span
    elif np.isinf(upper):
        upper = lower + 2.0 * half_span
    velocity = limits.velocity if np.isfinite(limits.velocity) else SPEED[joint.kind]
    fallback = ACCELERATION_PER_SPEED * velocity
    acceleration = limits.acceleration if np.isfinite(limits.acceleration) else fallback
    if min(upper - lower, velocity, acceleration) <= 0.0:
        got = f"position [{lower:g}, {upper:g}], velocity {velocity:g}, acceleration {acceleration:g}"
        raise RobotError(
            "the limits leave the joint no room to move",
            where=f"joint {joint.name}",
            got=got,
            remedy="correct the limits or lock the joint",
        )
    return lower, upper, velocity, acceleration
