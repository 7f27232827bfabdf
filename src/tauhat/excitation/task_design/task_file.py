"""`task.toml`: where the work is, and how programs that calibrate the arm there are searched for; every key checked.

home = [0.3, -1.3, 1.6, -1.8, -1.4, 0]  # [rad or m] begins and ends every program; or [home] with q and unit = "deg"
frame = "tool"                          # the robot's last frame by default

[region]
kind = "path"                           # "box", "poses" or "path"
points = [[-0.6, -0.3, 0.3], [-0.4, -0.3, 0.3]]  # of the path [m], or [[region.points]] with xyz and rpy each
rpy = [3.1416, 0, 0]                    # the tool's orientation at all points; that at home where not stated [rad]
clearance = 0.03                        # beside the path, or around each pose [m]
tilt = 0.2                              # how far the tool may lean away from its orientation [rad]
spin = 0.5                              # how far it may turn about its own axis, either way [rad]
# lower, upper                          # of a box: corners in the base frame [m]
# poses = [[q...], ...]                 # of poses: taught joint positions, or [[region.poses]] with xyz and rpy each
# unit = "rad"                          # of taught joint positions, or "deg"

[[stages]]                              # one after the other; a fast and a slow one where none is stated
name = "fast"
columns = ["inertial"]                  # what it is for: "inertial", "gravity", "friction"
points = 10                             # via-points of the program
seconds = 30                            # recorded; the program repeats as often as it fits
speed = [0.4, 1.0]                      # least and largest part of the limits that a move asks for
acceleration = [0.4, 1.0]
zone = 0.4                              # largest part of a way that a fly-by zone takes, 0 to stop everywhere
radius = 0.05                           # makes zones radii, as URScript and RAPID want them: the largest [m]
dwell = 0.2                             # at points where it stops [s]
moves = "joint"                         # or "line"
weight = 1.0                            # of its readings beside those of other stages

[line]                                  # what lines may ask of the tool
speed = 0.25                            # [m/s]; acceleration, jerk, turn_speed, turn_acceleration, turn_jerk likewise

[search]
population = 40
generations = 40
islands = 2                             # populations side by side
criterion = "mixed"                     # condition, d, a or e
margin = 0.05                           # part of every limit that is left unused
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from dataclasses import fields as fields_of
from pathlib import Path
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ArrayError, ExcitationError, RobotError
from tauhat.excitation.criteria import criterion_named
from tauhat.excitation.limits.cartesian_limit import tool_frame
from tauhat.excitation.task_design.blocks import block_named
from tauhat.excitation.task_design.design import USUAL_SEARCH, TaskSettings
from tauhat.excitation.task_design.regions import BoxRegion, Freedom, PathRegion, PosesRegion, TaskRegion
from tauhat.excitation.task_design.stages import TaskStage
from tauhat.excitation.waypoints.moves import ToolLimits
from tauhat.files import read_text
from tauhat.robots.kinematics import Pose, forward_kinematics
from tauhat.robots.robot import Robot
from tauhat.robots.toml_fields import TomlFields
from tauhat.robots.transforms import rotation_from_rpy

_LARGEST_FILE = 2**20  # [bytes]
_MOST_POSES = 1000
_MOST = 100_000  # individuals, generations, islands, points: more is a slip of the pen
_SECTIONS = ("home", "frame", "region", "stages", "line", "search")
_FREEDOM = ("kind", "tilt", "spin")
_REGION_KEYS = {
    "box": (*_FREEDOM, "lower", "upper", "rpy"),
    "poses": (*_FREEDOM, "poses", "unit", "clearance"),
    "path": (*_FREEDOM, "points", "rpy", "clearance"),
}
_STAGE_NUMBERS = ("seconds", "zone", "radius", "dwell", "weight")
_STAGE_RANGES = ("speed", "acceleration")
_STAGE_KEYS = ("name", "columns", "points", "moves", *_STAGE_NUMBERS, *_STAGE_RANGES)
_SEARCH_KEYS = ("population", "generations", "islands", "criterion", "margin")


def load_task(path: str | Path, robot: Robot) -> TaskSettings:
    """Return the task that a TOML file states for a robot.

    Raises
    ------
    ExcitationError
        missing file, not TOML, unknown keys, values of the wrong kind or out of range.
    """
    return parse_task(read_text(path, error=ExcitationError, largest=_LARGEST_FILE), robot, where=str(path))


def parse_task(text: str, robot: Robot, *, where: str = "task") -> TaskSettings:
    """Return the task that TOML text states for a robot.

    Parameters
    ----------
    where : what messages call the text

    Raises
    ------
    ExcitationError
        as `load_task`.
    """
    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        raise ExcitationError("not valid TOML", where=where, got=error) from error
    try:
        return _settings(TomlFields(data, where), robot)
    except (RobotError, ArrayError, ExcitationError) as error:
        place = error.where if error.where.startswith(where) else f"{where}, {error.where}".rstrip(", ")
        raise ExcitationError(
            error.what, where=place, expected=error.expected, got=error.got, remedy=error.remedy
        ) from error


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Tool:
    """The frame whose poses are meant, and its orientation where none is stated: that at home."""

    robot: Robot
    frame: str
    rotation: FloatArray

    def at(self, q: FloatArray) -> Pose:
        return forward_kinematics(self.robot, q, frame=self.frame)

    def stated(self, fields: TomlFields) -> Pose:
        return Pose(rotation=self.turned(fields), translation=np.array(fields.row("xyz", 3)))

    def turned(self, fields: TomlFields) -> FloatArray:
        return rotation_from_rpy(*fields.row("rpy", 3)) if "rpy" in fields.table else self.rotation


def _settings(fields: TomlFields, robot: Robot) -> TaskSettings:
    fields.refuse_unknown(_SECTIONS)
    frame = tool_frame(robot, fields.text("frame") if "frame" in fields.table else None).name
    home = _home(fields, robot)
    line = fields.subtable("line")
    line.refuse_unknown(field.name for field in fields_of(ToolLimits))
    stated = _search(fields.subtable("search"))
    if "stages" in fields.table:
        stated["stages"] = tuple(map(_stage, fields.subtables("stages")))
    tool = _Tool(robot=robot, frame=frame, rotation=forward_kinematics(robot, home, frame=frame).rotation)
    return TaskSettings(
        region=_region(fields, tool),
        home=home,
        frame=frame,
        tool=ToolLimits(**{key: line.number(key) for key in line.table}),
        **stated,
    )


def _home(fields: TomlFields, robot: Robot) -> FloatArray:
    if not isinstance(fields.table.get("home"), Mapping):
        return np.array(fields.row("home", robot.n_v))
    table = fields.subtable("home")
    table.refuse_unknown(("q", "unit"))
    return _positions("q", table, _factors(table, robot))


def _factors(fields: TomlFields, robot: Robot) -> FloatArray:
    """Return what makes joint positions of a table's unit radians or metres, (n_v,)."""
    degrees = fields.choice("unit", ("rad", "deg"), "rad") == "deg"
    revolute = np.array([joint.kind == "revolute" for joint in robot.joints])
    return np.where(revolute & degrees, np.pi / 180.0, 1.0)


def _positions(key: str, fields: TomlFields, factors: FloatArray) -> FloatArray:
    return np.asarray(factors * np.array(fields.row(key, factors.size)))


def _region(fields: TomlFields, tool: _Tool) -> TaskRegion:
    if "region" not in fields.table:
        raise ExcitationError("a region is missing", where=fields.where, expected="[region] with its kind")
    table = fields.subtable("region")
    kind = table.choice("kind", tuple(_REGION_KEYS))
    table.refuse_unknown(_REGION_KEYS[kind])
    freedom = Freedom(tilt=table.number("tilt", 0.0), spin=table.number("spin", 0.0))
    if kind == "box":
        lower, upper = (np.array(table.row(key, 3)) for key in ("lower", "upper"))
        return BoxRegion(lower=lower, upper=upper, rotation=tool.turned(table), freedom=freedom)
    clearance = table.number("clearance", 0.0)
    if kind == "poses":
        return PosesRegion(poses=_poses(table, tool), clearance=clearance, freedom=freedom)
    return PathRegion(poses=_points(table, tool), clearance=clearance, freedom=freedom)


def _poses(fields: TomlFields, tool: _Tool) -> tuple[Pose, ...]:
    """Return taught poses: of joint positions, or stated as poses."""
    factors = _factors(fields, tool.robot)
    return tuple(
        tool.at(_positions("pose", entry, factors)) if "pose" in entry.table else tool.stated(entry)
        for entry in _entries(fields, "poses")
    )


def _points(fields: TomlFields, tool: _Tool) -> tuple[Pose, ...]:
    """Return the poses along a path: points with the orientation of all, or each with its own."""
    turned = replace(tool, rotation=tool.turned(fields))
    return tuple(
        Pose(rotation=turned.rotation, translation=np.array(entry.row("point", 3)))
        if "point" in entry.table
        else turned.stated(entry)
        for entry in _entries(fields, "points")
    )


def _entries(fields: TomlFields, key: str) -> Iterator[TomlFields]:
    """Yield each entry of a list as a table; numbers alone stand under the key's singular."""
    entries, one = fields.table.get(key), key.removesuffix("s")
    if not isinstance(entries, list) or not 1 <= len(entries) <= _MOST_POSES:
        expected = f"a list of 1 to {_MOST_POSES} {key}"
        raise ExcitationError(f"{key} has the wrong form", where=fields.where, expected=expected)
    for number, entry in enumerate(entries, start=1):
        where = f"{fields.where}, {one} {number}"
        table = TomlFields(entry if isinstance(entry, Mapping) else {one: entry}, where)
        if isinstance(entry, Mapping):
            table.refuse_unknown(("xyz", "rpy"))
        yield table


def _stage(fields: TomlFields) -> TaskStage:
    fields.refuse_unknown(_STAGE_KEYS)
    columns = fields.table.get("columns")
    if not isinstance(columns, list) or not all(isinstance(name, str) for name in columns):
        raise ExcitationError("columns has the wrong form", where=fields.where, expected="a list of names of blocks")
    values: dict[str, Any] = {key: fields.number(key) for key in _STAGE_NUMBERS if key in fields.table}
    values |= {key: fields.row(key, 2) for key in _STAGE_RANGES if key in fields.table}
    if "points" in fields.table:
        values["points"] = _whole(fields, "points")
    if "moves" in fields.table:
        values["moves"] = fields.text("moves")
    return TaskStage(name=fields.text("name"), counted=tuple(map(block_named, columns)), **values)


def _search(fields: TomlFields) -> dict[str, Any]:
    """Return the settings that the search section states."""
    fields.refuse_unknown(_SEARCH_KEYS)
    size = {key: _whole(fields, key) for key in ("population", "generations") if key in fields.table}
    stated: dict[str, Any] = {"genetic": replace(USUAL_SEARCH, **size)}
    if "islands" in fields.table:
        stated["islands"] = _whole(fields, "islands")
    if "criterion" in fields.table:
        stated["criterion"] = criterion_named(fields.text("criterion"))
    if "margin" in fields.table:
        stated["margin"] = fields.number("margin")
    if not 0.0 <= stated.get("margin", 0.0) < 1.0:
        raise ExcitationError("margin", where=fields.where, expected="a part, 0 <= margin < 1", got=stated["margin"])
    return stated


def _whole(fields: TomlFields, key: str) -> int:
    value = fields.number(key)
    if not (value.is_integer() and 1 <= value <= _MOST):
        raise ExcitationError(
            f"{key} is no whole number", where=fields.where, expected=f"1 to {_MOST}", got=f"{value:g}"
        )
    return int(value)
