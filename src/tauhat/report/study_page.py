"""The page of a study: its summary, and every chapter with text, tables and drawings."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from tauhat.report.formatting import number
from tauhat.report.page import require_libraries, write_page
from tauhat.studies.study import Cell, Chapter, StudyResult, Table

if TYPE_CHECKING:
    from tauhat.report.case import Plot, Section

_ROUNDING = 1e-13  # of the largest number in a column
_FOLDED_FROM = 31  # rows of a table that is folded until a reader asks for it


class ShownCell(NamedTuple):
    """A cell as the page shows it."""

    text: str
    is_number: bool


class ShownTable(NamedTuple):
    """A table as the page shows it; `folded`: only its title until it is opened."""

    title: str
    header: tuple[ShownCell, ...]
    rows: tuple[tuple[ShownCell, ...], ...]
    note: str
    folded: bool


class ShownChart(NamedTuple):
    """A drawing with the words below it."""

    plot: Plot
    note: str


def write_study(path: str | Path, result: StudyResult) -> Path:
    """Write a self-contained HTML page of what a study found and return its path.

    Raises
    ------
    MissingExtraError
        when plotly or jinja2 is not installed.
    OutputError
        when the file cannot be written.
    """
    require_libraries()
    sections = [_summary(result), *(_section(chapter, index) for index, chapter in enumerate(result.chapters))]
    return write_page(path, sections, title=result.title)


def _summary(result: StudyResult) -> Section:
    from tauhat.report.case import Section
    from tauhat.report.rendering import rendered

    settings = tuple(_named(result.settings))
    html = rendered("study_settings.html.j2", summary=result.summary, settings=settings)
    return Section(key="summary", title="In short", html=html)


def _named(settings: Mapping[str, Any], inside: str = "") -> Iterator[tuple[str, str]]:
    """Yield settings and their values as text, those inside others with both names."""
    for name, value in settings.items():
        if isinstance(value, Mapping):
            yield from _named(value, f"{inside}{name}.")
        else:
            listed = value if isinstance(value, list | tuple) else [value]
            yield f"{inside}{name}", ", ".join(str(part) for part in listed)


def _section(chapter: Chapter, index: int) -> Section:
    from tauhat.report.case import Section
    from tauhat.report.rendering import rendered
    from tauhat.report.study_figures import study_plot

    charts = [
        ShownChart(study_plot(chart, key=f"chart-{index}-{number}"), chart.note)
        for number, chart in enumerate(chapter.charts)
    ]
    tables = [shown_table(table) for table in chapter.tables]
    html = rendered("study.html.j2", text=chapter.text, tables=tables, charts=charts)
    plots = tuple(chart.plot for chart in charts)
    return Section(key=f"chapter-{index}", title=chapter.title, html=html, plots=plots)


def shown_table(table: Table) -> ShownTable:
    """Return the table with its cells as text; columns with a number in them stand to the right."""
    nothing = [_nothing(row[column] for row in table.rows) for column in range(len(table.header))]
    rows = tuple(
        tuple(
            ShownCell(cell_text(cell, nothing=least), _is_number(cell))
            for cell, least in zip(row, nothing, strict=True)
        )
        for row in table.rows
    )
    counted = [any(row[column].is_number for row in rows) for column in range(len(table.header))]
    header = tuple(ShownCell(text, right) for text, right in zip(table.header, counted, strict=True))
    return ShownTable(table.title, header, rows, table.note, len(rows) >= _FOLDED_FROM)


def cell_text(cell: Cell, *, nothing: float = 0.0) -> str:
    """Return a cell as text: whole numbers whole, others to three digits, a dash where there is none.

    Parameters
    ----------
    nothing : size up to which a number is no more than rounding, and shown as zero
    """
    if not isinstance(cell, float):
        return str(cell)
    return number(0.0 if abs(cell) <= nothing else cell)


def _nothing(column: Iterable[Cell]) -> float:
    """Return the size that is rounding beside the largest number of a column."""
    sizes = [abs(cell) for cell in column if isinstance(cell, float) and math.isfinite(cell)]
    return _ROUNDING * max(sizes, default=0.0)


def _is_number(cell: Cell) -> bool:
    return not isinstance(cell, str)
