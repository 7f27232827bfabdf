"""Robots by name or file: what a user types is what `load_robot` takes."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

from tauhat.errors import RobotError
from tauhat.robots.dh import robot_from_dh
from tauhat.robots.locking import lock_joints
from tauhat.robots.naming import advice_on_name
from tauhat.robots.robot import Robot
from tauhat.robots.urdf import robot_from_urdf

_DATA = "tauhat.robots"
_URDF_SUFFIXES = {".urdf", ".xacro"}


def load_robot(name_or_path: str | Path, *, locked: Mapping[str, float] | None = None) -> Robot:
    """Return a robot by built-in name, from a URDF or from a DH table in TOML.

    Parameters
    ----------
    name_or_path : a name of `builtin_names()`, or the path of a `.urdf` or `.toml` file
    locked : joint name -> position at which to freeze it [rad or m]

    Raises
    ------
    RobotError
        unknown name, missing file, or a file that describes no robot.
    """
    text = str(name_or_path)
    if text in builtin_names():
        return _locked(_builtin(text), locked)
    suffix = Path(text).suffix.lower()
    if suffix == ".toml":
        return _locked(robot_from_dh(Path(text)), locked)
    if suffix in {".xml", ".mjcf"}:
        remedy = "give a URDF or a DH table instead"
        raise RobotError("MJCF robots are not supported yet", where=text[:200], remedy=remedy)
    if suffix == ".json":
        remedy = "give the robot that it was identified from"
        raise RobotError("JSON holds an estimate, not a robot", where=text[:200], remedy=remedy)
    if suffix in _URDF_SUFFIXES or _is_file(text):
        return _from_urdf(Path(text), locked)
    remedy = f"{advice_on_name(text, builtin_names())}; or give the path of a .urdf or .toml file"
    raise RobotError("no such robot", where=text[:200], remedy=remedy)


def builtin_names() -> tuple[str, ...]:
    """Return the names of the robots that come with the library, sorted."""
    entries = files(_DATA).joinpath("data").iterdir()
    return tuple(sorted(entry.name.removesuffix(".toml") for entry in entries if entry.name.endswith(".toml")))


def describe_builtins() -> dict[str, str]:
    """Return built-in name -> one line that says what it is and where its figures come from."""
    return {name: str(tomllib.loads(_data(name))["description"]) for name in builtin_names()}


def _builtin(name: str) -> Robot:
    return replace(robot_from_dh(_data(name)), source=f"built-in {name}")


def _from_urdf(path: Path, locked: Mapping[str, float] | None) -> Robot:
    """Return the robot of a URDF file; every error names the file."""
    try:
        return robot_from_urdf(path, locked=locked)
    except RobotError as error:
        if error.where.startswith(str(path)[:200]):
            raise
        raise RobotError(
            error.what, where=f"{path}, {error.where}", expected=error.expected, got=error.got, remedy=error.remedy
        ) from error


def _data(name: str) -> str:
    return files(_DATA).joinpath("data", f"{name}.toml").read_text(encoding="utf-8")


def _locked(robot: Robot, locked: Mapping[str, float] | None) -> Robot:
    return lock_joints(robot, locked) if locked else robot


def _is_file(text: str) -> bool:
    try:
        return Path(text).is_file()
    except (OSError, ValueError):
        return False
