"""A log file as numbered columns of numbers, whatever its format."""

from __future__ import annotations

import itertools
import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import MapError, RecordingError
from tauhat.recordings.logmap import Column

_NUMBERED = re.compile(r"^(.*?)(\d+)$")
_SHOWN_COLUMNS = 40


class Table(ABC):
    """Columns of one file: resolves names, reads blocks of rows.

    path : the file
    names : name of each column; empty where the file has none
    groups : name -> its columns; more than one for a two-dimensional array
    """

    def __init__(self, path: Path, names: Sequence[str], groups: dict[str, tuple[int, ...]]) -> None:
        self.path = path
        self.names = tuple(names)
        self.groups = groups

    @property
    @abstractmethod
    def width(self) -> int:
        """Number of columns."""

    @abstractmethod
    def blocks(self, columns: Sequence[int], start: int, stop: int | None) -> Iterator[FloatArray]:
        """Yield consecutive blocks (rows, len(columns)) of rows `start` to `stop`; empty cells are NaN.

        Raises
        ------
        RecordingError
            damaged file, text among the numbers, a row cut short.
        """

    def positions(self, columns: Sequence[Column], where: str) -> tuple[int, ...]:
        """Return the numbers of the columns that a map names.

        Raises
        ------
        MapError
            no such column; the message lists those there are.
        """
        return tuple(itertools.chain.from_iterable(self._position(column, where) for column in columns))

    def _position(self, column: Column, where: str) -> tuple[int, ...]:
        if isinstance(column, int):
            if column < self.width:
                return (column,)
            raise MapError(
                "no such column", where=where, got=column, expected=f"0 to {self.width - 1} in {self.path.name}"
            )
        if column in self.groups:
            return self.groups[column]
        found = self.listing() or f"{self.width} columns without names: use zero-based indices"
        raise MapError(f"no column {column[:80]!r} in {self.path.name}", where=where, remedy=f"there are {found}")

    def listing(self) -> str:
        """Return the column names on one line, numbered runs drawn together: `t, q_{1..6}`."""
        runs = compact_names(tuple(self.groups))
        more = f" and {len(runs) - _SHOWN_COLUMNS} more" if len(runs) > _SHOWN_COLUMNS else ""
        return ", ".join(name[:60] for name in runs[:_SHOWN_COLUMNS]) + more

    def joint_names(self) -> tuple[str, ...]:
        """Return the joint names the file itself carries, if any."""
        return ()


class InterleavedTable(Table):
    """A file with one number per line, `count` numbers per sample, sample after sample."""

    def __init__(self, base: Table, count: int) -> None:
        if base.width != 1:
            raise RecordingError("not one number per line", where=base.path, got=f"{base.width} columns")
        super().__init__(base.path, (), {})
        self._base = base
        self._count = count

    @property
    def width(self) -> int:
        """Numbers per sample."""
        return self._count

    def blocks(self, columns: Sequence[int], start: int, stop: int | None) -> Iterator[FloatArray]:
        """Yield blocks of whole samples."""
        rest = np.empty(0)
        end = None if stop is None else stop * self._count
        for block in self._base.blocks((0,), start * self._count, end):
            numbers = np.concatenate([rest, block[:, 0]])
            whole = numbers.size - numbers.size % self._count
            rest = numbers[whole:]
            yield numbers[:whole].reshape(-1, self._count)[:, list(columns)]
        if rest.size and end is None:
            raise RecordingError(
                "the last sample is cut short", where=self.path, expected=f"{self._count} numbers", got=rest.size
            )


def compact_names(names: Sequence[str]) -> list[str]:
    """Return names with numbered runs drawn together: q_1, q_2, q_3 -> q_{1..3}."""
    runs: list[list[str]] = []
    for name in names:
        if runs and _follows(runs[-1][-1], name):
            runs[-1].append(name)
        else:
            runs.append([name])
    return [_run_name(run) for run in runs]


def _follows(first: str, second: str) -> bool:
    a, b = _NUMBERED.match(first), _NUMBERED.match(second)
    return a is not None and b is not None and a[1] == b[1] and len(b[2]) < 9 and int(b[2]) == int(a[2][:9]) + 1


def _run_name(run: list[str]) -> str:
    a, b = _NUMBERED.match(run[0]), _NUMBERED.match(run[-1])
    return run[0] if len(run) < 2 or a is None or b is None else f"{a[1]}{{{a[2]}..{b[2]}}}"
