"""From a program of moves to ways and corners: where the motion goes, before when."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ExcitationError
from tauhat.excitation.limits.joint_limits import MotionLimits
from tauhat.excitation.waypoints.corners import Bend, Neighbours, bend
from tauhat.excitation.waypoints.curves import JointWay, LineWay, Way
from tauhat.excitation.waypoints.line_solver import LineSolver, spare_joints
from tauhat.excitation.waypoints.line_task import Line
from tauhat.excitation.waypoints.moves import SAME, JointMove, LineMove, Move, ToolLimits
from tauhat.excitation.waypoints.settings import WaypointSettings
from tauhat.excitation.waypoints.time_law import RateLimits
from tauhat.robots.kinematics import Pose, forward_kinematics
from tauhat.robots.robot import Robot
from tauhat.robots.transforms import rotation_vector

_TAUGHT = 1e-6  # [rad or m] within which a line reaches the joint positions it was given


class Route(NamedTuple):
    """The ways of a motion and what joins them.

    ways : one a move
    limits : of the fraction of each way, from its overrides and the limits of joints or tool
    bends : between a way and the next, None where the motion stops
    dwells : after each way [s]
    """

    ways: tuple[Way, ...]
    limits: tuple[RateLimits, ...]
    bends: tuple[Bend | None, ...]
    dwells: tuple[float, ...]


def route(robot: Robot, start: FloatArray, moves: Sequence[Move], settings: WaypointSettings) -> Route:
    """Return the ways and corners of a program.

    Raises
    ------
    ExcitationError
        when a target is outside the limits, the same as the one before, or not reached: names the move.
    """
    limits, frame = settings.joint_limits(robot), settings.tool_frame(robot)
    _check_position(start, limits, "the start")
    ways: list[Way] = []
    solver: LineSolver | None = None
    for number, move in enumerate(moves, 1):
        here = ways[-1].end if ways else start
        if isinstance(move, LineMove):
            solver = solver or LineSolver(robot, frame, spare_joints(robot, here, frame), settings.singular)
            ways.append(_line_way(solver, here, move, f"move {number}"))
        else:
            ways.append(_joint_way(here, move, limits, f"move {number}"))
    rates = [
        joint_rates(way.end - way.start, limits, move)
        if isinstance(way, JointWay)
        else _line_rates(way, limits, settings.tool, move)
        for way, move in zip(ways, moves, strict=True)
    ]
    bends: list[Bend | None] = []
    for k, (move, after) in enumerate(pairwise(moves)):
        least = min(move.acceleration, after.acceleration)
        pair = Neighbours(ways[k], ways[k + 1], rates[k], rates[k + 1], least)
        bends.append(
            None if move.zone is None else bend(robot, pair, move.zone, settings, f"the corner at move {k + 1}")
        )
    return Route(tuple(ways), tuple(rates), tuple(bends), tuple(move.dwell for move in moves))


def joint_rates(way: FloatArray, limits: MotionLimits, move: Move) -> RateLimits:
    """Return the limits of the fraction of a way on which every joint keeps its own.

    way : (n_v,) from start to end [rad or m]
    """
    moving = np.abs(way) > 0.0
    lengths = np.abs(way[moving])
    speed, acceleration = limits.velocity[moving] / lengths, limits.acceleration[moving] / lengths
    jerk = np.inf if limits.jerk is None else float((limits.jerk[moving] / lengths).min(initial=np.inf))
    return RateLimits(
        move.speed * float(speed.min(initial=np.inf)),
        move.acceleration * float(acceleration.min(initial=np.inf)),
        move.acceleration * jerk,
    )


def _line_rates(way: LineWay, limits: MotionLimits, tool: ToolLimits, move: Move) -> RateLimits:
    """Return the limits of the fraction of a line on which the tool keeps its own.

    A line on which only free joints move keeps theirs.
    """
    path = (tool.speed, tool.acceleration, tool.jerk)
    turn = (tool.turn_speed, tool.turn_acceleration, tool.turn_jerk)
    sizes = ((path, way.line.length), (turn, way.line.angle))
    found = [[value / size for value in values] for values, size in sizes if size > SAME]
    if not found:
        return joint_rates(way.end - way.start, limits, move)
    speed, acceleration, jerk = (min(values) for values in zip(*found, strict=True))
    return RateLimits(move.speed * speed, move.acceleration * acceleration, move.acceleration * jerk)


def _joint_way(here: FloatArray, move: JointMove, limits: MotionLimits, name: str) -> JointWay:
    _check_position(move.target, limits, f"the target of {name}")
    if np.abs(move.target - here).max() <= SAME:
        raise _goes_nowhere(name)
    return JointWay(start=here, end=move.target)


def _line_way(solver: LineSolver, here: FloatArray, move: LineMove, name: str) -> LineWay:
    robot, frame, spare = solver.robot, solver.frame, list(solver.spare)
    target = move.target
    taught = None if isinstance(target, Pose) else target
    if taught is not None and taught.size != robot.n_v:
        raise ExcitationError("joint positions of another robot", where=name, expected=robot.n_v, got=taught.size)
    goal = target if isinstance(target, Pose) else forward_kinematics(robot, target, frame=frame)
    pose = forward_kinematics(robot, here, frame=frame)
    line = Line(
        rotation=pose.rotation,
        translation=pose.translation,
        step=goal.translation - pose.translation,
        turn=rotation_vector(pose.rotation.T @ goal.rotation),
        spare=here[spare],
        spare_step=np.zeros(len(spare)) if taught is None else taught[spare] - here[spare],
    )
    if max(line.length, line.angle, np.abs(line.spare_step).max(initial=0.0)) <= SAME:
        raise _goes_nowhere(name)
    way = LineWay(line=line, solver=solver, knots=solver.follow(line.task, here, name))
    if taught is not None and np.abs(way.end - taught).max() > _TAUGHT:
        worst = int(np.abs(way.end - taught).argmax())
        raise ExcitationError(
            "the line ends in another configuration of the arm than its target", where=name,
            expected=f"{taught[worst]:.4g} of {robot.joint_names[worst]}", got=f"{way.end[worst]:.4g}",
            remedy="give the pose, or use a joint move",
        )  # fmt: skip
    return way


def _check_position(q: FloatArray, limits: MotionLimits, name: str) -> None:
    if q.size != limits.lower.size:
        raise ExcitationError("joint positions of another robot", where=name, expected=limits.lower.size, got=q.size)
    outside = (q < limits.lower) | (q > limits.upper)
    if outside.any():
        joint = int(outside.argmax())
        raise ExcitationError(
            f"{name} is outside the limits of joint {joint + 1}",
            expected=f"{limits.lower[joint]:g} to {limits.upper[joint]:g}", got=f"{q[joint]:g}",
        )  # fmt: skip


def _goes_nowhere(name: str) -> ExcitationError:
    return ExcitationError(
        f"{name} goes nowhere", expected="a target other than the last", remedy="drop it, or give the last a dwell"
    )
