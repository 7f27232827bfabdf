"""What a study found, for a terminal: its summary, and the tables that are not too long for one."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Literal

import rich.table
from rich import box
from rich.markup import escape
from rich.text import Text

from tauhat.studies.study import Chapter, StudyResult, Table

if TYPE_CHECKING:
    from rich.console import RenderableType

_TERMINAL = 80  # columns of a usual one
_GAP = 3  # columns between those of a table; wider tables have one
_LONGEST_TABLE = 30  # rows that a terminal shows; longer ones are on the page and in the JSON document


def study_view(result: StudyResult) -> Iterator[RenderableType]:
    """Yield title, summary and chapters."""
    yield Text(result.title, style="bold")
    yield Text(f"{result.summary}\n")
    for chapter in result.chapters:
        yield from _chapter(chapter)


def _chapter(chapter: Chapter) -> Iterator[RenderableType]:
    """Yield a chapter's tables, or its text where it has none."""
    for made in chapter.tables:
        if len(made.rows) > _LONGEST_TABLE:
            yield Text(f"{made.title}: {len(made.rows)} rows, on the page (-o PAGE.html) and in --json.\n")
            continue
        yield _table(made)
        if made.note:
            yield Text(f"{made.note}\n", style="dim")
    if not chapter.tables:
        yield Text(chapter.title, style="bold")
        for paragraph in chapter.text:
            yield Text(f"{paragraph}\n")


def _table(shown: Table) -> RenderableType:
    """Return a table whose headers wrap between words and whose cells never do."""
    from tauhat.report.study_page import cell_text

    made = rich.table.Table(title=escape(shown.title), title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
    made.pad_edge = False
    widths = []
    rows = [[cell_text(cell) for cell in row] for row in shown.rows]
    for column, head in enumerate(shown.header):
        cells = [row[column] for row in rows]
        right = any(not isinstance(row[column], str) for row in shown.rows)
        widest = max(len(word) for word in (*head.split(), *cells))
        side: Literal["left", "right"] = "right" if right else "left"
        made.add_column(escape(head), justify=side, min_width=widest, no_wrap=not right)
        widths.append(widest)
    if sum(widths) + _GAP * len(widths) > _TERMINAL:
        made.padding = (0, 0)
    for row in rows:
        made.add_row(*(escape(text) for text in row))
    return made
