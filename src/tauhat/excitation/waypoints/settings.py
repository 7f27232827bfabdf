"""What a program of moves is planned for: limits, tool, ramps, and what happens at its end."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal, TypeAlias, get_args

import numpy as np

from tauhat.errors import ExcitationError
from tauhat.excitation.limits.cartesian_limit import tool_frame
from tauhat.excitation.limits.joint_limits import MotionLimits, motion_limits
from tauhat.excitation.waypoints.moves import ToolLimits
from tauhat.excitation.waypoints.ramps import AccelerationLimited, JerkLimited, Ramps, ramps_named
from tauhat.robots.inverse_kinematics import LEAST_SINGULAR_VALUE
from tauhat.robots.robot import Robot

Ending: TypeAlias = Literal["stay", "return"]
"""Whether a motion ends at the last target, or goes back to its start and then repeats."""

_JOINT_FIELDS = ("lower", "upper", "velocity", "acceleration", "jerk")


@dataclass(frozen=True, slots=True, kw_only=True)
class WaypointSettings:
    """How a program of moves is planned.

    limits : of the joints; those of `motion_limits` where not stated
    tool : what line moves may ask of the tool
    ramps : how speeds change; `JerkLimited` needs limits of jerk
    frame : the tool's frame; the robot's last where not stated
    singular : smallest singular value of the Jacobian, in metres and radians, that lines may pass
    ending : "return" adds a joint move back to the start, after which the motion repeats
    """

    limits: MotionLimits | None = None
    tool: ToolLimits = field(default_factory=ToolLimits)
    ramps: Ramps = field(default_factory=AccelerationLimited)
    frame: str | None = None
    singular: float = LEAST_SINGULAR_VALUE
    ending: Ending = "stay"

    def __post_init__(self) -> None:
        if self.ending not in get_args(Ending):
            raise ExcitationError("ending of a motion", expected=" or ".join(get_args(Ending)), got=self.ending)
        if not 0.0 < self.singular < np.inf:
            raise ExcitationError("smallest singular value of a line", expected="above zero", got=self.singular)

    def joint_limits(self, robot: Robot) -> MotionLimits:
        """Return the limits of the joints, after checking that they suit the robot and the ramps.

        Raises
        ------
        ExcitationError
            when they are of another number of joints, or the ramps cannot keep them.
        """
        limits = self.limits or motion_limits(robot)
        if limits.lower.size != robot.n_v:
            raise ExcitationError(
                "limits of another robot", where="waypoints", expected=f"{robot.n_v} joints", got=limits.lower.size
            )
        jerky = isinstance(self.ramps, JerkLimited)
        if jerky and limits.jerk is None:
            raise ExcitationError(
                "ramps of bounded jerk need limits of jerk", where="waypoints",
                remedy="give limits=motion_limits(robot, jerk=...)",
            )  # fmt: skip
        if not jerky and limits.jerk is not None:
            raise ExcitationError(
                f"{self.ramps.key} ramps cannot keep a limit of jerk", where="waypoints", remedy="use JerkLimited"
            )
        return limits

    def tool_frame(self, robot: Robot) -> str:
        """Return the name of the tool's frame.

        Raises
        ------
        ExcitationError
            when there is no such frame.
        """
        return tool_frame(robot, self.frame).name

    def to_dict(self) -> dict[str, Any]:
        """Return plain data that JSON can hold and `from_dict` reads back exactly."""
        limits = None
        if self.limits is not None:
            values = {name: getattr(self.limits, name) for name in _JOINT_FIELDS}
            limits = {name: None if value is None else value.tolist() for name, value in values.items()}
        return {
            "limits": limits,
            "tool": asdict(self.tool),
            "ramps": self.ramps.key,
            "frame": self.frame,
            "singular": self.singular,
            "ending": self.ending,
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> WaypointSettings:
        """Return the settings that `to_dict` described.

        Raises
        ------
        ExcitationError
            when a field is missing, unknown or of the wrong kind.
        """
        fields = dict(data)
        try:
            limits, tool, ramps = fields.pop("limits"), fields.pop("tool"), fields.pop("ramps")
            return cls(
                limits=None if limits is None else MotionLimits(**limits),
                tool=ToolLimits(**tool),
                ramps=ramps_named(ramps),
                **fields,
            )
        except (KeyError, TypeError) as error:
            raise ExcitationError(
                "data of waypoint settings is damaged", got=f"{type(error).__name__}: {error}"
            ) from error
