"""The work: a polishing path of straight passes over a surface, and the region around it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ModelError
from tauhat.excitation.limits.cartesian_limit import tool_frame
from tauhat.excitation.limits.joint_limits import motion_limits
from tauhat.excitation.task_design.regions import Freedom, PathRegion
from tauhat.excitation.waypoints.motion import WaypointMotion, waypoint_motion
from tauhat.excitation.waypoints.moves import LineMove, ToolLimits, Zone
from tauhat.excitation.waypoints.settings import WaypointSettings
from tauhat.robots.kinematics import Pose, forward_kinematics
from tauhat.robots.robot import Robot

HOMES: Mapping[str, tuple[float, ...]] = {
    "crs_a465": (0.0, 0.6, 1.4, 0.0, 1.1416, 0.0),
    "staubli_tx40": (0.0, 0.6, 1.5, 0.0, 1.0416, 0.0),
    "ur5e": (0.0, -1.3, 2.0, -2.2708, -1.5708, 0.0),
}
"""Positions over the surface by the arm's name, the tool pointing down on it [rad]."""
_TURN = 0.01  # [m] radius in which the tool turns from one pass to the next


@dataclass(frozen=True, slots=True, kw_only=True)
class Polishing:
    """Passes side by side in the tool's x-y plane around a position over the surface, the tool's orientation fixed.

    home : position over the surface, the middle of the path [rad or m]; that of `HOMES` by default
    length : of a pass, along the tool's x axis [m]
    passes : how many, there and back
    spacing : between neighbours [m]
    speed : of the tool [m/s]
    clearance : of the region around the path [m]
    freedom : of the tool's orientation in the region
    """

    home: tuple[float, ...] | None = None
    length: float = 0.2
    passes: int = 5
    spacing: float = 0.04
    speed: float = 0.05
    clearance: float = 0.05
    freedom: Freedom = field(default_factory=lambda: Freedom(tilt=0.3, spin=0.3))

    def __post_init__(self) -> None:
        for name in ("length", "spacing", "speed"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise ModelError(f"polishing path: {name}", expected="above zero", got=getattr(self, name))
        if self.passes < 1:
            raise ModelError("polishing path: passes", expected="at least 1", got=self.passes)

    def home_of(self, robot: Robot) -> FloatArray:
        """Return the position over the surface, (n_v,).

        Raises
        ------
        ModelError
            when there is none for this arm, or it is of another number of joints.
        """
        known = self.home or HOMES.get(robot.name)
        where = f"polishing path, {robot.name}"
        if known is None:
            raise ModelError("no position over the surface", where=where, expected=f"{', '.join(HOMES)}, or a home")
        if len(known) != robot.n_v:
            raise ModelError("position over the surface", where=where, expected=f"{robot.n_v} joints", got=len(known))
        return np.array(known)

    def poses(self, robot: Robot) -> tuple[Pose, ...]:
        """Return the ends of all passes in the order in which they are reached."""
        centre = self._centre(robot)
        across = self.spacing * (np.arange(self.passes) - 0.5 * (self.passes - 1))
        points = []
        for number, y in enumerate(across):
            ends = (-0.5, 0.5) if number % 2 == 0 else (0.5, -0.5)
            points += [np.array([end * self.length, y, 0.0]) for end in ends]
        return tuple(
            Pose(rotation=centre.rotation, translation=centre.translation + centre.rotation @ point) for point in points
        )

    def path(self, robot: Robot) -> WaypointMotion:
        """Return the motion over the surface, from home to home; moves from one pass to the next are rounded.

        Raises
        ------
        ExcitationError
            when the arm does not reach the path in lines.
        """
        *poses, last = self.poses(robot)
        moves = [LineMove(target=pose, zone=Zone(radius=_TURN)) for pose in poses]
        moves += [LineMove(target=last), LineMove(target=self._centre(robot))]
        settings = WaypointSettings(limits=motion_limits(robot), tool=ToolLimits(speed=self.speed))
        return waypoint_motion(robot, self.home_of(robot), moves, settings=settings)

    def region(self, robot: Robot) -> PathRegion:
        """Return the tube around the path."""
        return PathRegion(poses=self.poses(robot), clearance=self.clearance, freedom=self.freedom)

    def _centre(self, robot: Robot) -> Pose:
        return forward_kinematics(robot, self.home_of(robot), frame=tool_frame(robot, None).name)
