"""`tauhat study`: a study of methods on simulated arms, with its tables and its page."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from tauhat.cli.options import ClusterOption, JsonOption
from tauhat.cli.output import show, unbroken
from tauhat.cli.reporting import say, working

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tauhat.studies.study import Chapter, StudyResult, Table
    from tauhat.workers import Workers

_TERMINAL = 80  # columns of a usual one
_GAP = 3  # columns between those of a table; wider tables have one
_LONGEST_TABLE = 30  # rows that a terminal shows; longer ones are on the page and in the JSON document


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What `tauhat study` takes."""

    name: Annotated[
        str | None,
        typer.Argument(metavar="[NAME]", help="Which study; without one, the studies are listed.", show_default=False),
    ] = None
    seeds: Annotated[
        int | None,
        typer.Option("--seeds", metavar="N", min=1, help="Random cases.", show_default="the study's own"),
    ] = None
    workers: Annotated[
        int | None,
        typer.Option("--workers", metavar="N", min=1, help="Processes.", show_default="one a core"),
    ] = None
    cluster: ClusterOption = None
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="PAGE.html", help="Page with all text and drawings.", show_default=False
        ),
    ] = None
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Run a study of methods on simulated arms whose truth is known; without a name, list the studies."""
    if options.name is None:
        _list(options)
        return
    from tauhat.studies.registry import study_named

    study = study_named(options.name, seeds=options.seeds)
    started = time.perf_counter()
    with working(study.title):
        result = study.run(_workers(options), tell=lambda text: say(study.key, text))
    document: dict[str, Any] = {**result.to_dict(), "seconds": time.perf_counter() - started}
    if options.output is not None:
        from tauhat.report.study_page import write_study

        document["page"] = str(write_study(options.output, result))
    show(document, lambda: _view(result, options), as_json=options.as_json)


def _workers(options: Options) -> Workers:
    """Return who does the work."""
    from tauhat.cluster import workers_of

    return workers_of(options.cluster, options.workers)


def _list(options: Options) -> None:
    from tauhat.studies.registry import STUDIES

    document = {"studies": [{"name": key, "title": study.title} for key, study in STUDIES.items()]}

    def view() -> Iterator[RenderableType]:
        from tauhat.cli.views.tables import table

        made = table("Studies", ("name", "title"))
        for key, study in STUDIES.items():
            made.add_row(key, study.title)
        yield made
        yield unbroken("Run one: tauhat study NAME -o PAGE.html")

    show(document, view, as_json=options.as_json)


def _view(result: StudyResult, options: Options) -> Iterator[RenderableType]:
    from rich.text import Text

    yield Text(result.title, style="bold")
    yield Text(f"{result.summary}\n")
    for chapter in result.chapters:
        yield from _chapter(chapter)
    if options.output is not None:
        yield unbroken(f"Written: {options.output}")


def _chapter(chapter: Chapter) -> Iterator[RenderableType]:
    """Yield a chapter's tables, or its text where it has none."""
    from rich.text import Text

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
    from rich import box, table
    from rich.markup import escape

    from tauhat.report.study_page import cell_text

    made = table.Table(title=escape(shown.title), title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
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
