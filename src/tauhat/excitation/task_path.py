"""A task path: straight lines between joint poses at constant speed, rounded at the corners, from rest to rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import ExcitationError
from tauhat.excitation.limits.joint_limits import MotionLimits
from tauhat.excitation.point_to_point import check_inside
from tauhat.excitation.trajectory import MotionSamples


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TaskPath:
    """A polyline in joint space, averaged twice over windows of `blend` seconds.

    The mean of a polyline over a moving window rounds its corners, never leaves its convex hull and is never faster;
    the second mean makes the acceleration continuous. With P'' the polyline's second antiderivative, b the window and
    D^2 the second difference over b, `q = D^2 P'' / b^2`, and so are dq and ddq of the antiderivatives below it.

    poses : (n, n_v) two or more [rad or m]
    times : (n - 1,) between them [s]
    blend : [s], at most the shortest of these times
    """

    poses: FloatArray
    times: FloatArray
    blend: float

    def __post_init__(self) -> None:
        poses = frozen("poses", self.poses, (None, None), where="task path")
        times = frozen("times", self.times, (max(len(poses) - 1, 0),), where="task path")
        if len(poses) < 2 or not (times > 0.0).all() or not 0.0 < self.blend <= times.min():
            raise ExcitationError(
                "task path", expected="two poses or more, 0 < blend <= the shortest time between them"
            )
        object.__setattr__(self, "poses", poses)
        object.__setattr__(self, "times", times)

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return int(self.poses.shape[1])

    @property
    def duration(self) -> float:
        """Time from start to end [s]: that of the polyline and two windows."""
        return float(self.times.sum()) + 2.0 * self.blend

    def sample(self, t: FloatArray) -> MotionSamples:
        """Return the motion at the times t, (n_t,) [s]."""
        b = self.blend
        late, middle, early = (self._antiderivatives(t - lag) for lag in (0.0, b, 2.0 * b))
        ddq, dq, q = (
            (after - 2.0 * centre + before) / b**2
            for after, centre, before in zip(late, middle, early, strict=True)
        )  # fmt: skip
        return MotionSamples(t=t, q=q, dq=dq, ddq=ddq)

    def _antiderivatives(self, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the polyline, which stands before and after, and its first and second antiderivative, (n_t, n_v)."""
        knots = np.concatenate([[0.0], np.cumsum(self.times)])
        slopes = np.diff(self.poses, axis=0) / self.times[:, None]
        slopes = np.concatenate([np.zeros((1, self.n_v)), slopes, np.zeros((1, self.n_v))])
        bends = np.diff(slopes, axis=0)  # of slope at each knot
        past = np.maximum(np.subtract.outer(t, knots), 0.0)
        q, first, second = (past**power / scale @ bends for power, scale in ((1, 1.0), (2, 2.0), (3, 6.0)))
        start, time = self.poses[0], t[:, None]
        return start + q, start * time + first, start * time**2 / 2.0 + second


def task_path(poses: FloatArray, limits: MotionLimits, *, speed: float = 0.5) -> TaskPath:
    """Return the path through the poses inside the limits of position, speed and acceleration.

    The corners are rounded over as long a time as the shortest way takes, or less where acceleration allows.

    Parameters
    ----------
    poses : (n, n_v) [rad or m]; passed by at the corners, not through them
    speed : part of the largest speed, in (0, 1]

    Raises
    ------
    ExcitationError
        when a pose is outside the limits, or two that follow one another are the same.
    """
    poses = frozen("poses", poses, (None, limits.lower.size), where="task path")
    check_inside(poses, limits)
    step = np.diff(poses, axis=0)
    if not 0.0 < speed <= 1.0 or len(poses) < 2 or not np.abs(step).max(axis=1).all():
        raise ExcitationError("task path", expected="two poses or more, each other than the last, 0 < speed <= 1")
    times = (np.abs(step) / (speed * limits.velocity)).max(axis=1)
    slopes = np.pad(step / times[:, None], ((1, 1), (0, 0)))
    # a corner's acceleration is its change of slope over the window; corners closer than two windows add up, and with
    # windows no longer than the shortest way at most two do
    wanted = 2.0 * float((np.abs(np.diff(slopes, axis=0)) / limits.acceleration).max())
    blend = float(times.min())
    stretch = np.sqrt(max(1.0, wanted / blend))
    return TaskPath(poses=poses, times=stretch * times, blend=stretch * blend)
