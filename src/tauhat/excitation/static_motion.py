"""A motion that holds poses after coming from both sides, so that gravity and friction can be told apart."""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import ExcitationError
from tauhat.excitation.limits import motion_limits
from tauhat.excitation.point_to_point import PointToPoint, check_inside, point_to_point
from tauhat.robots.robot import Robot


def static_motion(
    robot: Robot, poses: FloatArray, *, hold: float = 2.0, away: float = 0.1, speed: float = 0.1
) -> PointToPoint:
    """Return a slow motion that comes to each pose from below and from above with all joints, and holds it each time.

    Parameters
    ----------
    poses : (n, n_v) to hold [rad or m]
    hold : time at each pose [s]
    away : how far from the pose each approach begins [rad or m]
    speed : part of the joints' speed limits

    Raises
    ------
    ExcitationError
        when a pose, or the start of an approach to it, is outside the limits.
    """
    limits = motion_limits(robot)
    held = frozen("poses", poses, (None, robot.n_v), where="static motion")
    if not 0.0 < away < np.inf or not 0.0 < hold < np.inf:
        raise ExcitationError("static motion", expected="hold and away above zero", got=f"hold {hold:g}, away {away:g}")
    check_inside(held - away, limits)
    check_inside(held + away, limits)
    course = [pose + side for pose in held for side in (-away, 0.0, away, 0.0)]
    return point_to_point(np.array(course), limits, wait=hold, speed=speed)
