"""The corner by which a motion passes a target: what its zone takes of both ways, and how long it lasts at least."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ExcitationError
from tauhat.excitation.point_to_point import Course
from tauhat.excitation.waypoints.curves import (
    Corner,
    CornerShape,
    JointCorner,
    LineCorner,
    LineWay,
    Way,
    line_corner_task,
)
from tauhat.excitation.waypoints.line_task import Line
from tauhat.excitation.waypoints.moves import LARGEST_PART, SAME, Zone
from tauhat.excitation.waypoints.ramps import Ramps
from tauhat.excitation.waypoints.settings import WaypointSettings
from tauhat.excitation.waypoints.time_law import RateLimits
from tauhat.robots.kinematics import forward_kinematics
from tauhat.robots.robot import Robot

_LEAST_PART = 1e-4  # of a way: what a zone takes of it at least while its size is searched for
_PARTS = 96
_SMALLER = 0.95  # how much a zone shrinks at a time while its corner leaves it
_MOST_SHRINKS = 200
_GRID = 65


class Bend(NamedTuple):
    """A corner and the shortest time that the limits of acceleration and jerk leave for it [s]."""

    corner: Corner
    least: float


class Neighbours(NamedTuple):
    """Two ways that follow one another.

    ending, beginning : limits of their fractions
    acceleration : part of the acceleration limits that may be used between them
    """

    first: Way
    second: Way
    ending: RateLimits
    beginning: RateLimits
    acceleration: float


def bend(robot: Robot, pair: Neighbours, zone: Zone, settings: WaypointSettings, name: str) -> Bend:
    """Return the corner between two ways inside a zone.

    Raises
    ------
    ExcitationError
        when the tool cannot pass it: names which.
    """
    first, second = pair.first, pair.second
    if isinstance(first, LineWay) and isinstance(second, LineWay):
        shape = _shape(_line_bounds(first.line, second.line, zone), pair, settings.ramps)
        corner = _line_corner(first, second, shape, name)
        return Bend(corner, _least_of_lines(first.line, second.line, shape, (settings, pair.acceleration)))
    joint_corner = _joint_corner(robot, pair, zone, settings)
    return Bend(joint_corner, _least_of_joints(robot, joint_corner, settings, pair.acceleration))


def _line_bounds(first: Line, second: Line, zone: Zone) -> tuple[float, float]:
    """Return the largest parts of two lines that lie in a zone."""
    if zone.part is not None:
        return zone.part, zone.part
    radius = zone.radius or 0.0
    bounds = [min(LARGEST_PART, radius / max(line.length, SAME)) for line in (first, second)]
    return bounds[0], bounds[1]


def _shape(bounds: tuple[float, float], pair: Neighbours, ramps: Ramps) -> CornerShape:
    """Return the parts of two ways, within bounds, that are passed in one time at the speeds they have there.

    These are the speeds at which a motion that stops at the target comes through the bound; so neither way has to wait
    for the other.
    """
    speeds = [
        min(limits.speed, float(np.sqrt(2.0 * limits.acceleration * bound)))
        for limits, bound in zip((pair.ending, pair.beginning), bounds, strict=True)
    ]
    time = min(bounds[0] / speeds[0], bounds[1] / speeds[1])
    return CornerShape(ending=time * speeds[0], beginning=time * speeds[1], ramps=ramps)


def _line_corner(first: LineWay, second: LineWay, shape: CornerShape, name: str) -> LineCorner:
    start = first.state(Course(np.array([1.0 - shape.ending]), np.zeros(1), np.zeros(1))).q[0]

    def curve(course: Course):  # type: ignore[no-untyped-def]
        return line_corner_task(first.line, second.line, shape=shape, course=course)

    knots = first.solver.follow(curve, start, name)
    return LineCorner(first=first.line, second=second.line, shape=shape, solver=first.solver, knots=knots)


def _joint_corner(robot: Robot, pair: Neighbours, zone: Zone, settings: WaypointSettings) -> JointCorner:
    """Return a corner of which the tool's way, as the joints take it, stays in the zone."""
    first, second = pair.first, pair.second
    if zone.part is not None:
        shape = _shape((zone.part, zone.part), pair, settings.ramps)
        return JointCorner(first=first, second=second, shape=shape)
    radius, frame = zone.radius or 0.0, settings.tool_frame(robot)
    target = forward_kinematics(robot, second.start, frame=frame).translation

    def reach(states: FloatArray) -> FloatArray:
        places = forward_kinematics(robot, states, frame=frame).translation
        return np.asarray(np.linalg.norm(places - target, axis=1))

    parts = LARGEST_PART * np.geomspace(_LEAST_PART, 1.0, _PARTS)
    ending = _largest_inside(parts, reach(first.state(_still(1.0 - parts)).q), radius)
    beginning = _largest_inside(parts, reach(second.state(_still(parts)).q), radius)
    grid = _still(np.linspace(0.0, 1.0, _GRID))
    for _ in range(_MOST_SHRINKS):
        shape = _shape((ending, beginning), pair, settings.ramps)
        corner = JointCorner(first=first, second=second, shape=shape)
        if reach(corner.state(grid).q).max() <= radius:
            return corner
        ending, beginning = _SMALLER * ending, _SMALLER * beginning
    raise ExcitationError("no corner fits into the zone", got=f"radius {radius:g}", remedy="a larger zone, or none")


def _largest_inside(parts: FloatArray, distances: FloatArray, radius: float) -> float:
    """Return the largest part before which the tool is never farther away than the radius."""
    outside = distances > radius
    first = int(outside.argmax()) if outside.any() else parts.size
    return float(parts[max(first - 1, 0)])


def _least_of_joints(robot: Robot, corner: JointCorner, settings: WaypointSettings, part: float) -> float:
    """Return the time in which the joints change from one way to the other at full acceleration."""
    limits, shape = settings.joint_limits(robot), corner.shape
    before = corner.first.state(Course(np.ones(1), np.ones(1), np.zeros(1))).dq[0]
    after = corner.second.state(Course(np.zeros(1), np.ones(1), np.zeros(1))).dq[0]
    change = np.abs(shape.beginning * after - shape.ending * before)
    ramps = settings.ramps
    least = float(np.sqrt((ramps.corner_acceleration * change / (part * limits.acceleration)).max()))
    if limits.jerk is None:
        return least
    return max(least, float(np.cbrt((ramps.corner_jerk * change / (part * limits.jerk)).max())))


def _least_of_lines(first: Line, second: Line, shape: CornerShape, overrides: tuple[WaypointSettings, float]) -> float:
    """Return the time in which the tool changes from one line to the other at its full acceleration."""
    settings, part = overrides
    tool, ramps = settings.tool, settings.ramps
    rotation = first.rotation @ first.turned(np.ones(1))[0]
    step = shape.beginning * second.step - shape.ending * first.step
    turn = shape.beginning * (rotation @ second.turn) - shape.ending * (first.rotation @ first.turn)
    least = 0.0
    for change, acceleration, jerk in (
        (float(np.linalg.norm(step)), tool.acceleration, tool.jerk),
        (float(np.linalg.norm(turn)), tool.turn_acceleration, tool.turn_jerk),
    ):
        by_acceleration = np.sqrt(ramps.corner_acceleration * change / (part * acceleration))
        by_jerk = np.cbrt(ramps.corner_jerk * change / (part * jerk))
        least = max(least, float(by_acceleration), float(by_jerk))
    return least


def _still(parts: FloatArray) -> Course:
    return Course(parts, np.zeros_like(parts), np.zeros_like(parts))
