"""`project.toml`: one robot's whole way at one place, with every key checked.

[robot]
source = "ur5e"                # a built-in name, or a file beside this one
locked = { finger = 0.0 }      # joints frozen at a position [rad or m]

[motion]                       # designed, with the keys of `DesignedMotion`; or
file = "motion.parquet"        # one that is there, or a list

[record]
kind = "simulate"              # with the keys of `SimulatedLogs`; or "logs" with
logs = ["recordings/run_1.csv"]
map = "recordings/map.toml"    # by default the one beside each log

[identify]                     # the keys of `Identification`

[verify]                       # of a simulation the keys of `UnseenMotion`, else
logs = ["recordings/run_2.csv"]

[report]
title = "My arm"

[export]
formats = ["urdf", "mjcf", "c"]
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import fields as fields_of
from pathlib import Path
from typing import Any, TypeVar

from tauhat.errors import ProjectError, TauhatError
from tauhat.files import read_text
from tauhat.project.settings import (
    DesignedMotion,
    Exports,
    GivenLogs,
    GivenMotion,
    Identification,
    Project,
    ReportSettings,
    RobotSettings,
    SimulatedLogs,
    UnseenMotion,
)
from tauhat.robots.toml_fields import TomlFields

NAME = "project.toml"
"""Of a project's file, where only its folder is named."""
_LARGEST_FILE = 2**20  # [bytes]
_SECTIONS = ("robot", "motion", "record", "identify", "verify", "report", "export")
_SIMULATE, _LOGS = "simulate", "logs"

Section = TypeVar("Section")


def load_project(path: str | Path) -> Project:
    """Return the project that a TOML file, or `project.toml` in a folder, describes.

    Raises
    ------
    ProjectError
        missing file, not TOML, unknown keys, values that mean nothing.
    """
    place = project_path(path).absolute()  # what is inside the folder is then told from what is not
    if not place.exists():
        folder = place.parent if place.name == NAME else place.with_suffix("")
        remedy = f"tauhat run --new ROBOT {folder} makes one"
        raise ProjectError("no such project", where=place, remedy=remedy)
    text, where = read_text(place, error=ProjectError, largest=_LARGEST_FILE), str(place)
    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        raise ProjectError("not valid TOML", where=where, got=error) from error
    try:
        return _project(TomlFields(data, where), place)
    except TauhatError as error:
        at = error.where if error.where.startswith(where) else f"{where}, {error.where}".rstrip(", ")
        raise ProjectError(error.what, where=at, expected=error.expected, got=error.got, remedy=error.remedy) from error


def project_path(path: str | Path) -> Path:
    """Return the project's file: the path itself, or `project.toml` in a folder."""
    place = Path(path)
    return place / NAME if place.is_dir() else place


def _project(top: TomlFields, path: Path) -> Project:
    top.refuse_unknown(_SECTIONS)
    record = _recorded(top.subtable("record"))
    simulated = isinstance(record, SimulatedLogs)
    return Project(
        file=path,
        robot=_robot(top.subtable("robot")),
        motion=_motion(top.subtable("motion")) if simulated or "motion" in top.table else None,
        record=record,
        identify=_settings(Identification, top.subtable("identify")),
        verify=_verified(top, simulated=simulated),
        report=_settings(ReportSettings, top.subtable("report")),
        export=_exports(top.subtable("export")) if "export" in top.table else None,
    )


def _robot(fields: TomlFields) -> RobotSettings:
    fields.refuse_unknown(("source", "locked"))
    locked = fields.subtable("locked")
    return RobotSettings(source=fields.text("source"), locked={joint: locked.number(joint) for joint in locked.table})


def _motion(fields: TomlFields) -> DesignedMotion | GivenMotion:
    if "file" not in fields.table:
        return _settings(DesignedMotion, fields)
    if len(fields.table) > 1:
        raise ProjectError("a motion file has its own length and shape", where=fields.where, got=[*fields.table])
    return GivenMotion(files=_texts(fields, "file"))


def _recorded(fields: TomlFields) -> SimulatedLogs | GivenLogs:
    if fields.choice("kind", (_SIMULATE, _LOGS), _SIMULATE) == _LOGS:
        return _logs(fields, ("kind", "logs", "map"))
    settings = TomlFields({key: value for key, value in fields.table.items() if key != "kind"}, fields.where)
    beside = sorted(set(settings.table) - {"experiment"})
    if "experiment" in settings.table and beside:
        raise ProjectError("the experiment's file says that", where=fields.where, got=beside[0], remedy="leave it out")
    return _settings(SimulatedLogs, settings)


def _verified(top: TomlFields, *, simulated: bool) -> UnseenMotion | GivenLogs | None:
    fields = top.subtable("verify")
    if simulated:
        return _settings(UnseenMotion, fields)
    return _logs(fields, ("logs", "map")) if "verify" in top.table else None


def _logs(fields: TomlFields, known: tuple[str, ...]) -> GivenLogs:
    fields.refuse_unknown(known)
    return GivenLogs(logs=_texts(fields, "logs"), map=fields.text("map") if "map" in fields.table else "")


def _exports(fields: TomlFields) -> Exports:
    fields.refuse_unknown(("formats", "prefix", "without"))
    without = _texts(fields, "without") if "without" in fields.table else ()
    prefix = fields.text("prefix") if "prefix" in fields.table else ""
    return Exports(formats=_texts(fields, "formats"), prefix=prefix, without=without)


def _settings(kind: type[Section], fields: TomlFields) -> Section:
    """Return the settings of a section whose keys are the fields of a dataclass; each is read by its kind."""
    readers: Mapping[str, Callable[[TomlFields, str], Any]] = {"int": _whole, "bool": _switch, "str": TomlFields.text}
    kinds: Mapping[str, str] = {item.name: str(item.type) for item in fields_of(kind)}  # type: ignore[arg-type]
    fields.refuse_unknown(kinds)
    values = {key: readers.get(kinds[key], TomlFields.number)(fields, key) for key in fields.table}
    try:
        return kind(**values)
    except TauhatError as error:
        where = f"{fields.where}, {error.where}".rstrip(", ")
        raise ProjectError(
            error.what, where=where, expected=error.expected, got=error.got, remedy=error.remedy
        ) from error


def _whole(fields: TomlFields, key: str) -> int:
    value = fields.table[key]
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**63:
        raise ProjectError(f"{key} is not a whole number >= 0", where=fields.where, got=repr(value)[:60])
    return value


def _switch(fields: TomlFields, key: str) -> bool:
    value = fields.table[key]
    if not isinstance(value, bool):
        raise ProjectError(f"{key} is neither true nor false", where=fields.where, got=repr(value)[:60])
    return value


def _texts(fields: TomlFields, key: str) -> tuple[str, ...]:
    """Return one text or several."""
    given = fields.table.get(key)
    values: list[Any] = given if isinstance(given, list) else [given]
    if not values or not all(isinstance(value, str) and value.strip() and "\0" not in value for value in values):
        raise ProjectError(f"{key} is not a list of texts", where=fields.where, got=repr(given)[:60])
    if len(set(values)) < len(values):
        raise ProjectError(f"{key} names something twice", where=fields.where, got=", ".join(values)[:80])
    return tuple(values)
