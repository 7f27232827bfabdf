"""Writing recordings as Parquet or CSV, whole or not at all."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO, TYPE_CHECKING

from tauhat.arrays import FloatArray
from tauhat.errors import OutputError
from tauhat.files import replace_file
from tauhat.recordings.parquet_table import JOINT_NAMES_KEY
from tauhat.recordings.recording import Recording

if TYPE_CHECKING:
    import polars as pl

_ENDINGS = (".parquet", ".csv", ".csv.gz")
_WRENCH = ("fx", "fy", "fz", "mx", "my", "mz")
_ROWS = 2**17  # per row group, so that readers can take a Parquet log in slices
_QUICK = 3  # gzip level: logs of noise gain little from higher ones


def write_recording(recording: Recording, path: str | Path) -> None:
    """Write a recording: Parquet exactly and with joint names, CSV (.csv or .csv.gz) with shortest exact numbers.

    Columns: t, q_1 .., dq_1 .., ddq_1 .., tau_1 .., temperature_1 .., fx, fy, fz, mx, my, mz, as far as measured.
    Such a file is read back without a map.

    Raises
    ------
    OutputError
        unknown ending, or a file that cannot be written; nothing half-written is left.
    """
    names = json.dumps(list(recording.joint_names))
    write_columns(recording_columns(recording), path, metadata={JOINT_NAMES_KEY: names})


def write_columns(
    columns: Mapping[str, FloatArray], path: str | Path, *, metadata: Mapping[str, str] | None = None
) -> None:
    """Write named columns of equal length as Parquet or CSV by the ending of `path`.

    Parameters
    ----------
    metadata : key-value pairs kept in a Parquet file; CSV has no place for them

    Raises
    ------
    OutputError
        unknown ending, or a file that cannot be written; nothing half-written is left.
    """
    import polars as pl

    writers: Mapping[str, Callable[[pl.DataFrame, Path], None]] = {
        ".parquet": lambda frame, part: frame.write_parquet(part, row_group_size=_ROWS, metadata=dict(metadata or {})),
        ".csv": _write_csv,
        ".csv.gz": _write_gzip,
    }
    write = writers[log_ending(path)]
    frame = pl.DataFrame(dict(columns))
    try:
        replace_file(path, lambda part: write(frame, part))
    except pl.exceptions.PolarsError as error:
        reason = str(error).splitlines()[0]
        raise OutputError("cannot be written", where=path, got=reason, remedy="is the disk full?") from error


def log_ending(path: str | Path) -> str:
    """Return the ending that tells the format of a log to write.

    Raises
    ------
    OutputError
        another ending.
    """
    name = Path(path).name.lower()
    ending = next((ending for ending in _ENDINGS if name.endswith(ending)), None)
    if ending is None:
        raise OutputError("unknown ending", where=path, expected=", ".join(_ENDINGS))
    return ending


def recording_columns(recording: Recording) -> dict[str, FloatArray]:
    """Return the columns of a recording by the names they have in files, each (n_t,)."""
    columns = {"t": recording.t}
    for name in recording.channels():
        value = getattr(recording, name)
        labels = _WRENCH if name == "wrench" else [f"{name}_{index + 1}" for index in range(value.shape[1])]
        columns.update({label: value[:, index] for index, label in enumerate(labels)})
    return columns


def _write_csv(frame: pl.DataFrame, path: Path) -> None:
    with path.open("wb") as file:
        _write_slices(frame, file)


def _write_gzip(frame: pl.DataFrame, path: Path) -> None:
    with (
        path.open("wb") as raw,
        gzip.GzipFile(filename="", fileobj=raw, mode="wb", compresslevel=_QUICK, mtime=0) as file,
    ):
        _write_slices(frame, file)


def _write_slices(frame: pl.DataFrame, file: IO[bytes] | gzip.GzipFile) -> None:
    """Write slice by slice through Python's own file, whose errors keep their number."""
    for first in range(0, frame.height, _ROWS):
        file.write(frame.slice(first, _ROWS).write_csv(include_header=first == 0).encode("ascii"))
