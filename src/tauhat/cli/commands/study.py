"""`tauhat study`: a study of methods on simulated arms or on logs of real ones, with its tables and its page."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tauhat.cli.options import ClusterOption, JsonOption, StudyPageOption, WorkersOption
from tauhat.cli.output import show, unbroken
from tauhat.cli.reporting import say, working
from tauhat.cli.studies import show_result

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tauhat.workers import Workers

_SETTINGS = ("seeds", "robot", "cases", "data", "estimators", "models")  # of studies; each says which it takes


class Names(tuple[str, ...]):
    """Names with commas between."""


def names(text: str) -> Names:
    """Return the names that a list has."""
    found = Names(name.strip() for name in text.split(","))
    if not all(found):
        raise typer.BadParameter(f"not names with commas between: {text!r}")
    return found


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
    robot: Annotated[
        str | None,
        typer.Option("--robot", metavar="ROBOT", help="Arm that is studied.", show_default="the study's own"),
    ] = None
    cases: Annotated[
        Path | None,
        typer.Option(
            "--cases", metavar="CASES.toml", help="Logs that are fitted and judged.", show_default=False, readable=False
        ),
    ] = None
    data: Annotated[
        Path | None,
        typer.Option("--data", metavar="FOLDER", help="Where those logs are.", show_default="beside CASES.toml"),
    ] = None
    estimators: Annotated[
        Names | None,
        typer.Option(
            "--estimators",
            metavar="NAME[,NAME...]",
            parser=names,
            help="Methods that are compared.",
            show_default="the study's own",
        ),
    ] = None
    models: Annotated[
        Names | None,
        typer.Option(
            "--models",
            metavar="NAME[,NAME...]",
            parser=names,
            help="plain, robust, auto or a TOML file, also with +physical.",
            show_default="the study's own",
        ),
    ] = None
    workers: WorkersOption = None
    cluster: ClusterOption = None
    output: StudyPageOption = None
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Run a study of methods, on simulated arms or on logs of real ones; without a name, list the studies."""
    if options.name is None:
        _list(options)
        return
    from tauhat.files import check_output
    from tauhat.studies.registry import study_named

    given = {name: value for name in _SETTINGS if (value := getattr(options, name)) is not None}
    study = study_named(options.name, given)
    if options.output is not None:
        check_output(options.output)
    started = time.perf_counter()
    with working(study.title):
        result = study.run(_workers(options), tell=lambda text: say(study.key, text))
    seconds = time.perf_counter() - started
    show_result(result, {"seconds": seconds}, page=options.output, as_json=options.as_json)


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
