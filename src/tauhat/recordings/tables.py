"""Raw readers: a log file of any known format as a table of numbers, by its content and not by its name."""

from __future__ import annotations

from pathlib import Path

from tauhat.errors import RecordingError
from tauhat.files import existing_file
from tauhat.recordings.array_table import HDF5_MAGIC, NPZ_MAGIC, MatTable, NpzTable, OldMatTable, refuse_hdf5
from tauhat.recordings.parquet_table import PARQUET_MAGIC, ParquetTable
from tauhat.recordings.table import InterleavedTable, Table
from tauhat.recordings.text_table import TextTable

_MAT_MAGIC = b"MATLAB"
_MAT_73 = b"MATLAB 7.3"


def open_table(path: str | Path, *, interleaved: int | None = None) -> Table:
    """Return a log file as a table; only its head is read yet.

    Parameters
    ----------
    interleaved : numbers per sample, for files of one number per line

    Raises
    ------
    RecordingError
        missing, empty, damaged or of an unknown format.
    """
    place = existing_file(path, error=RecordingError)
    table = _open_by_content(place)
    return table if interleaved is None else InterleavedTable(table, interleaved)


def _open_by_content(path: Path) -> Table:
    try:
        with path.open("rb") as file:
            head = file.read(128)
    except OSError as error:
        raise RecordingError("cannot be read", where=path, got=error.strerror or error) from error
    if not head:
        raise RecordingError("empty file", where=path)
    if head.lstrip()[:1] == b"{":
        raise RecordingError("JSON, not a log", where=path, expected="CSV, Parquet, NPZ or MAT")
    if head.startswith(PARQUET_MAGIC):
        return ParquetTable(path)
    if head.startswith(NPZ_MAGIC):
        return NpzTable(path)
    if head.startswith((HDF5_MAGIC, _MAT_73)):
        raise refuse_hdf5(path)
    if head.startswith(_MAT_MAGIC) or head[126:128] in {b"IM", b"MI"}:
        return MatTable(path)
    if path.suffix.lower() == ".mat":
        return OldMatTable(path)
    return TextTable(path)
