"""A Denavit-Hartenberg table as plain checked data, read from TOML."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from typing import Literal, TypeAlias, cast, get_args

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import RobotError
from tauhat.robots.inertia_checks import warn_of_impossible_inertia
from tauhat.robots.joint import JointKind, Limits, inertia_at_origin
from tauhat.robots.robot import EARTH
from tauhat.robots.source import DescriptionSource
from tauhat.robots.toml_fields import TomlFields
from tauhat.robots.transforms import homogeneous, rotation_from_rpy

Convention: TypeAlias = Literal["standard", "modified"]

_TABLE_KEYS = ("name", "description", "convention", "angle_unit", "gravity", "base", "tool", "joints")
_LIMIT_KEYS = ("lower", "upper", "velocity", "effort", "acceleration")
_INERTIAL_KEYS = ("mass", "com", "inertia")
_NOMINAL_KEYS = ("rotor_inertia", "viscous", "coulomb")
_ROW_KEYS = ("name", "kind", "a", "alpha", "d", "theta", *_LIMIT_KEYS, *_INERTIAL_KEYS, *_NOMINAL_KEYS)
_POSE_KEYS = ("xyz", "rpy")
_LONGEST_LINE = 2000
_LARGEST_OFFSET = 50.0  # [m]
_DEGREE = float(np.pi / 180.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DhRow:
    """One row of the table: `theta` is the offset of a revolute joint's variable, `d` that of a prismatic one's.

    In the modified convention `a` and `alpha` are those of the link before the joint.
    inertia : (10,) of the link about the origin of its DH frame, in that frame's axes; zeros where unknown
    """

    name: str
    kind: JointKind
    a: float
    alpha: float
    d: float
    theta: float
    inertia: FloatArray
    limits: Limits
    rotor_inertia: float
    viscous: float
    coulomb: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DhTable:
    """A whole table: base (4, 4) places DH frame 0 in the robot's base, tool (4, 4) the tool in the last frame."""

    name: str
    description: str
    convention: Convention
    gravity: tuple[float, ...]
    base: FloatArray
    tool: FloatArray
    rows: tuple[DhRow, ...]


def read_dh_table(source: DescriptionSource) -> DhTable:
    """Return the checked table.

    Raises
    ------
    RobotError
        not TOML, an unknown or missing key, a number that is none or cannot be right.
    """
    fields = TomlFields(_parsed(source), source.where)
    fields.refuse_unknown(_TABLE_KEYS)
    unit = _DEGREE if fields.choice("angle_unit", ("rad", "deg"), "rad") == "deg" else 1.0
    rows = fields.subtables("joints")
    if not rows:
        raise RobotError("no joints", where=source.where, expected="a [[joints]] table for each joint")
    return DhTable(
        name=fields.text("name", source.name),
        description=fields.text("description", "robot from a DH table"),
        convention=cast("Convention", fields.choice("convention", get_args(Convention))),
        gravity=fields.row("gravity", 3, EARTH),
        base=_pose(fields.subtable("base"), unit),
        tool=_pose(fields.subtable("tool"), unit),
        rows=tuple(_row(row, unit) for row in rows),
    )


def _parsed(source: DescriptionSource) -> dict[str, object]:
    longest = max(map(len, source.content.splitlines()), default=0)
    if longest > _LONGEST_LINE:  # the parser takes quadratic time over a line of dotted keys
        expected = f"at most {_LONGEST_LINE} bytes"
        raise RobotError("an absurdly long line of TOML", where=source.where, expected=expected, got=longest)
    try:
        return tomllib.loads(source.content.decode("utf-8-sig"))
    except RecursionError as error:
        raise RobotError("absurdly deep TOML", where=source.where) from error
    except ValueError as error:
        raise RobotError("not TOML", where=source.where, got=error, remedy="is it cut off?") from error


def _pose(fields: TomlFields, unit: float) -> FloatArray:
    fields.refuse_unknown(_POSE_KEYS)
    roll, pitch, yaw = fields.row("rpy", 3, (0.0, 0.0, 0.0))
    xyz = fields.row("xyz", 3, (0.0, 0.0, 0.0))
    _check_lengths(xyz, "xyz", fields.where)
    return homogeneous(rotation_from_rpy(unit * roll, unit * pitch, unit * yaw), np.array(xyz))


def _row(fields: TomlFields, unit: float) -> DhRow:
    fields.refuse_unknown(_ROW_KEYS)
    name = fields.text("name")
    row = TomlFields(fields.table, f"{fields.where} ({name})")
    kind = cast("JointKind", row.choice("kind", get_args(JointKind), "revolute"))
    a, alpha, d, theta = (row.number(key, 0.0) for key in ("a", "alpha", "d", "theta"))
    _check_lengths((a, d), "a or d", row.where)
    rotor_inertia, viscous, coulomb = (row.number(key, 0.0) for key in _NOMINAL_KEYS)
    return DhRow(
        name=name,
        kind=kind,
        a=a,
        alpha=unit * alpha,
        d=d,
        theta=unit * theta,
        inertia=_inertia(row),
        limits=_limits(row, unit if kind == "revolute" else 1.0),
        rotor_inertia=rotor_inertia,
        viscous=viscous,
        coulomb=coulomb,
    )


def _check_lengths(lengths: tuple[float, ...], name: str, where: str) -> None:
    longest = max(abs(length) for length in lengths)
    if longest > _LARGEST_OFFSET:
        remedy = "lengths are metres: is the table in millimetres?"
        expected = f"at most {_LARGEST_OFFSET:g} m"
        raise RobotError(f"{name}: absurd size", where=where, expected=expected, got=f"{longest:g} m", remedy=remedy)


def _limits(row: TomlFields, unit: float) -> Limits:
    lower, upper = unit * row.bound("lower", -np.inf), unit * row.bound("upper", np.inf)
    velocity, acceleration = unit * row.bound("velocity", np.inf), unit * row.bound("acceleration", np.inf)
    if lower >= upper or min(velocity, acceleration, row.bound("effort", np.inf)) <= 0:
        raise RobotError("impossible limits", where=row.where, expected="lower < upper, the others positive")
    return Limits(
        lower=lower, upper=upper, velocity=velocity, acceleration=acceleration, effort=row.bound("effort", np.inf)
    )


def _inertia(row: TomlFields) -> FloatArray:
    """Return the ten parameters about the DH frame's origin from mass, centre and central inertia."""
    if "mass" not in row.table:
        orphans = [key for key in _INERTIAL_KEYS if key in row.table]
        if orphans:
            raise RobotError("inertial figures without a mass", where=row.where, got=", ".join(orphans))
        return np.zeros(10)
    mass = row.number("mass")
    if mass < 0:
        raise RobotError("negative mass", where=row.where, got=f"{mass:g} kg")
    xx, xy, yy, xz, yz, zz = row.row("inertia", 6, (0.0,) * 6)
    com = row.row("com", 3, (0.0, 0.0, 0.0))
    _check_lengths(com, "com", row.where)
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if "inertia" in row.table:
        warn_of_impossible_inertia(row.where, mass, tensor)
    return inertia_at_origin(mass=mass, com=np.array(com), inertia_at_com=tensor)
