"""Reading logs: whole as `Log` or `Recording`, or chunk by chunk in flat memory."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import RecordingError
from tauhat.files import existing_file, sha256_of
from tauhat.recordings.binding import BoundLog, bind
from tauhat.recordings.log import Log
from tauhat.recordings.logmap import LogMap, RowWindow
from tauhat.recordings.mapfile import FOLDER_MAP, find_map, load_map
from tauhat.recordings.recognising import recognise
from tauhat.recordings.recording import FEWEST_SAMPLES, Recording, Source
from tauhat.recordings.tables import open_table

Rows = tuple[int, int | None]
CHUNK = 100_000  # [samples]


def read_recording(
    path: str | Path,
    *,
    map: LogMap | str | Path | None = None,  # noqa: A002
    rows: Rows | None = None,
) -> Recording:
    """Return a log as a valid recording.

    Parameters
    ----------
    path : CSV (plain or gzip), Parquet, NPZ or MAT file
    map : the map or its file; by default the one beside the log, else plain column names are recognised
    rows : window of rows, zero-based, end excluded; overrides the map's

    Raises
    ------
    RecordingError
        a file that cannot be read, or is not a motion on one clock.
    MapError
        a map that is malformed, missing, or does not fit the file.
    """
    return read_log(path, map=map, rows=rows).recording()


def read_log(
    path: str | Path,
    *,
    map: LogMap | str | Path | None = None,  # noqa: A002
    rows: Rows | None = None,
) -> Log:
    """Return a log in SI on the joint side, with whatever is wrong in it still there.

    Parameters and errors as `read_recording`, but NaN, time going back and the like are kept for `check_log`.
    """
    bound, window = _opened(path, map, rows)
    start = max(0, window.start - bound.behind)
    stop = None if window.stop is None else window.stop + bound.ahead
    blocks = list(bound.blocks(start, stop))
    raw = blocks[0] if len(blocks) == 1 else np.concatenate(blocks) if blocks else np.empty((0, 0))
    blocks.clear()
    _refuse_short(bound, window, start + len(raw))
    low, high = _usable(bound, window, start, len(raw))
    if low >= high:
        raise RecordingError("no rows are left after the delays", where=path, got=f"{len(raw)} rows")
    log = bound.log(raw, start, (low, high))
    return replace(log, source=_source(bound, low, high, sha256_of(bound.files)))


def read_chunks(
    path: str | Path,
    *,
    map: LogMap | str | Path | None = None,  # noqa: A002
    rows: Rows | None = None,
    chunk: int = CHUNK,
) -> Iterator[Recording]:
    """Yield a log as consecutive recordings without overlap, in memory that does not grow with the log.

    Parameters
    ----------
    chunk : samples per recording; the last one may be up to 15 longer, or shorter

    CSV and Parquet are streamed; NPZ and MAT files are read whole. Other parameters and errors as `read_recording`;
    errors come when the row that is wrong is reached.
    """
    if chunk < FEWEST_SAMPLES:
        raise RecordingError("chunk is too small", where=path, expected=f">= {FEWEST_SAMPLES}", got=chunk)
    return _chunks(*_opened(path, map, rows), chunk)


def map_of(path: str | Path, given: LogMap | str | Path | None = None) -> LogMap:
    """Return the map that a log is read with: the given one, the one beside it, or what its column names say.

    Raises
    ------
    RecordingError, MapError
        as `read_recording`.
    """
    place = existing_file(path, error=RecordingError)
    chosen = given if given is not None else find_map(place)
    if given is None and chosen == place.with_name(FOLDER_MAP) and open_table(place).joint_names():
        chosen = None  # written by tauhat, not one of the logs that the folder's map is for
    if chosen is None:
        return recognise(open_table(place))
    return chosen if isinstance(chosen, LogMap) else load_map(chosen)


def _chunks(bound: BoundLog, window: RowWindow, chunk: int) -> Iterator[Recording]:
    digest = sha256_of(bound.files)
    last: Recording | None = None
    for raw, first, (low, high) in _windows(bound, window, chunk):
        log = bound.log(raw, first, (low, high))
        log = _joined(last, replace(log, source=_source(bound, low, high, digest)))
        last = log.recording()
        yield last


def _windows(bound: BoundLog, window: RowWindow, chunk: int) -> Iterator[tuple[FloatArray, int, tuple[int, int]]]:
    """Yield raw rows, the row they begin at, and the rows of each chunk among them."""
    first = max(0, window.start - bound.behind)
    stop = None if window.stop is None else window.stop + bound.ahead
    raw = np.empty((0, sum(len(part.columns) for part in bound.parts)))
    enough = bound.behind + chunk + FEWEST_SAMPLES + bound.ahead
    low = max(window.start, first + bound.behind)
    for block in bound.blocks(first, stop):
        raw = np.concatenate([raw, block])
        while first + len(raw) - (low - bound.behind) >= enough:
            yield raw, first, (low, low + chunk)
            low += chunk
            raw, first = raw[low - bound.behind - first :], low - bound.behind
    _refuse_short(bound, window, first + len(raw))
    high = _usable(bound, window, first, len(raw))[1]
    if high > low:
        yield raw, first, (low, high)


def _joined(last: Recording | None, log: Log) -> Log:
    """Return the log without its first row where that repeats the last row before; refuse time going back."""
    if last is None or not log.n_t or log.t[0] > last.t[-1]:
        return log
    signals = log.signals()
    same = all(np.array_equal(getattr(last, name)[-1], signal[0]) for name, signal in signals.items())
    if log.t[0] == last.t[-1] and same:
        return log.samples(1, log.n_t)
    what = "time goes back" if log.t[0] < last.t[-1] else "two samples at one time with different values"
    step = f"a step of {log.t[0] - last.t[-1]:g} s"
    raise RecordingError(what, where=log.place(0), got=step, remedy="`tauhat check` lists all such rows")


def _opened(path: str | Path, log_map: LogMap | str | Path | None, rows: Rows | None) -> tuple[BoundLog, RowWindow]:
    chosen = map_of(path, log_map)
    window = chosen.rows if rows is None else RowWindow(start=rows[0], stop=rows[1])
    return bind(existing_file(path, error=RecordingError), chosen), window


def _usable(bound: BoundLog, window: RowWindow, first: int, count: int) -> tuple[int, int]:
    """Return the rows of the window for which every delayed channel has a value."""
    high = first + count - bound.ahead
    return max(window.start, first + bound.behind), high if window.stop is None else min(window.stop, high)


def _refuse_short(bound: BoundLog, window: RowWindow, end: int) -> None:
    if end == 0:
        raise RecordingError("no rows", where=bound.path)
    if end <= window.start or (window.stop is not None and end < window.stop):
        asked = f"{window.start}:{'' if window.stop is None else window.stop}"
        there = f"the file ends at row {end}" if end > window.start else "the file ends before it"
        raise RecordingError("no such rows", where=bound.path, got=f"rows {asked}, {there}", remedy="choose other rows")


def _source(bound: BoundLog, low: int, high: int, digest: str) -> Source:
    return Source(path=bound.path.name, sha256=digest, rows=(low, high))
