"""Point-to-point motions: from pose to pose at rest, all joints arriving together, with waiting times in between."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple, Protocol

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import ExcitationError
from tauhat.excitation.limits.joint_limits import MotionLimits
from tauhat.excitation.trajectory import MotionSamples

_LEAST_TIME = 1e-3  # [s] of a way, where two poses are the same


class Course(NamedTuple):
    """Part of the way and its derivatives by the part of the time, (n,) each."""

    s: FloatArray
    ds: FloatArray
    dds: FloatArray


class Profile(Protocol):
    """How a way from 0 to 1 is passed in a time from 0 to 1, at rest at both ends.

    peak_speed, peak_acceleration : largest of the derivatives
    """

    @property
    def peak_speed(self) -> float: ...  # noqa: D102

    @property
    def peak_acceleration(self) -> float: ...  # noqa: D102

    def course(self, part: FloatArray) -> Course:
        """Return the way at these parts of the time, (n,) in 0 to 1."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Quintic:
    """The polynomial `10 u^3 - 15 u^4 + 6 u^5`: velocity and acceleration are zero at both ends."""

    peak_speed: ClassVar[float] = 1.875
    peak_acceleration: ClassVar[float] = float(10.0 / np.sqrt(3.0))

    def course(self, part: FloatArray) -> Course:
        """Return the way at these parts of the time."""
        u = part
        s = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
        return Course(s, 30.0 * u**2 * (1.0 - u) ** 2, 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u))


@dataclass(frozen=True, slots=True, kw_only=True)
class Trapezoidal:
    """Constant acceleration, constant speed, constant deceleration; `ramp` is the part of the time of each ramp."""

    ramp: float = 0.3

    def __post_init__(self) -> None:
        if not 0.0 < self.ramp <= 0.5:
            raise ExcitationError("ramp of a trapezoidal profile", expected="0 < ramp <= 0.5", got=self.ramp)

    @property
    def peak_speed(self) -> float:
        """Speed between the ramps."""
        return 1.0 / (1.0 - self.ramp)

    @property
    def peak_acceleration(self) -> float:
        """Acceleration in the ramps."""
        return self.peak_speed / self.ramp

    def course(self, part: FloatArray) -> Course:
        """Return the way at these parts of the time."""
        ahead, behind = part < self.ramp, part > 1.0 - self.ramp
        speed, left = self.peak_speed, 1.0 - part
        s = np.where(ahead, 0.5 * self.peak_acceleration * part**2, speed * (part - 0.5 * self.ramp))
        s = np.where(behind, 1.0 - 0.5 * self.peak_acceleration * left**2, s)
        ds = speed * np.minimum(1.0, np.minimum(part, left) / self.ramp)
        dds = self.peak_acceleration * (ahead.astype(float) - behind)
        return Course(s, ds, dds)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PointToPoint:
    """From pose to pose, with a wait at each.

    poses : (n, n_v) two or more [rad or m]
    times : (n - 1,) of each way [s]
    wait : at every pose, the first and the last too [s]
    profile : of every way
    """

    poses: FloatArray
    times: FloatArray
    wait: float = 0.0
    profile: Profile = field(default_factory=Quintic)

    def __post_init__(self) -> None:
        poses = frozen("poses", self.poses, (None, None), where="point to point")
        times = frozen("times", self.times, (max(len(poses) - 1, 0),), where="point to point")
        if len(poses) < 2 or not (times > 0.0).all() or not 0.0 <= self.wait < np.inf:
            raise ExcitationError(
                "point to point", expected="two poses or more, times above zero, a wait of at least 0"
            )
        object.__setattr__(self, "poses", poses)
        object.__setattr__(self, "times", times)

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return int(self.poses.shape[1])

    @property
    def duration(self) -> float:
        """Time from start to end [s]."""
        return float(self.times.sum()) + len(self.poses) * self.wait

    @property
    def departures(self) -> FloatArray:
        """When each way begins, (n - 1,) [s]; the pose before has been held for `wait`."""
        ways = np.concatenate([[0.0], np.cumsum(self.times)[:-1]])
        return np.asarray(ways + self.wait * np.arange(1, len(self.poses)))

    def sample(self, t: FloatArray) -> MotionSamples:
        """Return the motion at the times t, (n_t,) [s]."""
        begin = self.departures
        way = np.clip(np.searchsorted(begin, t, side="right") - 1, 0, len(begin) - 1)
        span = self.times[way]
        course = self.profile.course(np.clip((t - begin[way]) / span, 0.0, 1.0))
        moving = (t >= begin[way]) & (t <= begin[way] + span)
        step = self.poses[way + 1] - self.poses[way]
        return MotionSamples(
            t=t,
            q=self.poses[way] + course.s[:, None] * step,
            dq=(np.where(moving, course.ds / span, 0.0))[:, None] * step,
            ddq=(np.where(moving, course.dds / span**2, 0.0))[:, None] * step,
        )


def point_to_point(
    poses: FloatArray, limits: MotionLimits, *, wait: float = 0.0, profile: Profile | None = None, speed: float = 1.0
) -> PointToPoint:
    """Return the fastest motion through the poses inside the limits of position, speed and acceleration.

    Parameters
    ----------
    poses : (n, n_v) [rad or m]
    wait : at every pose [s]
    profile : of every way; quintic by default
    speed : part of the fastest speed, in (0, 1]

    Raises
    ------
    ExcitationError
        when a pose is outside the limits.
    """
    poses = frozen("poses", poses, (None, limits.lower.size), where="point to point")
    check_inside(poses, limits)
    if not 0.0 < speed <= 1.0:
        raise ExcitationError("speed of a motion", expected="0 < speed <= 1", got=speed)
    shape = profile or Quintic()
    step = np.abs(np.diff(poses, axis=0))
    by_speed = shape.peak_speed * step / limits.velocity
    by_acceleration = np.sqrt(shape.peak_acceleration * step / limits.acceleration)
    times = np.maximum(np.maximum(by_speed, by_acceleration).max(axis=1), _LEAST_TIME) / speed
    return PointToPoint(poses=poses, times=times, wait=wait, profile=shape)


def check_inside(poses: FloatArray, limits: MotionLimits) -> None:
    """Refuse poses outside the limits of position.

    Raises
    ------
    ExcitationError
        naming the first.
    """
    outside = (poses < limits.lower) | (poses > limits.upper)
    if outside.any():
        pose, joint = (int(index) for index in np.argwhere(outside)[0])
        raise ExcitationError(
            f"pose {pose + 1} is outside the limits of joint {joint + 1}",
            expected=f"{limits.lower[joint]:g} to {limits.upper[joint]:g}", got=f"{poses[pose, joint]:g}",
        )  # fmt: skip
