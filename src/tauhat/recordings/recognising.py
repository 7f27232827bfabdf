"""Logs without a map: plain column names are recognised, others get a map to fill in."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from tauhat.errors import MapError
from tauhat.recordings.logmap import KINDS, LogMap, SignalMap, TimeMap
from tauhat.recordings.table import Table, compact_names
from tauhat.recordings.tables import open_table

_CLOCKS = ("t", "time", "t_s", "time_s")
_STEMS = {
    "position": ("q_", "q"),
    "velocity": ("dq_", "dq"),
    "acceleration": ("ddq_", "ddq"),
    "torque": ("tau_", "tau"),
    "temperature": ("temperature_", "temperature"),
}
_CURRENT_LIKE = re.compile('^"i[_{]|cur|amp')
_TORQUE_LIKE = re.compile(f"{_CURRENT_LIKE.pattern}|tau|torq|effort|moment|force")
_NOT_MEASURED_HERE = re.compile("target|desired|command|goal|tcp|tool")  # what was wished, or is not of the joints
_SPEED_LIKE = re.compile("dq|qd|vel|speed|omega")
_USUAL_JOINTS = (6, 7)  # of industrial arms
_WRENCH = ("fx", "fy", "fz", "mx", "my", "mz")


def recognise(table: Table) -> LogMap:
    """Return the map of a file with plain names: t or time, q_1 .. or q1 .., dq_1 .., ddq_1 .., tau_1 .., fx .. mz.

    Raises
    ------
    MapError
        other names; the message lists them and shows a map to start from.
    """
    clock = next((name for name in _CLOCKS if name in table.groups), None)
    signals: dict[str, Any] = {kind: _plain(table, kind) for kind in KINDS}
    if clock is None or signals["position"] is None:
        raise MapError(
            "no map, and no plain column names (t, q_1, q_2, ...)", where=table.path,
            got=table.listing() or f"{table.width} columns without names",
            remedy=f"write {_map_name(table.path)}, a section per line: {_one_line(skeleton(table))}",
        )  # fmt: skip
    return LogMap(time=TimeMap(column=clock), **signals)


def map_skeleton(path: str | Path) -> str:
    """Return the text of a map to start from, with the columns that a log has.

    Raises
    ------
    RecordingError
        a file that cannot be read.
    """
    return skeleton(open_table(path))


def skeleton(table: Table) -> str:
    """Return the text of a map to start from for an opened file."""
    clock, others = _guesses(table)
    lines = ["[time]", f"column = {clock}", 'unit = "s"  # or ms, us, ns']
    for kind, columns in others.items():
        lines += ["", f"[{kind}]", f"columns = {columns}", f"unit = {_unit(kind, columns)}"]
    return "\n".join(lines) + "\n"


def _unit(kind: str, columns: str) -> str:
    """Return the likely unit of columns, and what it may be instead."""
    if kind == "torque" and _CURRENT_LIKE.search(columns.lower()):
        return '"A"  # or Nm, V, count\ngain = 1.0  # put in: Nm at the joint per ampere'
    units = {"torque": '"Nm"  # or A, V, count with gain = [...]', "velocity": '"rad/s"  # or deg/s'}
    return units.get(kind, '"rad"  # or deg, count with scale = [...]')


def _plain(table: Table, kind: str) -> SignalMap | None:
    if kind == "wrench":
        names: tuple[str, ...] = ("wrench",) if len(table.groups.get("wrench", ())) == 6 else _WRENCH
        return SignalMap(kind=kind, columns=names) if all(name in table.groups for name in names) else None
    for stem in _STEMS[kind]:
        names = _numbered(table, stem)
        if names:
            return SignalMap(kind=kind, columns=names)
    whole = _STEMS[kind][-1]
    return SignalMap(kind=kind, columns=(whole,)) if whole in table.groups else None


def _numbered(table: Table, stem: str) -> tuple[str, ...]:
    names: list[str] = []
    while f"{stem}{len(names) + 1}" in table.groups:
        names.append(f"{stem}{len(names) + 1}")
    return tuple(names)


def _guesses(table: Table) -> tuple[str, dict[str, str]]:
    """Return TOML values for the clock, and for the position, velocity and torque columns as far as there are any."""
    kinds = ("position", "velocity", "torque")
    if not table.groups:
        joints = _likely_joints(table.width - 1)
        spans = [(1 + k * joints, (k + 1) * joints) for k in range(3) if (k + 1) * joints < table.width]
        texts = [f'"{{{first}..{last}}}"' for first, last in spans or [(0, 0)]]
        return "0", dict(zip(kinds if len(spans) != 2 else ("position", "torque"), texts, strict=False))
    runs = compact_names(tuple(name for name in table.groups if not name.endswith("]")))
    quoted = [f'"{run}"' for run in runs]
    wide = [text for text, run in zip(quoted, runs, strict=True) if "{" in run or len(table.groups.get(run, ())) > 1]
    clock = next((text for text, run in zip(quoted, runs, strict=True) if run.lower().startswith("t")), quoted[0])
    return clock, _placed(wide or [text for text in quoted if text != clock] or quoted)


def _likely_joints(columns: int) -> int:
    """Return how many joints columns behind a clock are of: six or seven where they fit twice or more, else a third."""
    fits = (count for count in _USUAL_JOINTS if columns >= 2 * count and columns % count == 0)
    return next(fits, max(1, columns // 3))


def _placed(found: list[str]) -> dict[str, str]:
    """Return which run of columns is what, by name where the names tell, else in their order."""
    found = [text for text in found if not _NOT_MEASURED_HERE.search(text.lower())] or found
    torque = next((text for text in found if _TORQUE_LIKE.search(text.lower())), None)
    speed = next((text for text in found if text != torque and _SPEED_LIKE.search(text.lower())), None)
    if torque is None and speed is None:
        return dict(zip(("position", "velocity", "torque"), found, strict=False))
    place = next((text for text in found if text not in {torque, speed}), found[0])
    named = {"position": place, "velocity": speed, "torque": torque}
    return {kind: text for kind, text in named.items() if text is not None}


def _map_name(path: Path) -> str:
    return f"{path.name.split('.')[0]}.map.toml"


def _one_line(text: str) -> str:
    lines = [line.split("  #")[0] for line in text.splitlines() if line]
    return " / ".join(lines)
