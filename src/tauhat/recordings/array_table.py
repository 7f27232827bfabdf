"""Arrays by key: NPZ and MAT files. The longer axis of a two-dimensional array is time."""

from __future__ import annotations

import struct
import tokenize
import warnings
import zipfile
import zlib
from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import RecordingError
from tauhat.recordings.table import Table

NPZ_MAGIC = b"PK"
HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"
_MOST_WIDTH = 1000  # a matrix wider than this is not a log
_NUMERIC = "biuf"
_DAMAGE = (
    OSError, EOFError, ValueError, TypeError, KeyError, IndexError, MemoryError, OverflowError, NotImplementedError,
    AttributeError, SyntaxError, RuntimeError, zipfile.BadZipFile, zlib.error, struct.error, tokenize.TokenError,
    Warning,
)  # fmt: skip  # what NumPy, zipfile and SciPy raise on damaged files


class ArrayTable(Table):
    """Arrays of one file; a two-dimensional one is a group of columns."""

    def __init__(self, path: Path, shapes: Mapping[str, tuple[int, ...]]) -> None:
        names: list[str] = []
        groups: dict[str, tuple[int, ...]] = {}
        self._leaves: list[tuple[str, int]] = []
        for key, shape in shapes.items():
            width = _oriented_width(shape)
            if width is None:
                continue
            groups[key] = tuple(range(len(names), len(names) + width))
            names.extend([key] if width == 1 else [f"{key}[{index}]" for index in range(width)])
            self._leaves.extend((key, index) for index in range(width))
        groups.update({name: (index,) for index, name in enumerate(names) if name not in groups})
        super().__init__(path, names, groups)

    @property
    def width(self) -> int:
        """Number of columns of all arrays together."""
        return len(self.names)

    @abstractmethod
    def _load(self, keys: Sequence[str]) -> Mapping[str, np.ndarray]: ...

    def blocks(self, columns: Sequence[int], start: int, stop: int | None) -> Iterator[FloatArray]:
        """Yield all rows at once: these formats are read whole."""
        leaves = [self._leaves[column] for column in columns]
        keys = list(dict.fromkeys(key for key, _ in leaves))
        arrays = {key: self._oriented(key, array) for key, array in self._load(keys).items()}
        lengths = {key: len(arrays[key]) for key in keys}
        if len(set(lengths.values())) > 1:
            raise RecordingError(
                "arrays of different length", where=self.path, got=", ".join(f"{k} {n}" for k, n in lengths.items())
            )
        yield np.stack([arrays[key][start:stop, index] for key, index in leaves], axis=1)

    def listing(self) -> str:
        """Return the keys with their number of columns."""
        keys = dict.fromkeys(key for key, _ in self._leaves)
        return ", ".join(f"{key} ({len(self.groups[key])})" for key in list(keys)[:40])

    def _oriented(self, key: str, array: np.ndarray) -> FloatArray:
        if array.dtype.kind not in _NUMERIC or array.ndim > 2:
            raise RecordingError(
                "not an array of numbers", where=f"{self.path}, {key}", got=f"{array.dtype} {array.shape}"
            )
        table = np.atleast_2d(array).astype(np.float64)
        oriented = table.T if table.shape[0] < table.shape[1] else table
        if oriented.shape[1] != len(self.groups[key]):
            raise _damaged(self.path, f"{key} of shape {array.shape}")
        return oriented


class NpzTable(ArrayTable):
    """A NumPy archive; pickled objects are never loaded."""

    def __init__(self, path: Path) -> None:
        try:
            shapes = _npz_shapes(path)
        except _DAMAGE as error:
            raise _damaged(path, error) from error
        super().__init__(path, shapes)

    def _load(self, keys: Sequence[str]) -> Mapping[str, np.ndarray]:
        try:
            with np.load(self.path, allow_pickle=False) as archive:
                return {key: archive[key] for key in keys}
        except _DAMAGE as error:
            raise _damaged(self.path, error) from error


class MatTable(ArrayTable):
    """A MATLAB file up to version 7; structs and cells are not read."""

    def __init__(self, path: Path) -> None:
        from tauhat.recordings.mat_file import mat_arrays

        try:
            self._arrays = mat_arrays(path.read_bytes())
        except _DAMAGE as error:
            raise _damaged(path, error) from error
        super().__init__(path, {name: array.shape for name, array in self._arrays.items()})

    def _load(self, keys: Sequence[str]) -> Mapping[str, np.ndarray]:
        try:
            return {key: self._arrays[key].values() for key in keys}
        except _DAMAGE as error:
            raise _damaged(self.path, error) from error


class OldMatTable(ArrayTable):
    """A MATLAB file of version 4."""

    def __init__(self, path: Path) -> None:
        from scipy.io import loadmat
        from scipy.io.matlab import MatReadError

        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                content = loadmat(path)
        except (*_DAMAGE, MatReadError) as error:
            raise _damaged(path, error) from error
        self._arrays = {name: array for name, array in content.items() if isinstance(array, np.ndarray)}
        shapes = {name: array.shape for name, array in self._arrays.items() if array.dtype.kind in _NUMERIC}
        super().__init__(path, shapes)

    def _load(self, keys: Sequence[str]) -> Mapping[str, np.ndarray]:
        return {key: self._arrays[key] for key in keys}


def refuse_hdf5(path: Path) -> RecordingError:
    """Return the error for MATLAB 7.3 files, which are HDF5."""
    return RecordingError(
        "HDF5 file (MATLAB 7.3)", where=path, expected="CSV, Parquet, NPZ or MAT up to version 7",
        remedy="in MATLAB: save('run.mat', ..., '-v7'); in Python: np.savez('run.npz', **arrays)",
    )  # fmt: skip


def _oriented_width(shape: tuple[int, ...]) -> int | None:
    """Return the number of columns of an array, None where it is no table."""
    if len(shape) > 2 or 0 in shape:
        return None
    width = min(shape) if len(shape) == 2 else 1
    return int(width) if width <= _MOST_WIDTH else None


def _npz_shapes(path: Path) -> dict[str, tuple[int, ...]]:
    """Return the shape of each array, read from the headers; refuses arrays that are larger than their file."""
    shapes = {}
    with zipfile.ZipFile(path) as archive:
        for entry in archive.infolist():
            with archive.open(entry) as file:
                version = np.lib.format.read_magic(file)
                read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
                shape, _, dtype = read(file)
            if dtype.kind in _NUMERIC and int(np.prod(shape, dtype=object)) * dtype.itemsize > entry.file_size:
                raise ValueError(f"{entry.filename} of shape {shape} is cut short")
            if dtype.kind in _NUMERIC:
                shapes[entry.filename.removesuffix(".npy")] = shape
    return shapes


def _damaged(path: Path, error: object) -> RecordingError:
    reason = str(error).splitlines()[0][:200] if str(error) else type(error).__name__
    return RecordingError("damaged array file", where=path, got=reason, remedy="copy or export the log again")
