"""Everything a motion must keep: limits of single joints, and those of several at once."""

from __future__ import annotations

from dataclasses import dataclass

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import ExcitationError
from tauhat.excitation.limits.joint_limits import MotionLimits, motion_limits
from tauhat.excitation.limits.motion_limit import MotionLimit
from tauhat.robots.robot import Robot


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LimitSet:
    """The limits of one robot at one place.

    robot : whose joint limits count, overridden where the place asks for it
    jerk : (n_v,) [rad/s^3 or m/s^3], None where there is no limit
    others : limits of several joints at once; those without rows are dropped
    home : (n_v,) a pose inside all limits around which the search begins [rad or m]; found where not stated
    start : (n_v,) the pose at which the motion starts and ends [rad or m]; free where not stated
    """

    robot: Robot
    jerk: FloatArray | None = None
    others: tuple[MotionLimit, ...] = ()
    home: FloatArray | None = None
    start: FloatArray | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "others", tuple(limit for limit in self.others if limit.parts))
        names = [limit.name for limit in self.others]
        doubled = sorted({name for name in names if names.count(name) > 1})
        if doubled:
            raise ExcitationError("two limits of one name", where="limits", got=", ".join(doubled))
        if self.home is not None and self.start is not None:
            raise ExcitationError("both a home and a start pose", where="limits", remedy="the start pose is enough")
        for name in ("jerk", "home", "start"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, frozen(name, value, (self.robot.n_v,), where="limits"))

    def of_joints(self, *, margin: float = 0.0) -> MotionLimits:
        """Return the limits of single joints, drawn in by `margin`."""
        return motion_limits(self.robot, margin=margin, jerk=self.jerk)

    def check_robot(self, robot: Robot) -> None:
        """Check that the limits are those of this robot.

        Raises
        ------
        ExcitationError
            when they are of another.
        """
        if robot.fingerprint != self.robot.fingerprint:
            raise ExcitationError("limits of another robot", expected=robot.name, got=self.robot.name)

    @property
    def distances(self) -> frozenset[str]:
        """The names of the limits whose margins count distances beyond a clearance, one for each `FAR`."""
        return frozenset(limit.name for limit in self.others if not limit.relative)
