"""What a study found, for a terminal: its summary, and the tables that are not too long for one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import rich.table
from rich import box
from rich.markup import escape
from rich.text import Text

from tauhat.studies.study import Chapter, StudyResult

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderableType

    from tauhat.report.study_page import ShownTable

_GAP = 3  # columns between those of a table; wider tables have one
_EDGES = 2  # columns left and right of a table
_WRAPPED_FROM = 24  # columns of text beyond which it may wrap
_LONGEST_TABLE = 30  # rows that a terminal shows; longer ones are on the page and in the JSON document


def study_view(result: StudyResult) -> Iterator[RenderableType]:
    """Yield title, summary and chapters."""
    yield Text(result.title, style="bold")
    yield Text(f"{result.summary}\n")
    for chapter in result.chapters:
        yield from _chapter(chapter)


def _chapter(chapter: Chapter) -> Iterator[RenderableType]:
    """Yield a chapter's tables, or its text where it has none."""
    from tauhat.report.study_page import shown_table

    for made in chapter.tables:
        if len(made.rows) > _LONGEST_TABLE:
            yield Text(f"{made.title}: {len(made.rows)} rows, on the page (-o PAGE.html) and in --json.\n")
            continue
        yield _Fitted(shown_table(made))
        if made.note:
            yield Text(f"{made.note}\n", style="dim")
    if not chapter.tables:
        yield Text(chapter.title, style="bold")
        for paragraph in chapter.text:
            yield Text(f"{paragraph}\n")


@dataclass(frozen=True, slots=True)
class _Fitted:
    """A table that loses nothing in a narrow terminal: text wraps, and columns without room follow below."""

    shown: ShownTable

    def __rich_console__(self, _: Console, options: ConsoleOptions) -> Iterator[RenderableType]:
        columns = _columns(self.shown)
        for number, (part, gap) in enumerate(_parts(columns, options.max_width)):
            title = self.shown.title if number == 0 else f"{self.shown.title}, continued"
            yield _table(part, title=title, gap=gap, room=options.max_width)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Column:
    """A column: its head and cells, whether they are numbers, and how narrow it may be."""

    head: str
    cells: tuple[str, ...]
    is_number: bool

    @property
    def least(self) -> int:
        """Width below which it cannot be read: numbers and the words of a head never break."""
        return max(self._word, self._cell if self.is_number else min(self._cell, _WRAPPED_FROM))

    @property
    def natural(self) -> int:
        """Width at which nothing wraps."""
        return max(len(self.head), self._cell)

    @property
    def _word(self) -> int:
        return max(map(len, self.head.split()), default=0)

    @property
    def _cell(self) -> int:
        return max(map(len, self.cells), default=0)


def _columns(shown: ShownTable) -> tuple[_Column, ...]:
    cells = list(zip(*shown.rows, strict=True)) or [()] * len(shown.header)
    return tuple(
        _Column(head=head.text, cells=tuple(cell.text for cell in column), is_number=head.is_number)
        for head, column in zip(shown.header, cells, strict=True)
    )


def _parts(columns: tuple[_Column, ...], room: int) -> Iterator[tuple[tuple[_Column, ...], int]]:
    """Yield columns that fit beside each other, and the gap between them; each part begins with what names the rows."""
    for gap in (_GAP, 1):
        if _least_width(columns, gap) <= room:
            yield columns, gap
            return
    names = next((index + 1 for index, column in enumerate(columns) if not column.is_number), 1)
    rest = list(columns[names:])
    while rest:
        part = [*columns[:names], rest.pop(0)]
        while rest and _least_width((*part, rest[0]), _GAP) <= room:
            part.append(rest.pop(0))
        yield tuple(part), _GAP


def _least_width(columns: Sequence[_Column], gap: int) -> int:
    return sum(column.least for column in columns) + gap * (len(columns) - 1) + _EDGES


def _widths(columns: tuple[_Column, ...], room: int) -> list[int]:
    """Return the width of each column: what is left of the room goes to those that wrap, evenly."""
    widths = [column.least for column in columns]
    spare = room - sum(widths)
    while spare > 0:
        wanting = [index for index, column in enumerate(columns) if widths[index] < column.natural][:spare]
        if not wanting:
            break
        for index in wanting:
            widths[index] += 1
        spare -= len(wanting)
    return widths


def _table(columns: tuple[_Column, ...], *, title: str, gap: int, room: int) -> RenderableType:
    made = rich.table.Table(title=escape(title), title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
    made.pad_edge = False
    if gap < _GAP:
        made.padding = (0, 0)
    widths = _widths(columns, room - gap * (len(columns) - 1) - _EDGES)
    for column, width in zip(columns, widths, strict=True):
        side: Literal["left", "right"] = "right" if column.is_number else "left"
        made.add_column(escape(column.head), justify=side, width=width, overflow="fold")
    for row in zip(*(column.cells for column in columns), strict=True):
        made.add_row(*map(escape, row))
    return made
