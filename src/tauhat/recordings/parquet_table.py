"""Parquet logs, read slice by slice."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from tauhat.arrays import FloatArray
from tauhat.errors import RecordingError
from tauhat.recordings.table import Table

if TYPE_CHECKING:
    import polars as pl

PARQUET_MAGIC = b"PAR1"
JOINT_NAMES_KEY = "tauhat.joint_names"
_SLICE = 2**17  # [rows] read at once


class ParquetTable(Table):
    """A Parquet log of any length."""

    def __init__(self, path: Path) -> None:
        import polars as pl

        try:
            with _silenced():
                self._open(path)
        except (pl.exceptions.PolarsError, pl.exceptions.PanicException, OSError, UnicodeDecodeError) as error:
            raise _damaged(path, error) from error
        names = tuple(self._schema.names())
        super().__init__(path, names, {name: (index,) for index, name in enumerate(names)})

    def _open(self, path: Path) -> None:
        import polars as pl

        self._lazy = pl.scan_parquet(path, glob=False)
        self._schema = self._lazy.collect_schema()
        self._metadata = pl.read_parquet_metadata(path)
        self._rows = int(self._lazy.select(pl.len()).collect().item())

    @property
    def width(self) -> int:
        """Number of columns."""
        return len(self.names)

    def blocks(self, columns: Sequence[int], start: int, stop: int | None) -> Iterator[FloatArray]:
        """Yield slices of rows."""
        import polars as pl

        wanted = [self._numeric(column) for column in columns]
        end = self._rows if stop is None else min(stop, self._rows)
        for first in range(start, end, _SLICE):
            selected = self._lazy.select([pl.col(name).cast(pl.Float64) for name in dict.fromkeys(wanted)])
            try:
                with _silenced():
                    frame = selected.slice(first, min(_SLICE, end - first)).collect()
            except (pl.exceptions.PolarsError, pl.exceptions.PanicException, OSError) as error:
                raise _damaged(self.path, error) from error
            if frame.height != min(_SLICE, end - first):
                raise _damaged(self.path, f"{frame.height} rows")
            yield frame.to_numpy()[:, [frame.columns.index(name) for name in wanted]]

    def joint_names(self) -> tuple[str, ...]:
        """Return the names that `write_recording` stored."""
        try:
            names = json.loads(self._metadata.get(JOINT_NAMES_KEY, "[]"))
        except (ValueError, RecursionError):
            return ()
        return tuple(names) if isinstance(names, list) and all(isinstance(name, str) for name in names) else ()

    def _numeric(self, column: int) -> str:
        name = self.names[column]
        dtype: pl.DataType = self._schema[name]
        if not dtype.is_numeric():
            raise RecordingError("not a column of numbers", where=f"{self.path}, column {name}", got=dtype)
        return name


@contextmanager
def _silenced() -> Iterator[None]:
    """Keep off standard error what Polars' native threads print there when a damaged file makes them panic."""
    try:
        kept = os.dup(2)
    except OSError:  # there is no standard error
        yield
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(nowhere)
        os.close(kept)


def _damaged(path: Path, error: object) -> RecordingError:
    reason = str(error).splitlines()[0][:200] if str(error) else type(error).__name__
    return RecordingError("damaged Parquet file", where=path, got=reason, remedy="copy the log again")
