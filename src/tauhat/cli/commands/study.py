"""`tauhat study`: a study of methods on simulated arms, with its tables and its page."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tauhat.cli.options import ClusterOption, JsonOption
from tauhat.cli.output import show, unbroken
from tauhat.cli.reporting import say, working

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tauhat.studies.study import StudyResult
    from tauhat.workers import Workers


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
    from tauhat.cli.views.study import study_view

    yield from study_view(result)
    if options.output is not None:
        yield unbroken(f"Written: {options.output}")
