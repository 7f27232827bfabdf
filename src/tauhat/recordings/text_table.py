"""Text logs: comma, semicolon, tab or blanks between numbers, plain or gzip, with or without a header.

Blocks of lines go through Polars; a block it does not take is parsed again line by line, which either reads it or
names the row and the column that is wrong.
"""

from __future__ import annotations

import gzip
import io
import re
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import RecordingError
from tauhat.recordings.table import Table

GZIP_MAGIC = b"\x1f\x8b"
_BOM = b"\xef\xbb\xbf"
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")
_HEAD = 2**18  # [bytes] looked at to find out the layout
_BLOCK = 2**23  # [bytes] parsed at once
_COMMENTS = (b"#", b"%", b"//")
_NUMBER = re.compile(rb"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?(nan|inf(inity)?)", re.IGNORECASE)
_SAMPLE_LINES = 50


@dataclass(frozen=True, slots=True, kw_only=True)
class TextLayout:
    r"""How a text log is laid out.

    separator : b"," b";" b"\t", b" " for any run of blanks, b"" for one number per line
    decimal : b"." or b","
    skip : lines before the first row of numbers
    names : of the columns, empty without a header
    width : number of columns
    """

    separator: bytes
    decimal: bytes
    skip: int
    names: tuple[str, ...]
    width: int


class TextTable(Table):
    """A text log of any length, read in blocks of flat memory."""

    def __init__(self, path: Path) -> None:
        self.layout = find_layout(path)
        groups: dict[str, tuple[int, ...]] = {}
        for index, name in enumerate(self.layout.names):
            groups.setdefault(name, (index,))
        super().__init__(path, self.layout.names, groups)

    @property
    def width(self) -> int:
        """Number of columns."""
        return self.layout.width

    def blocks(self, columns: Sequence[int], start: int, stop: int | None) -> Iterator[FloatArray]:
        """Yield the rows of each block of lines."""
        row = 0
        with _opened(self.path) as file:
            for _ in range(self.layout.skip):
                file.readline()
            for text in _line_blocks(file, self.path):
                if stop is not None and row >= stop:
                    return
                lines = _cleaned(text, self.layout)
                count = lines.count(b"\n")
                if row + count > start:
                    numbers = self._parse(lines, columns, row)
                    yield numbers[max(0, start - row) : None if stop is None else stop - row]
                row += count

    def _parse(self, lines: bytes, columns: Sequence[int], row: int) -> FloatArray:
        import polars as pl

        count = lines.count(b"\n")
        separator = self.layout.separator.replace(b" ", b",") or b","
        wanted = sorted(set(columns))
        if lines.count(separator) != count * (self.width - 1):
            return self._parse_slowly(lines, columns, row)
        try:
            frame = pl.read_csv(
                io.BytesIO(lines),
                has_header=False,
                separator=separator.decode(),
                quote_char=None,
                schema={str(index): pl.Float64 if index in wanted else pl.String for index in range(self.width)},
                columns=wanted,
            )
        except pl.exceptions.PolarsError:
            return self._parse_slowly(lines, columns, row)
        numbers = frame.select([str(index) for index in wanted]).to_numpy()
        if len(numbers) != count:
            return self._parse_slowly(lines, columns, row)
        return numbers[:, [wanted.index(column) for column in columns]]

    def _parse_slowly(self, lines: bytes, columns: Sequence[int], row: int) -> FloatArray:
        separator = self.layout.separator.replace(b" ", b",")
        rows = []
        for index, line in enumerate(lines.split(b"\n")[:-1]):
            cells = line.split(separator) if separator else [line]
            if len(cells) != self.width:
                raise RecordingError(
                    "row cut short" if len(cells) < self.width else "row too long",
                    where=f"{self.path}, row {row + index}",
                    expected=f"{self.width} cells", got=len(cells), remedy="remove the row",
                )  # fmt: skip
            rows.append([self._number(cells[column], row + index, column) for column in columns])
        return np.array(rows, dtype=np.float64).reshape(-1, len(columns))

    def _number(self, cell: bytes, row: int, column: int) -> float:
        text = cell.strip()
        if not text:
            return float("nan")
        if _NUMBER.fullmatch(text):
            return float(text)
        name = f" ({self.names[column]})" if self.names else ""
        raise RecordingError(
            "text where a number should be",
            where=f"{self.path}, row {row}, column {column}{name}",
            got=repr(text[:40].decode("utf-8", errors="replace")),
            remedy="remove the row, or choose another column in the map",
        )


def find_layout(path: Path) -> TextLayout:
    """Return the layout of a text log from its first lines.

    Raises
    ------
    RecordingError
        empty, binary, or a damaged gzip file.
    """
    lines = _head_lines(path)
    first = next((index for index, line in enumerate(lines) if not _is_remark(line)), None)
    if first is None:
        raise RecordingError("no rows", where=path, got="only comments" if lines else "an empty file")
    data = [line for line in lines[first:] if not _is_remark(line)][:_SAMPLE_LINES]
    separator = _find_separator(data)
    cells = _cells(data[0], separator)
    written = [cell for cell in cells if cell]
    texts = sum(_NUMBER.fullmatch(cell.replace(b",", b".")) is None for cell in written)
    has_header = 2 * texts > len(written)
    comma = separator != b"," and any(b"," in line for line in data[has_header:])
    names = cells if has_header else _names_in_remark(lines[:first], separator, len(cells))
    return TextLayout(
        separator=separator, decimal=b"," if comma else b".", skip=first + has_header,
        names=tuple(_decoded(name) for name in names), width=len(cells),
    )  # fmt: skip


def _head_lines(path: Path) -> list[bytes]:
    with _opened(path) as file:
        head = file.read(_HEAD)
    if not head:
        raise RecordingError("empty file", where=path)
    if head.startswith(_UTF_16):
        raise RecordingError("UTF-16 text", where=path, expected="UTF-8", remedy="save the log again as UTF-8")
    if b"\0" in head:
        raise RecordingError("neither text nor a known format", where=path, expected="CSV, Parquet, NPZ or MAT")
    lines = head.removeprefix(_BOM).replace(b"\r\n", b"\n").split(b"\n")
    whole = lines[:-1] if len(head) == _HEAD else lines
    if not whole:
        raise RecordingError("absurdly long line", where=path, expected=f"at most {_HEAD} bytes")
    return whole


def _is_remark(line: bytes) -> bool:
    text = line.strip()
    return not text or text.startswith(_COMMENTS)


def _find_separator(lines: Sequence[bytes]) -> bytes:
    for candidate in (b";", b"\t", b","):
        if all(candidate in line for line in lines):
            return candidate
    return b" " if any(len(line.split()) > 1 for line in lines) else b""


def _cells(line: bytes, separator: bytes) -> list[bytes]:
    parts = line.split(separator) if separator.strip(b" ") else (line.split() if separator else [line])
    return [part.strip().strip(b'"').strip() for part in parts]


def _names_in_remark(remarks: Sequence[bytes], separator: bytes, width: int) -> list[bytes]:
    """Return the names in the comment line right above the numbers, if it fits them."""
    text = remarks[-1].strip().lstrip(b"#%/").strip() if remarks else b""
    names = _cells(text, separator) if text else []
    fits = len(names) == width and not any(_NUMBER.fullmatch(name) for name in names)
    return names if fits and width > 1 else []


def _decoded(name: bytes) -> str:
    try:
        return name.decode("utf-8")
    except UnicodeDecodeError:
        return name.decode("latin-1")


@contextmanager
def _opened(path: Path) -> Iterator[IO[bytes]]:
    """Open a plain or a gzip file by what it holds, not by its name."""
    try:
        with path.open("rb") as raw:
            packed = raw.read(2) == GZIP_MAGIC
            raw.seek(0)
            yield io.BufferedReader(gzip.GzipFile(fileobj=raw, mode="rb")) if packed else raw
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise RecordingError("damaged gzip file", where=path, got=error, remedy="copy the log again") from error
    except OSError as error:
        raise RecordingError("cannot be read", where=path, got=error.strerror or error) from error


def _line_blocks(file: IO[bytes], path: Path) -> Iterator[bytes]:
    """Yield blocks of whole lines, each line closed by a newline."""
    rest = b""
    while block := file.read(_BLOCK):
        text = rest + block
        cut = text.rfind(b"\n") + 1
        rest = text[cut:]
        if len(rest) > _HEAD:
            raise RecordingError("absurdly long line", where=path, expected=f"at most {_HEAD} bytes")
        if cut:
            yield text[:cut]
    if rest:
        yield rest + b"\n"


def _cleaned(text: bytes, layout: TextLayout) -> bytes:
    """Return the lines of numbers only: no comments, blank lines, quotes or padding."""
    lines = text.removeprefix(_BOM).replace(b"\r\n", b"\n").replace(b'"', b"")
    if layout.decimal == b",":
        lines = lines.replace(b",", b".")
    if b" " in lines or b"\t" in lines:
        lines = _without_padding(lines, layout.separator)
    if lines.startswith(b"\n") or b"\n\n" in lines or any(mark in lines for mark in _COMMENTS):
        kept = [line for line in lines.split(b"\n") if line and not line.startswith(_COMMENTS)]
        lines = b"\n".join(kept) + (b"\n" if kept else b"")
    return lines


def _without_padding(lines: bytes, separator: bytes) -> bytes:
    blanks = rb"[ ]" if separator == b"\t" else rb"[ \t]"
    trimmed = re.sub(rb"(?m)^" + blanks + rb"+|" + blanks + rb"+$", b"", lines)
    if separator == b" ":
        return re.sub(rb"[ \t]+", b",", trimmed)
    if not separator:
        return trimmed
    return re.sub(blanks + rb"*(" + re.escape(separator) + rb")" + blanks + rb"*", rb"\1", trimmed)
