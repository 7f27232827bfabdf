"""A robot as its controller sees it, and the moves of a motion with where each begins and ends."""

from __future__ import annotations

from dataclasses import dataclass, replace

from tauhat.arrays import FloatArray
from tauhat.excitation.waypoints.curves import JointWay, LineWay, Way
from tauhat.excitation.waypoints.motion import WaypointMotion, waypoint_motion
from tauhat.excitation.waypoints.moves import JointMove, LineMove, Move
from tauhat.excitation.waypoints.settings import WaypointSettings
from tauhat.export.programs.program import ProgramSettings
from tauhat.robots.kinematics import Pose, forward_kinematics
from tauhat.robots.robot import Robot


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cell:
    """A robot, how its motions are planned, and how its controller counts."""

    robot: Robot
    planned: WaypointSettings
    settings: ProgramSettings

    @property
    def frame(self) -> str:
        """Name of the frame that lines are planned for."""
        return self.planned.tool_frame(self.robot)

    def shown(self, q: FloatArray) -> FloatArray:
        """Return joint positions as the controller shows them, (n_v,) [rad or m]."""
        joints = self.settings.joints
        return q if joints is None else joints.shown(q)

    def meant(self, shown: FloatArray) -> FloatArray:
        """Return the joint positions of the robot for those of the controller, (n_v,) [rad or m]."""
        joints = self.settings.joints
        return shown if joints is None else joints.meant(shown)

    def tool_pose(self, q: FloatArray) -> Pose:
        """Return the tool's pose in the robot's base frame."""
        return forward_kinematics(self.robot, q, frame=self.frame)

    def shown_pose(self, pose: Pose) -> Pose:
        """Return a pose of the robot's base frame in that of the controller."""
        base = self.settings.base
        if base is None:
            return pose
        turned = base.rotation.T
        return Pose(rotation=turned @ pose.rotation, translation=turned @ (pose.translation - base.translation))

    def meant_pose(self, shown: Pose) -> Pose:
        """Return a pose of the controller's base frame in that of the robot."""
        base = self.settings.base
        if base is None:
            return shown
        translation = base.translation + base.rotation @ shown.translation
        return Pose(rotation=base.rotation @ shown.rotation, translation=translation)

    def target_pose(self, move: LineMove) -> Pose:
        """Return the pose that a line ends in, in the controller's base frame."""
        target = move.target
        return self.shown_pose(target if isinstance(target, Pose) else self.tool_pose(target))

    def line_end(self, begin: FloatArray, move: LineMove) -> FloatArray:
        """Return the joint positions in which a line ends that starts here, (n_v,) [rad or m].

        Raises
        ------
        ExcitationError
            when the tool cannot follow it.
        """
        if not isinstance(move.target, Pose):
            return move.target
        alone = replace(move, zone=None, dwell=0.0)
        single = waypoint_motion(self.robot, begin, [alone], settings=replace(self.planned, ending="stay"))
        return _ways(single)[0].end


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Leg:
    """A move with the joint positions at which it begins and ends, (n_v,) [rad or m].

    number : of the move, from 1 on
    last : whether no other move follows, so that the program stops there whatever the zone
    """

    number: int
    move: Move
    begin: FloatArray
    end: FloatArray
    last: bool

    @property
    def where(self) -> str:
        """What messages call it."""
        return f"move {self.number}"


def legs_of(motion: WaypointMotion) -> tuple[Leg, ...]:
    """Return the moves of a motion, the way back among them, without a zone at the end of the last."""
    ways = _ways(motion)
    count = len(ways)
    moves = (*motion.moves, JointMove(target=motion.start))[:count]
    return tuple(
        Leg(
            number=index + 1,
            move=replace(move, zone=None) if index + 1 == count else move,
            begin=ways[index].start,
            end=ways[index].end,
            last=index + 1 == count,
        )
        for index, move in enumerate(moves)
    )


def _ways(motion: WaypointMotion) -> dict[int, Way]:
    """Return the way of each move; corners leave at least a fifth of it."""
    return {piece.move: piece.curve for piece in motion.pieces if isinstance(piece.curve, JointWay | LineWay)}
