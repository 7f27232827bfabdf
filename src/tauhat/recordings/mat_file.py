"""Numeric arrays of MATLAB level 5 files (`save -v6`, `-v7`), every size checked before memory is taken.

SciPy reads these files too, but takes the sizes in them on trust: a damaged file can end the process. Layout after
MathWorks, "MAT-File Format": a header of 128 bytes, then elements of an 8-byte tag (type, bytes) and data padded to
eight bytes; small elements keep up to four bytes of data inside the tag; a compressed element holds a zlib stream of
one element. A matrix element holds flags, dimensions, name and the real part.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from math import prod

import numpy as np

from tauhat.arrays import FloatArray

HEADER = 128  # [bytes]
_MATRIX, _COMPRESSED = 14, 15
_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_NUMERIC_CLASSES = range(6, 16)  # double, single, int8 to uint64
_COMPLEX = 0x0800
_MOST_RATIO = 1100  # zlib never packs tighter than 1032 to 1
_PREFIX = 2048  # [bytes] that hold flags, dimensions and name


@dataclass(frozen=True, slots=True, kw_only=True)
class MatArray:
    """Where one numeric array is in a file.

    shape : of the array
    content : bytes of its matrix element, still compressed or not
    packed : "zlib" or "plain"
    order : "<" or ">"
    """

    name: str
    shape: tuple[int, ...]
    content: memoryview
    packed: str
    order: str

    def values(self) -> FloatArray:
        """Return the array in double precision.

        Raises
        ------
        ValueError
            when its parts do not fit together.
        """
        body = _unpacked(self.content, self.order) if self.packed == "zlib" else self.content
        *_, real = _parts(body, self.order)
        kind, data = real
        if kind not in _TYPES:
            raise ValueError(f"{self.name}: unknown type of data {kind}")
        dtype = np.dtype(f"{self.order}{_TYPES[kind]}")
        if len(data) != prod(self.shape) * dtype.itemsize:
            raise ValueError(f"{self.name}: {len(data)} bytes for shape {self.shape}")
        return np.frombuffer(data, dtype=dtype).reshape(self.shape, order="F").astype(np.float64)


def mat_arrays(data: bytes) -> dict[str, MatArray]:
    """Return the real numeric arrays of a file by name; structs, cells, texts and complex arrays are left out.

    Raises
    ------
    ValueError
        a damaged file.
    """
    marks = {b"IM": "<", b"MI": ">"}
    if data[126:128] not in marks:
        raise ValueError("no byte order mark in the header")
    order = marks[data[126:128]]
    found = {}
    for kind, content in _elements(memoryview(data)[HEADER:], order, padded=False):
        if kind == _COMPRESSED:
            array = _array(_prefix(content, order), content, "zlib", order)
        elif kind == _MATRIX:
            array = _array(content, content, "plain", order)
        else:
            array = None
        if array is not None:
            found[array.name] = array
    return found


def _array(head: memoryview, content: memoryview, packed: str, order: str) -> MatArray | None:
    parts = _parts(head, order)
    (_, flags), (kind, dimensions), (_, name) = next(parts), next(parts), next(parts)
    if len(flags) < 4 or kind != 5 or len(dimensions) % 4:
        raise ValueError("a matrix without flags or dimensions")
    (flag,) = struct.unpack_from(f"{order}I", flags)
    if flag & 0xFF not in _NUMERIC_CLASSES or flag & _COMPLEX:
        return None
    shape = tuple(int(n) for n in np.frombuffer(dimensions, dtype=f"{order}i4"))
    if len(shape) < 2 or min(shape) < 0:
        raise ValueError(f"dimensions {shape}")
    return MatArray(name=bytes(name).decode("latin-1"), shape=shape, content=content, packed=packed, order=order)


def _parts(body: memoryview, order: str) -> Iterator[tuple[int, memoryview]]:
    """Yield flags, dimensions, name and real part of a matrix element."""
    count = 0
    for count, part in enumerate(_elements(body, order, padded=True), start=1):
        yield part
        if count == 4:
            return
    raise ValueError(f"a matrix of {count} parts")


def _elements(data: memoryview, order: str, *, padded: bool) -> Iterator[tuple[int, memoryview]]:
    """Yield type and content of elements one after the other; compressed ones are never padded."""
    place = 0
    while place + 8 <= len(data):
        kind, size = struct.unpack_from(f"{order}II", data, place)
        start = place + 8
        if kind >> 16:
            kind, size, start = kind & 0xFFFF, kind >> 16, place + 4
            if size > 4:
                raise ValueError(f"a small element of {size} bytes")
            place += 8
        else:
            place = start + (size + 7) // 8 * 8 if padded or kind != _COMPRESSED else start + size
        if start + size > len(data):
            raise ValueError("an element is longer than the file")
        yield kind, data[start : start + size]


def _prefix(content: memoryview, order: str) -> memoryview:
    """Return the first bytes of a compressed matrix, without its tag; its data part may be cut."""
    head = zlib.decompressobj().decompress(content, _PREFIX)
    _tag(head, order)
    return memoryview(head)[8:]


def _unpacked(content: memoryview, order: str) -> memoryview:
    stream = zlib.decompressobj()
    size = _tag(stream.decompress(content, 8), order)
    if size > _MOST_RATIO * len(content):
        raise ValueError("an element is longer than zlib can pack")
    body = stream.decompress(stream.unconsumed_tail, size) if size else b""
    if len(body) != size:
        raise ValueError("a compressed element is cut short")
    return memoryview(body)


def _tag(head: bytes, order: str) -> int:
    if len(head) < 8:
        raise ValueError("a compressed element is cut short")
    kind, size = struct.unpack_from(f"{order}II", head)
    if kind != _MATRIX:
        raise ValueError("a compressed element is not a matrix")
    return int(size)
