"""`limits.toml`: everything that a motion must keep at one place, with every key checked.

home = [0, -1.5, 1.5, 0, 0, 0]          # a pose inside all limits to search around, optional [rad or m]

[start]                                 # instead of home: the pose at which the motion starts and ends
q = [0, -1.5, 1.5, 0, 0, 0]             # [rad or m]
unit = "rad"                            # or "deg", of the revolute joints

[joints]                                # each: one number, a list, or a table by joint name; the rest as the robot
lower = { elbow_joint = -2.0 }          # upper, velocity, acceleration, jerk likewise [rad or m, per s, s^2, s^3]

[torque]
fraction = 0.8                          # of the robot's largest torques; or `largest`, as above [Nm or N]

[tool]
frame = "tool"                          # the robot's last frame by default
lower = [-0.6, -0.6, 0.1]               # box for its origin in the base frame [m]
upper = [0.6, 0.6, 1.2]
speed = 0.5                             # [m/s]

[collision]                             # its presence switches self-collision on
clearance = 0.02                        # [m], of obstacles too
geometry = "urdf"                       # the <collision> geometry where there is any; or "capsules" for all links
radius = 0.07                           # of the capsules, or a table by joint name and `base` [m]
self = true

[[capsules]]                            # replace those that run from joint to joint
link = "elbow_joint"                    # the joint that moves it
from = [0, 0, 0.1]                      # in the joint's frame [m]
to = [-0.39, 0, 0.1]
radius = 0.06

[[planes]]                              # links stay where normal . p >= offset [m]
name = "table"
normal = [0, 0, 1]
offset = 0.0

[[boxes]]
name = "crate"
size = [0.4, 0.3, 0.2]                  # [m]
xyz = [0.7, 0, 0.1]                     # of its centre [m]
rpy = [0, 0, 0.3]                       # [rad]

[[meshes]]                              # their convex hulls
name = "fixture"
file = "fixture.stl"                    # beside the limits file
scale = 0.001                           # metres per unit of the file
xyz = [0.5, 0.2, 0]
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ArrayError, ExcitationError, RobotError
from tauhat.excitation.limits.capsules import BASE, Body, Capsule, link_capsules, robot_body
from tauhat.excitation.limits.cartesian_limit import ToolBox, ToolSpeed, tool_frame
from tauhat.excitation.limits.collision_limit import HalfSpace, SelfCollision
from tauhat.excitation.limits.limit_set import LimitSet
from tauhat.excitation.limits.motion_limit import MotionLimit
from tauhat.excitation.limits.obstacle_limit import Obstacle, ObstacleLimit, box_obstacle, mesh_obstacle
from tauhat.excitation.limits.torque_limit import TorqueLimit
from tauhat.files import read_text
from tauhat.robots.naming import advice_on_name
from tauhat.robots.robot import Frame, Robot
from tauhat.robots.toml_fields import TomlFields
from tauhat.robots.transforms import rotation_from_rpy

_LARGEST_FILE = 2**20  # [bytes]
_MOST_OBSTACLES = 100
_JOINT_KEYS = ("lower", "upper", "velocity", "acceleration")
_SECTIONS = ("home", "start", "joints", "torque", "tool", "collision", "capsules", "planes", "boxes", "meshes")
CLEARANCE = 0.01  # [m] where none is stated


def load_limits(path: str | Path, robot: Robot) -> LimitSet:
    """Return the limits that a TOML file states for a robot.

    Raises
    ------
    ExcitationError
        missing file, not TOML, unknown keys or joints, values that leave no room.
    """
    text = read_text(path, error=ExcitationError, largest=_LARGEST_FILE)
    return parse_limits(text, robot, where=str(path), folder=Path(path).parent)


def parse_limits(text: str, robot: Robot, *, where: str = "limits", folder: Path = Path()) -> LimitSet:
    """Return the limits that TOML text states for a robot.

    Parameters
    ----------
    where : what messages call the text
    folder : where mesh files are looked for

    Raises
    ------
    ExcitationError
        as `load_limits`.
    """
    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        raise ExcitationError("not valid TOML", where=where, got=error) from error
    try:
        return _limit_set(TomlFields(data, where), robot, folder)
    except (RobotError, ArrayError, ExcitationError) as error:
        place = error.where if error.where.startswith(where) else f"{where}, {error.where}".rstrip(", ")
        raise ExcitationError(
            error.what, where=place, expected=error.expected, got=error.got, remedy=error.remedy
        ) from error


def _limit_set(fields: TomlFields, robot: Robot, folder: Path) -> LimitSet:
    fields.refuse_unknown(_SECTIONS)
    joints, tool = fields.subtable("joints"), fields.subtable("tool")
    joints.refuse_unknown((*_JOINT_KEYS, "jerk"))
    held = _with_joint_limits(robot, joints)
    jerk = None
    if "jerk" in joints.table:
        jerk = _per_joint(joints, "jerk", robot, np.full(robot.n_v, 1e12))
        if not (jerk > 0.0).all():
            raise ExcitationError("a jerk limit must be positive", where=joints.where, got=jerk.tolist())
    tool.refuse_unknown(("frame", "lower", "upper", "speed"))
    frame = tool_frame(held, tool.text("frame") if "frame" in tool.table else None)
    others = (*_torque(fields, held), *_of_tool(tool, held, frame), *_collisions(fields, held, frame, folder))
    home = np.array(fields.row("home", robot.n_v)) if "home" in fields.table else None
    return LimitSet(robot=held, jerk=jerk, others=others, home=home, start=_start(fields, robot))


def _start(fields: TomlFields, robot: Robot) -> FloatArray | None:
    if "start" not in fields.table:
        return None
    table = fields.subtable("start")
    table.refuse_unknown(("q", "unit"))
    pose = np.array(table.row("q", robot.n_v))
    if table.choice("unit", ("rad", "deg"), "rad") == "rad":
        return pose
    revolute = np.array([joint.kind == "revolute" for joint in robot.joints])
    return np.where(revolute, np.deg2rad(pose), pose)


def _with_joint_limits(robot: Robot, fields: TomlFields) -> Robot:
    rows = {
        key: _per_joint(fields, key, robot, np.array([getattr(joint.limits, key) for joint in robot.joints]))
        for key in _JOINT_KEYS
    }
    joints = []
    for index, joint in enumerate(robot.joints):
        values = {key: float(row[index]) for key, row in rows.items()}
        try:
            limits = replace(joint.limits, **values)
        except RobotError as error:
            where = f"{fields.where}, joint {joint.name}"
            raise ExcitationError(error.what, where=where, got=_shown(values)) from error
        if limits.lower == limits.upper or min(limits.velocity, limits.acceleration) == 0.0:
            where = f"{fields.where}, joint {joint.name}"
            raise ExcitationError("the limits leave the joint no room to move", where=where, got=_shown(values))
        joints.append(replace(joint, limits=limits))
    return replace(robot, joints=tuple(joints))


def _shown(values: Mapping[str, float]) -> str:
    return ", ".join(f"{key} {value:g}" for key, value in values.items())


def _per_joint(fields: TomlFields, key: str, robot: Robot, default: FloatArray) -> FloatArray:
    """Return a value per joint, (n_v,): from one number, a list, or a table by joint name over the default."""
    value = fields.table.get(key)
    if value is None:
        return default
    if isinstance(value, Mapping):
        table, row = TomlFields(value, f"{fields.where}, {key}"), default.copy()
        for name in value:
            row[_joint(robot, name, table.where)] = table.bound(name)
        return row
    if isinstance(value, list):
        return np.array(fields.row(key, robot.n_v))
    return np.full(robot.n_v, fields.bound(key))


def _joint(robot: Robot, name: str, where: str) -> int:
    if name not in robot.joint_names:
        raise ExcitationError(
            "unknown joint", where=where, got=name[:60], remedy=advice_on_name(name, robot.joint_names)
        )
    return robot.joint_names.index(name)


def _torque(fields: TomlFields, robot: Robot) -> tuple[MotionLimit, ...]:
    if "torque" not in fields.table:
        return ()
    table = fields.subtable("torque")
    table.refuse_unknown(("fraction", "largest"))
    fraction = table.number("fraction", 1.0)
    if not 0.0 < fraction <= 1.0:
        raise ExcitationError("not a fraction", where=table.where, expected="0 < fraction <= 1", got=fraction)
    return (TorqueLimit(robot=robot, largest=fraction * _per_joint(table, "largest", robot, robot.effort_limit)),)


def _of_tool(fields: TomlFields, robot: Robot, frame: Frame) -> tuple[MotionLimit, ...]:
    limits: list[MotionLimit] = []
    if "lower" in fields.table or "upper" in fields.table:
        lower, upper = (np.array(fields.row(key, 3)) for key in ("lower", "upper"))
        limits.append(ToolBox(robot=robot, frame=frame, lower=lower, upper=upper))
    if "speed" in fields.table:
        limits.append(ToolSpeed(robot=robot, frame=frame, largest=fields.number("speed")))
    return tuple(limits)


def _collisions(fields: TomlFields, robot: Robot, frame: Frame, folder: Path) -> tuple[MotionLimit, ...]:
    table = fields.subtable("collision")
    table.refuse_unknown(("clearance", "geometry", "radius", "self"))
    lists = {key: fields.subtables(key) for key in ("planes", "boxes", "meshes")}
    if sum(map(len, lists.values())) > _MOST_OBSTACLES:
        raise ExcitationError("absurd number of obstacles", where=fields.where, expected=f"<= {_MOST_OBSTACLES}")
    given = tuple(_capsule(capsule, robot) for capsule in fields.subtables("capsules"))
    if "collision" not in fields.table and not any(lists.values()):
        return ()
    body = _body(table, robot, frame, given)
    clearance = table.number("clearance", CLEARANCE)
    limits: list[MotionLimit] = [_plane(plane, body, clearance) for plane in lists["planes"]]
    obstacles = [_box(box) for box in lists["boxes"]] + [_mesh(mesh, folder) for mesh in lists["meshes"]]
    limits += [ObstacleLimit(body=body, obstacle=obstacle, clearance=clearance) for obstacle in obstacles]
    if "collision" in fields.table and _switch(table, "self"):
        limits.append(SelfCollision(body=body, clearance=clearance))
    return tuple(limits)


def _switch(fields: TomlFields, key: str) -> bool:
    value = fields.table.get(key, True)
    if not isinstance(value, bool):
        raise ExcitationError(f"{key} is neither true nor false", where=fields.where, got=repr(value)[:60])
    return value


def _body(collision: TomlFields, robot: Robot, frame: Frame, given: tuple[Capsule, ...]) -> Body:
    radius: float | dict[str, float] | None = None
    if "radius" in collision.table:
        value = collision.table["radius"]
        if isinstance(value, Mapping):
            radii = TomlFields(value, f"{collision.where}, radius")
            radius = {name: radii.number(name) for name in value}
        else:
            radius = collision.number("radius")
    stated = collision.choice("geometry", ("urdf", "capsules"), "urdf") == "urdf"
    return (robot_body if stated else link_capsules)(robot, frame, radius=radius, given=given)


def _capsule(fields: TomlFields, robot: Robot) -> Capsule:
    fields.refuse_unknown(("link", "from", "to", "radius"))
    name = fields.text("link")
    link = -1 if name == BASE else _joint(robot, name, fields.where)
    start, end = (np.array(fields.row(key, 3)) for key in ("from", "to"))
    return Capsule(link=link, start=start, end=end, radius=fields.number("radius"))


def _plane(fields: TomlFields, body: Body, clearance: float) -> HalfSpace:
    fields.refuse_unknown(("name", "normal", "offset"))
    normal = np.array(fields.row("normal", 3, (0.0, 0.0, 1.0)))
    label, offset = fields.text("name", "plane"), fields.number("offset", 0.0)
    return HalfSpace(body=body, label=label, normal=normal, offset=offset, clearance=clearance)


def _box(fields: TomlFields) -> Obstacle:
    fields.refuse_unknown(("name", "size", "xyz", "rpy"))
    size = np.array(fields.row("size", 3))
    return box_obstacle(fields.text("name", "box"), size=size, **_pose(fields))


def _mesh(fields: TomlFields, folder: Path) -> Obstacle:
    fields.refuse_unknown(("name", "file", "scale", "xyz", "rpy"))
    scale = fields.number("scale", 1.0)
    if not scale > 0.0:
        raise ExcitationError("not a scale", where=fields.where, expected="> 0", got=scale)
    return mesh_obstacle(fields.text("name", "mesh"), path=folder / fields.text("file"), scale=scale, **_pose(fields))


def _pose(fields: TomlFields) -> dict[str, Any]:
    still = (0.0, 0.0, 0.0)
    rotation = rotation_from_rpy(*fields.row("rpy", 3, still))
    return {"rotation": rotation, "translation": np.array(fields.row("xyz", 3, still))}
