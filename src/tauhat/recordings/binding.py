"""A map bound to the columns of the files it speaks of: rows come out of it in SI."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import MapError, RecordingError
from tauhat.recordings.log import Log
from tauhat.recordings.logmap import TIME_UNITS, Coupling, LogMap, SignalMap
from tauhat.recordings.table import Table
from tauhat.recordings.tables import open_table

_FIELDS = {
    "position": "q", "velocity": "dq", "acceleration": "ddq", "torque": "tau",
    "temperature": "temperature", "wrench": "wrench",
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """The columns one file contributes."""

    table: Table
    columns: tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BoundLog:
    """A log whose every mapped column has been found.

    parts : files and their columns; side by side they make the raw matrix
    clock : raw column of the time, None with a constant rate
    slots : raw columns of each quantity
    ahead, behind : rows needed beyond a window because channels are delayed
    """

    path: Path
    log_map: LogMap
    parts: tuple[Part, ...]
    clock: int | None
    slots: dict[str, slice]
    joint_names: tuple[str, ...]
    ahead: int
    behind: int

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that are read, each once."""
        return tuple(dict.fromkeys(part.table.path for part in self.parts))

    def blocks(self, start: int, stop: int | None) -> Iterator[FloatArray]:
        """Yield blocks of raw rows, the columns of all files side by side.

        Raises
        ------
        RecordingError
            damaged files, or files of different length.
        """
        streams = [part.table.blocks(part.columns, start, stop) for part in self.parts]
        if len(streams) == 1:
            yield from (block for block in streams[0] if len(block))
            return
        rests = [np.empty((0, len(part.columns))) for part in self.parts]
        while True:
            for index, stream in enumerate(streams):
                rests[index] = _refill(rests[index], stream)
            count = min(len(rest) for rest in rests)
            if count == 0:
                self._refuse_leftover(rests)
                return
            yield np.concatenate([rest[:count] for rest in rests], axis=1)
            rests = [rest[count:] for rest in rests]

    def _refuse_leftover(self, rests: list[FloatArray]) -> None:
        if any(len(rest) for rest in rests):
            short = self.parts[[len(rest) for rest in rests].index(0)].table.path.name
            longer = ", ".join(part.table.path.name for part, rest in zip(self.parts, rests, strict=True) if len(rest))
            raise RecordingError("files of different length", where=self.path, got=f"{short} ends before {longer}")

    def log(self, raw: FloatArray, first: int, window: tuple[int, int]) -> Log:
        """Return rows `window` of the file as a log.

        Parameters
        ----------
        raw : (rows, columns) with at least `behind` rows before and `ahead` rows after the window
        first : row of the file that raw row 0 is
        """
        low, high = window[0] - first, window[1] - first
        with np.errstate(over="ignore", invalid="ignore"):  # corrupt numbers may overflow; checks find them later
            signals = self._signals(raw, low, high)
            t = self._time(raw, window, low)
        self._check_widths(signals)
        return Log(
            t=t,
            **signals,
            joint_names=self.joint_names,
            units=self._units(),
            name=self.path.name.split(".")[0] or self.path.name,
            path=str(self.path),
            first_row=window[0],
            shared_motors=self.log_map.coupling.shared_motors(),
        )

    def _signals(self, raw: FloatArray, low: int, high: int) -> dict[str, Any]:
        return {
            _FIELDS[kind]: joint_side(_undelayed(raw[:, self.slots[kind]], signal, low, high), signal, self.log_map)
            for kind, signal in self.log_map.signals().items()
        }

    def _time(self, raw: FloatArray, window: tuple[int, int], low: int) -> FloatArray:
        if self.clock is None:
            return np.arange(window[0], window[1]) / float(self.log_map.time.rate or 1.0)
        return raw[low : low + window[1] - window[0], self.clock] * TIME_UNITS[self.log_map.time.unit]

    def _units(self) -> tuple[str, ...]:
        slot = self.slots["position"]
        return self.log_map.position.joint_units(slot.stop - slot.start)

    def _check_widths(self, signals: dict[str, FloatArray]) -> None:
        count = signals["q"].shape[1]
        for name, signal in signals.items():
            wanted = 6 if name == "wrench" else count
            if signal.shape[1] != wanted:
                raise MapError(
                    f"{name} has the wrong number of columns", where=self.log_map.source or self.path,
                    expected=f"{wanted}", got=signal.shape[1],
                )  # fmt: skip


def bind(path: Path, log_map: LogMap) -> BoundLog:
    """Return the log with every column of its map found.

    Raises
    ------
    MapError
        a column that is not there, a list whose length fits no column count.
    RecordingError
        files that are missing or cannot be read.
    """
    tables: dict[tuple[str | None, int | None], Table] = {}
    wanted: dict[tuple[str | None, int | None], list[int]] = {}
    taken: list[tuple[str, tuple[str | None, int | None], int, int]] = []
    for kind, key, columns in _requests(log_map):
        if key not in tables:
            tables[key] = open_table(path if key[0] is None else path.parent / key[0], interleaved=key[1])
        where = f"{log_map.source}, [{kind}]" if log_map.source else f"[{kind}]"
        found = tables[key].positions(columns, where) if columns else tuple(range(tables[key].width))
        begin = len(wanted.setdefault(key, []))
        wanted[key].extend(found)
        taken.append((kind, key, begin, len(found)))
    starts = dict(zip(wanted, np.cumsum([0, *map(len, wanted.values())]).tolist(), strict=False))
    slots = {kind: slice(starts[key] + begin, starts[key] + begin + n) for kind, key, begin, n in taken}
    clock = slots.pop("time", None)
    _check_lists(log_map, slots)
    delays = [signal.delay_samples for signal in log_map.signals().values()]
    return BoundLog(
        path=path, log_map=log_map,
        parts=tuple(Part(table=tables[key], columns=tuple(columns)) for key, columns in wanted.items()),
        clock=clock.start if clock else None, slots=slots,
        joint_names=_joint_names(log_map, tables, slots["position"]),
        ahead=max(0, math.ceil(max(delays))), behind=max(0, -math.floor(min(delays))),
    )  # fmt: skip


def _requests(log_map: LogMap) -> Iterator[tuple[str, tuple[str | None, int | None], tuple[str | int, ...]]]:
    """Yield quantity, (file, interleaved) and columns of each section."""
    if log_map.time.column is not None:
        yield "time", (log_map.time.file, None), (log_map.time.column,)
    for kind, signal in log_map.signals().items():
        yield kind, (signal.file, signal.interleaved), signal.columns


def _check_lists(log_map: LogMap, slots: dict[str, slice]) -> None:
    """Refuse lists and matrices of a wrong length before any row is read."""
    for kind, signal in log_map.signals().items():
        count = slots[kind].stop - slots[kind].start
        matrix = _matrix(log_map.coupling, kind)
        if matrix is not None and matrix.shape[1] != count:
            where = f"{log_map.source}, [coupling]"
            raise MapError(f"matrix does not fit {kind}", where=where, expected=f"{count} x {count}", got=matrix.shape)
        signal.factors(count)
        signal.offsets(count)


def _joint_names(log_map: LogMap, tables: dict[tuple[str | None, int | None], Table], slot: slice) -> tuple[str, ...]:
    count = slot.stop - slot.start
    if log_map.joints and len(log_map.joints) != count:
        where = f"{log_map.source}, [joints] names"
        raise MapError("wrong number of joint names", where=where, expected=count, got=len(log_map.joints))
    stored = tables[log_map.position.file, log_map.position.interleaved].joint_names()
    fitting = stored if len(stored) == count else ()
    return log_map.joints or fitting or tuple(f"joint_{index + 1}" for index in range(count))


def _refill(rest: FloatArray, stream: Iterator[FloatArray]) -> FloatArray:
    """Return the next rows of a stream when none are left over."""
    while not len(rest):
        block = next(stream, None)
        if block is None:
            return rest
        rest = block
    return rest


def _undelayed(raw: FloatArray, signal: SignalMap, low: int, high: int) -> FloatArray:
    """Return rows `low` to `high` as they would be without the delay: `x[k] = raw[k + delay]`."""
    whole = math.floor(signal.delay_samples)
    part = signal.delay_samples - whole
    values = raw[low + whole : high + whole]
    return values if part == 0 else (1.0 - part) * values + part * raw[low + whole + 1 : high + whole + 1]


def joint_side(values: FloatArray, signal: SignalMap, log_map: LogMap) -> FloatArray:
    """Return raw numbers (n_t, columns) of one quantity in SI on the joint side, its delay left out."""
    scaled = values * signal.factors(values.shape[1])
    matrix = _matrix(log_map.coupling, signal.kind)
    coupled = scaled if matrix is None else scaled @ matrix.T
    coupled += signal.offsets(values.shape[1])
    return coupled


def _matrix(coupling: Coupling, kind: str) -> FloatArray | None:
    if kind in {"position", "velocity", "acceleration"}:
        return coupling.position
    return coupling.torque if kind == "torque" else None
