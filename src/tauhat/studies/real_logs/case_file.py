"""A TOML file of cases: which logs of which robot are fitted, which are judged, and what others reached there.

    [[case]]
    name = "arm, first run -> second run"
    robot = "arm.urdf"                          # or a built-in name
    map = "arm.toml"                            # by default the one beside each log
    judge_map = "other.toml"                    # of the judged logs, where it is another
    cutoff = 8.0                                # low-pass of torque and model [Hz], one for all fits
    fit = [{ log = "run_1.csv", rows = "634:3510" }]
    judge = [{ log = "run_2.csv" }]
    reference = [0.045]                         # error over torque of a plain baseline, one a judged log
    aim = 0.021                                 # what an experiment with the same scoring reached
    expect = ["condition number"]               # words of warnings that must come
    waits = "counterbalance"                    # what the model does not have

Robots and maps are looked for beside the file of the cases first, then in the folder of the logs.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tauhat.errors import ModelError, TauhatError
from tauhat.files import existing_file, read_text
from tauhat.recordings.log_source import LogSource
from tauhat.recordings.logmap import parse_rows
from tauhat.recordings.reading import Rows
from tauhat.robots.library import builtin_names
from tauhat.robots.toml_fields import TomlFields

_LARGEST_FILE = 2**20  # [bytes]
_KEYS = (
    *("name", "robot", "map", "judge_map", "cutoff", "fit", "judge"),
    *("reference", "aim", "expect", "waits"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class RealCase:
    """Logs that are fitted and logs that are judged.

    robot : a file, or a built-in name
    cutoff : low-pass of torque and model [Hz]
    fit, judge : logs with their maps and windows
    reference : error over torque of a plain baseline, one a judged log; empty where it is not known
    aim : what an experiment with the same scoring reached
    expect : words of warnings that must come
    waits : what the model does not have
    """

    name: str
    robot: str
    cutoff: float
    fit: tuple[LogSource, ...]
    judge: tuple[LogSource, ...]
    reference: tuple[float, ...] = ()
    aim: float | None = None
    expect: tuple[str, ...] = ()
    waits: str = ""

    @property
    def unseen(self) -> bool:
        """Whether no judged row was fitted."""
        return not any(_overlap(judged, fitted) for judged in self.judge for fitted in self.fit)


def load_cases(path: str | Path, *, data: str | Path | None = None) -> tuple[RealCase, ...]:
    """Return the cases of a TOML file; whether their logs are there is for `check_logs`.

    Parameters
    ----------
    data : folder of the logs, and of robots and maps that are not beside the file; the file's own by default

    Raises
    ------
    ModelError
        missing file, not TOML, unknown keys, values that mean nothing, a name twice, no case at all.
    """
    place = Path(path)
    text, where = read_text(place, error=ModelError, largest=_LARGEST_FILE), str(path)
    try:
        top = TomlFields(tomllib.loads(text), where)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        raise ModelError("not valid TOML", where=where, got=error) from error
    folders = (place.parent, place.parent if data is None else Path(data))
    try:
        top.refuse_unknown(("case",))
        cases = tuple(_case(fields, folders) for fields in top.subtables("case"))
        _check_names(cases)
    except TauhatError as error:
        at = error.where if error.where.startswith(where) else f"{where}, {error.where}".rstrip(", ")
        raise ModelError(error.what, where=at, expected=error.expected, got=error.got, remedy=error.remedy) from error
    return cases


def check_logs(cases: Iterable[RealCase]) -> None:
    """Check that every log of the cases is there, before long work begins.

    Raises
    ------
    ModelError
        naming the first case and log that is not.
    """
    for case in cases:
        for source in (*case.fit, *case.judge):
            try:
                existing_file(source.path, error=ModelError)
            except ModelError as error:
                remedy = "name the folder of the logs (--data), or take the case out of the file"
                raise ModelError(error.what, where=f"{case.name}: {source.path}", remedy=remedy) from error


def _case(fields: TomlFields, folders: tuple[Path, Path]) -> RealCase:
    name = fields.text("name")
    fields = TomlFields(fields.table, f"{fields.where} ({name})")
    fields.refuse_unknown(_KEYS)
    mapped = _file(fields, "map", folders) if "map" in fields.table else None
    judge_map = _file(fields, "judge_map", folders) if "judge_map" in fields.table else mapped
    judge = _logs(fields, "judge", folders[1], judge_map)
    return RealCase(
        name=name,
        robot=_robot(fields, folders),
        cutoff=_positive("cutoff", fields.number("cutoff"), fields.where),
        fit=_logs(fields, "fit", folders[1], mapped),
        judge=judge,
        reference=_reference(fields, len(judge)),
        aim=_positive("aim", fields.number("aim"), fields.where) if "aim" in fields.table else None,
        expect=_texts(fields, "expect"),
        waits=fields.text("waits") if "waits" in fields.table else "",
    )


def _robot(fields: TomlFields, folders: tuple[Path, Path]) -> str:
    """Return the file's path, or the name where that is a built-in robot's."""
    name = fields.text("robot")
    return name if name in builtin_names() else str(_file(fields, "robot", folders))


def _file(fields: TomlFields, key: str, folders: Sequence[Path]) -> Path:
    """Return the path of a file that is in one of the folders; where it is in none, the path in the last."""
    name = fields.text(key)
    if "\0" in name:
        raise ModelError(f"{key} is not a file name", where=fields.where, got=repr(name)[:60])
    places = [(folder / name).absolute() for folder in folders]
    return next((place for place in places if place.exists()), places[-1])


def _logs(fields: TomlFields, key: str, data: Path, mapped: Path | None) -> tuple[LogSource, ...]:
    tables = fields.table.get(key)
    if not isinstance(tables, list) or not tables or not all(isinstance(table, dict) for table in tables):
        expected = '[{ log = "run.csv", rows = "FROM:TO" }]'
        raise ModelError(f"{key} names no logs", where=fields.where, expected=expected, got=_shown(tables))
    logs = [TomlFields(table, f"{fields.where}, {key} {number}") for number, table in enumerate(tables, start=1)]
    return tuple(_log(log, data, mapped) for log in logs)


def _log(fields: TomlFields, data: Path, mapped: Path | None) -> LogSource:
    fields.refuse_unknown(("log", "rows"))
    return LogSource(path=_file(fields, "log", (data,)), map=mapped, rows=_rows(fields))


def _rows(fields: TomlFields) -> Rows | None:
    if "rows" not in fields.table:
        return None
    try:
        return parse_rows(fields.text("rows"))
    except TauhatError as error:
        raise ModelError(error.what, where=fields.where, expected=error.expected, got=error.got) from error


def _reference(fields: TomlFields, count: int) -> tuple[float, ...]:
    if "reference" not in fields.table:
        return ()
    return tuple(_positive("reference", value, fields.where) for value in fields.row("reference", count))


def _positive(key: str, value: float, where: str) -> float:
    if value <= 0.0:
        raise ModelError(f"{key} is not positive", where=where, got=value)
    return value


def _texts(fields: TomlFields, key: str) -> tuple[str, ...]:
    values = fields.table.get(key, [])
    if not isinstance(values, list) or not all(isinstance(value, str) and value.strip() for value in values):
        raise ModelError(f"{key} is not a list of texts", where=fields.where, got=_shown(values))
    return tuple(values)


def _shown(value: Any) -> str:
    return "" if value is None else repr(value)[:60]


def _check_names(cases: Sequence[RealCase]) -> None:
    names = [case.name for case in cases]
    if not names:
        raise ModelError("no cases", expected="[[case]]")
    doubled = next((name for name in names if names.count(name) > 1), None)
    if doubled is not None:
        raise ModelError("two cases of one name", got=doubled)


def _overlap(first: LogSource, second: LogSource) -> bool:
    """Return whether two logs share rows of one file; a map's own window is not looked at."""
    if first.path != second.path:
        return False
    first_start, first_stop = first.rows or (0, None)
    second_start, second_stop = second.rows or (0, None)
    ends = [stop for stop in (first_stop, second_stop) if stop is not None]
    return not ends or min(ends) > max(first_start, second_start)
