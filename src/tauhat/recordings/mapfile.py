"""Maps as TOML: parsing with every key checked, finding the map of a log, recognising plain column names."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tauhat.errors import MapError
from tauhat.files import existing_file, read_text
from tauhat.recordings.logmap import KINDS, Column, Coupling, LogMap, RowWindow, SignalMap, TimeMap

FOLDER_MAP = "map.toml"  # of all logs in its folder
_LARGEST_MAP = 2**20  # [bytes]
_MOST_COLUMNS = 1000
_SIGNAL_KEYS = ("columns", "unit", "scale", "sign", "offset", "delay_samples", "file", "interleaved")
_KEYS: Mapping[str, tuple[str, ...]] = {
    "time": ("column", "rate", "unit", "file"),
    "position": _SIGNAL_KEYS,
    "velocity": _SIGNAL_KEYS,
    "acceleration": _SIGNAL_KEYS,
    "torque": tuple("gain" if key == "scale" else key for key in _SIGNAL_KEYS),
    "temperature": tuple(key for key in _SIGNAL_KEYS if key not in {"sign", "delay_samples"}),
    "wrench": _SIGNAL_KEYS,
    "rows": ("from", "to"),
    "joints": ("names",),
    "coupling": ("position", "torque"),
}
_RANGE = re.compile(r"^(.*)\{(\d{1,4})\.\.(\d{1,4})\}(.*)$", re.DOTALL)
_FORMATS = (".csv", ".txt", ".tsv", ".dat", ".parquet", ".npz", ".mat")


def load_map(path: str | Path) -> LogMap:
    """Return the map that a TOML file holds.

    Raises
    ------
    MapError
        missing file, not TOML, unknown or missing keys, values that mean nothing.
    """
    return parse_map(read_text(path, error=MapError, largest=_LARGEST_MAP), where=str(path))


def parse_map(text: str, *, where: str = "map") -> LogMap:
    """Return the map that TOML text describes.

    Parameters
    ----------
    where : what messages call the text

    Raises
    ------
    MapError
        as `load_map`.
    """
    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        raise MapError("not valid TOML", where=where, got=error) from error
    try:
        return _build(data, where)
    except MapError as error:
        if error.where.startswith(where):
            raise
        raise MapError(
            error.what, where=f"{where}, {error.where}", expected=error.expected, got=error.got, remedy=error.remedy
        ) from error


def signal_from_table(kind: str, table: dict[str, Any]) -> SignalMap:
    """Return what the section `[kind]` of a map says.

    Raises
    ------
    MapError
        unknown keys, or values that mean nothing.
    """
    _check_keys(kind, table)
    return _signal(kind, table)


def find_map(log: str | Path) -> Path | None:
    """Return the map beside a log: `run.map.toml` for `run.csv.gz`, else `map.toml` of the folder, else None."""
    path = Path(log)
    stem = path.name.removesuffix(".gz")
    stem = next((stem.removesuffix(ending) for ending in _FORMATS if stem.lower().endswith(ending)), stem)
    for candidate in (path.with_name(f"{stem}.map.toml"), path.with_name(FOLDER_MAP)):
        if candidate.is_file():
            return existing_file(candidate, error=MapError)
    return None


def expand_columns(value: object, where: str) -> tuple[Column, ...]:
    """Return column names and indices with ranges written out: `"q{1..3}"` is q1, q2, q3 and `"{7..9}"` is 7, 8, 9.

    Raises
    ------
    MapError
        neither names nor indices, or absurdly many.
    """
    items = value if isinstance(value, list) else [value]
    columns: list[Column] = []
    for item in items:
        columns.extend(_expand(item, where))
        if len(columns) > _MOST_COLUMNS:
            raise MapError("absurd number of columns", where=where, expected=f"at most {_MOST_COLUMNS}")
    if not columns:
        raise MapError("no columns", where=where)
    return tuple(columns)


def _expand(item: object, where: str) -> list[Column]:
    if isinstance(item, int) and not isinstance(item, bool) and item >= 0:
        return [item]
    if not isinstance(item, str):
        raise MapError("not a column", where=where, expected="a header's name or a zero-based index", got=_shown(item))
    match = _RANGE.match(item)
    if match is None:
        return [item]
    head, first, last, tail = match.groups()
    if int(last) < int(first) or int(last) - int(first) >= _MOST_COLUMNS:
        raise MapError("not a range of columns", where=where, expected="{FIRST..LAST} rising", got=_shown(item))
    numbers = range(int(first), int(last) + 1)
    return list(numbers) if not head and not tail else [f"{head}{number}{tail}" for number in numbers]


def _build(data: dict[str, Any], where: str) -> LogMap:
    for section, table in data.items():
        if section not in _KEYS:
            raise MapError(f"unknown section [{section}]", where=where, expected=", ".join(_KEYS))
        if not isinstance(table, dict):
            raise MapError("not a section", where=f"[{section}]", expected="a table of keys", got=_shown(table))
        _check_keys(section, table)
    for section in ("time", "position"):
        if section not in data:
            raise MapError(f"section [{section}] is missing", where=where, remedy="a map needs [time] and [position]")
    signals: dict[str, Any] = {kind: _signal(kind, data[kind]) for kind in KINDS if kind in data}
    matrices: dict[str, Any] = {
        name: _matrix(value, f"[coupling] {name}") for name, value in data.get("coupling", {}).items()
    }
    return LogMap(
        time=_time(data["time"]),
        **signals,
        rows=_rows(data.get("rows", {})),
        joints=_names(data.get("joints", {})),
        coupling=Coupling(**matrices),
        source=where,
    )


def _check_keys(section: str, table: Mapping[str, Any]) -> None:
    unknown = sorted(set(table) - set(_KEYS[section]))
    if unknown:
        legal = ", ".join(_KEYS[section])
        raise MapError(f"unknown key {', '.join(unknown)}", where=f"[{section}]", expected=f"one of {legal}")


def _time(table: dict[str, Any]) -> TimeMap:
    column = expand_columns(table["column"], "[time] column") if "column" in table else (None,)
    if len(column) != 1:
        raise MapError("not one column", where="[time] column", got=_shown(table["column"]))
    return TimeMap(
        column=column[0],
        rate=_number(table["rate"], "[time] rate") if "rate" in table else None,
        unit=_word(table.get("unit", "s"), "[time] unit"),
        file=_file(table, "time"),
    )


def _signal(kind: str, table: dict[str, Any]) -> SignalMap:
    settings: dict[str, Any] = {"kind": kind, "file": _file(table, kind)}
    if "columns" in table:
        settings["columns"] = expand_columns(table["columns"], f"[{kind}] columns")
    if "unit" in table:
        units = table["unit"] if isinstance(table["unit"], list) else [table["unit"]]
        settings["unit"] = tuple(_word(unit, f"[{kind}] unit") for unit in units)
    for key in ("scale", "gain", "sign", "offset"):
        if key in table:
            settings["scale" if key == "gain" else key] = _numbers(table[key], f"[{kind}] {key}")
    if "delay_samples" in table:
        settings["delay_samples"] = _number(table["delay_samples"], f"[{kind}] delay_samples")
    if "interleaved" in table:
        settings["interleaved"] = _integer(table["interleaved"], f"[{kind}] interleaved")
    return SignalMap(**settings)


def _rows(table: dict[str, Any]) -> RowWindow:
    start = _integer(table.get("from", 0), "[rows] from")
    return RowWindow(start=start, stop=_integer(table["to"], "[rows] to") if "to" in table else None)


def _names(table: dict[str, Any]) -> tuple[str, ...]:
    if not table:
        return ()
    where = "[joints] names"
    names = expand_columns(table["names"], where)
    return tuple(_word(name, where) for name in names)


def _file(table: dict[str, Any], section: str) -> str | None:
    if "file" not in table:
        return None
    where = f"[{section}] file"
    name = _word(table["file"], where)
    if not name or "\0" in name:
        raise MapError("not a file name", where=where, got=_shown(name))
    return name


def _matrix(value: object, where: str) -> list[list[float]]:
    if not isinstance(value, list) or not value or not all(isinstance(row, list) for row in value):
        raise MapError("not a matrix", where=where, expected="a list of rows", got=_shown(value))
    rows = [list(_numbers(row, where)) for row in value]
    if len({len(row) for row in rows}) != 1:
        raise MapError("rows of different length", where=where, got=[len(row) for row in rows])
    return rows


def _numbers(value: object, where: str) -> tuple[float, ...]:
    items: Sequence[object] = value if isinstance(value, list) else [value]
    if not items:
        raise MapError("empty list", where=where, expected="one number or one per column")
    return tuple(_number(item, where) for item in items)


def _number(value: object, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise MapError("not a number", where=where, got=_shown(value))
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise MapError("not a finite number", where=where, got=number)
    return number


def _integer(value: object, where: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 10**15:
        raise MapError("not a whole number", where=where, expected="0 or more", got=_shown(value))
    return value


def _word(value: object, where: str) -> str:
    if not isinstance(value, str):
        raise MapError("not a text", where=where, got=_shown(value))
    return value


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
