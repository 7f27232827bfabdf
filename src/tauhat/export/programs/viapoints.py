"""Neutral tables of via-points, CSV and TOML: SI units, parts of limits, every zone; numbers read back exactly."""

from __future__ import annotations

import csv
import io
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ExportError, TauhatError
from tauhat.excitation.waypoints.moves import JointMove, LineMove, Move, Zone
from tauhat.export.programs.angles import rotation_of_quaternion
from tauhat.export.programs.cell import Cell, Leg
from tauhat.export.programs.program import Program
from tauhat.export.programs.reading import LARGEST_PROGRAM
from tauhat.robots.kinematics import Pose
from tauhat.robots.transforms import quaternion

UNSAID = ("Limits of joints and tool, of which speeds and accelerations are parts.",)
_POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")
_ENDING = ("speed", "acceleration", "zone_radius", "zone_part", "dwell", "repeats")
_FIELDS = {"move", "joints", "pose", *_ENDING}


def write_csv(cell: Cell, legs: Sequence[Leg], head: Sequence[str]) -> Iterator[str]:
    """Yield the lines of a table with a row for the start and each target."""
    yield from (f"# {line}" for line in head)
    n_v = cell.robot.n_v
    yield ",".join(["move", *(f"q_{joint}" for joint in range(1, n_v + 1)), *_POSE, *_ENDING])
    for entry in _entries(cell, legs):
        joints, pose = entry.get("joints", [""] * n_v), entry.get("pose", [""] * len(_POSE))
        yield ",".join(map(str, [entry["move"], *joints, *pose, *(entry.get(name, "") for name in _ENDING)]))


def write_toml(cell: Cell, legs: Sequence[Leg], head: Sequence[str]) -> Iterator[str]:
    """Yield the lines of a document with a table `[[moves]]` for the start and each target."""
    yield from (f"# {line}" for line in head)
    for entry in _entries(cell, legs):
        yield "[[moves]]"
        for name, value in entry.items():
            yield f'{name} = "{value}"' if isinstance(value, str) else f"{name} = {value}"


def read_csv(cell: Cell, text: str) -> Program:
    """Return the motion of a table.

    Raises
    ------
    ExportError
        when a column or a cell is not as `write_csv` writes it: names the line.
    """
    _check_size(text)
    joints = [f"q_{joint}" for joint in range(1, cell.robot.n_v + 1)]
    lines = [(number, line) for number, line in enumerate(text.splitlines(), 1) if line and not line.startswith("#")]
    rows = csv.reader(io.StringIO("\n".join(line for _, line in lines)))
    columns = ["move", *joints, *_POSE, *_ENDING]
    named = []
    for (number, _), row in zip(lines, rows, strict=True):
        where = f"via-points, line {number}"
        if number == lines[0][0]:
            if row != columns:
                raise ExportError("columns", where=where, expected=",".join(columns), got=",".join(row)[:80])
            continue
        if len(row) != len(columns):
            raise ExportError("cells of a row", where=where, expected=len(columns), got=len(row))
        named.append((where, _entry(dict(zip(columns, row, strict=True)), joints, where)))
    return _program(cell, named)


def read_toml(cell: Cell, text: str) -> Program:
    """Return the motion of a document.

    Raises
    ------
    ExportError
        when a field is unknown or wrong: names the move.
    """
    _check_size(text)
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ExportError("no TOML document", where="via-points", got=str(error)) from error
    moves = data.get("moves")
    if set(data) != {"moves"} or not isinstance(moves, list) or not all(isinstance(move, dict) for move in moves):
        raise ExportError("a document of via-points", expected="tables [[moves]] only", got=", ".join(data)[:80])
    return _program(cell, [(f"via-points, entry {number}", entry) for number, entry in enumerate(moves, 1)])


def _entries(cell: Cell, legs: Sequence[Leg]) -> Iterator[dict[str, Any]]:
    yield {"move": "start", "joints": _plain(cell.shown(legs[0].begin)), "repeats": cell.settings.repeats}
    for leg in legs:
        move, entry = leg.move, dict[str, Any]()
        entry["move"] = "line" if isinstance(move, LineMove) else "joint"
        if isinstance(move, LineMove) and isinstance(move.target, Pose):
            pose = cell.target_pose(move)
            entry["pose"] = _plain(np.concatenate([pose.translation, quaternion(pose.rotation)]))
        elif not isinstance(move.target, Pose):
            entry["joints"] = _plain(cell.shown(move.target))
        entry |= {"speed": float(move.speed), "acceleration": float(move.acceleration)}
        if move.zone is not None:
            radius, part = move.zone.radius, move.zone.part
            entry |= {"zone_part": float(part or 0.0)} if radius is None else {"zone_radius": float(radius)}
        if move.dwell > 0.0:
            entry["dwell"] = float(move.dwell)
        yield entry


def _plain(values: FloatArray) -> list[float]:
    return [float(value) for value in values]


def _check_size(text: str) -> None:
    if len(text) > LARGEST_PROGRAM:
        expected = f"at most {LARGEST_PROGRAM} letters"
        raise ExportError("too long a table", where="via-points", expected=expected, got=len(text))


def _entry(row: Mapping[str, str], joints: Sequence[str], where: str) -> dict[str, Any]:
    """Return the entry of a row: cells that are empty say nothing."""
    entry: dict[str, Any] = {"move": row["move"]}
    try:
        for name, columns in (("joints", joints), ("pose", _POSE)):
            if any(row[column] for column in columns):
                entry[name] = [float(row[column]) for column in columns]
        entry |= {name: float(row[name]) for name in _ENDING[:-1] if row[name]}
        entry |= {"repeats": int(row["repeats"])} if row["repeats"] else {}
    except ValueError as error:
        raise ExportError("a cell that is no number", where=where, got=str(error)) from error
    return entry


def _program(cell: Cell, entries: Sequence[tuple[str, Mapping[str, Any]]]) -> Program:
    if not entries or entries[0][1].get("move") != "start" or not set(entries[0][1]) <= {"move", "joints", "repeats"}:
        raise ExportError("via-points", expected="first the start, with joints and repeats alone")
    found: list[Any] = []
    for where, entry in entries:
        try:
            found.append(_positions(cell, entry) if entry is entries[0][1] else _move(cell, entry))
        except TauhatError as error:
            raise ExportError(str(error), where=where) from error
        except (TypeError, ValueError, KeyError) as error:
            raise ExportError("a damaged entry", where=where, got=f"{type(error).__name__}: {error}"[:120]) from error
    repeats = entries[0][1].get("repeats", 1)
    if not isinstance(repeats, int):
        raise ExportError("repeats of a program", where=entries[0][0], expected="a whole number", got=repeats)
    return Program(start=found[0], moves=tuple(found[1:]), repeats=repeats)


def _move(cell: Cell, entry: Mapping[str, Any]) -> Move:
    unknown = set(entry) - _FIELDS | ({"repeats"} & set(entry))
    if unknown:
        raise ExportError("unknown field of a move", got=", ".join(sorted(unknown))[:80])
    kind, zones = entry["move"], {"radius": entry.get("zone_radius"), "part": entry.get("zone_part")}
    rest: dict[str, Any] = {name: entry[name] for name in ("speed", "acceleration", "dwell") if name in entry}
    rest["zone"] = None if zones == {"radius": None, "part": None} else Zone(**zones)
    if kind == "joint" and "pose" not in entry:
        return JointMove(target=_positions(cell, entry), **rest)
    if kind != "line" or ("pose" in entry) == ("joints" in entry):
        raise ExportError("a move", expected="joint with joints, or line with joints or a pose", got=str(kind)[:40])
    if "joints" in entry:
        return LineMove(target=_positions(cell, entry), **rest)
    pose = np.array([float(value) for value in entry["pose"]])
    if pose.size != len(_POSE):
        raise ExportError("a pose", expected=", ".join(_POSE), got=f"{pose.size} numbers")
    shown = Pose(rotation=rotation_of_quaternion(pose[3:]), translation=pose[:3])
    return LineMove(target=cell.meant_pose(shown), **rest)


def _positions(cell: Cell, entry: Mapping[str, Any]) -> FloatArray:
    joints = np.array([float(value) for value in entry["joints"]])
    if joints.size != cell.robot.n_v:
        raise ExportError("joint positions of another robot", expected=cell.robot.n_v, got=joints.size)
    return cell.meant(joints)
