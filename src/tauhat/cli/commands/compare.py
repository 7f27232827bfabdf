"""`tauhat compare`: models and estimators beside each other, judged on unseen recordings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tauhat.cli.options import (
    ControllerOption,
    CutoffOption,
    JsonOption,
    LockOption,
    LogArguments,
    MapOption,
    RobotArgument,
    RowsOption,
    Window,
    window,
)
from tauhat.cli.output import show, unbroken
from tauhat.cli.reporting import say, working

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tauhat.recordings.recording import Recording
    from tauhat.robots.robot import Robot
    from tauhat.studies import Candidate, Comparison

_ESTIMATORS = ["wls"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What `tauhat compare` takes."""

    robot: RobotArgument
    logs: LogArguments
    unseen: Annotated[
        list[Path],
        typer.Option(
            "--unseen",
            metavar="LOG",
            help="Recording to judge on; may be repeated.",
            show_default=False,
            readable=False,
        ),
    ]
    task: Annotated[
        list[Path] | None,
        typer.Option(
            "--task",
            metavar="LOG",
            help="Recording near the work: models are fitted to the LOGs, to these, and to both; may be repeated.",
            show_default=False,
            readable=False,
        ),
    ] = None
    models: Annotated[
        list[str] | None,
        typer.Option(
            "--model",
            metavar="TERMS",
            help="As for identify, with +physical for --physical; may be repeated.",
            show_default="plain, robust",
        ),
    ] = None
    estimators: Annotated[
        list[str] | None,
        typer.Option("--estimator", metavar="NAME", help="May be repeated.", show_default="wls"),
    ] = None
    controller: ControllerOption = None
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="PAGE.html", help="Page with table and figure.", show_default=False),
    ] = None
    map_file: MapOption = None
    unseen_map: Annotated[
        Path | None,
        typer.Option(
            "--unseen-map", metavar="MAP.toml", help="Map of the unseen logs.", show_default="as --map", readable=False
        ),
    ] = None
    rows: RowsOption = None
    unseen_rows: Annotated[
        Window | None,
        typer.Option(
            "--unseen-rows",
            metavar="FROM:TO",
            parser=window,
            help="Window of rows of each unseen log.",
            show_default=False,
        ),
    ] = None
    cutoff: CutoffOption = None
    lock: LockOption = None
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Identify with several models and estimators, and compare them on recordings that none was fitted to."""
    from tauhat.cli.inputs import read_recordings, robot_of_recordings
    from tauhat.estimation.estimators import check_simulating
    from tauhat.studies import FittedSet, compare_sets

    if options.controller is not None:
        check_simulating(options.estimators or _ESTIMATORS)
    with working("reading"):
        logs = [*options.logs, *(options.task or [])]
        fitted = read_recordings(logs, map_file=options.map_file, rows=options.rows)
        unseen_map = options.unseen_map or options.map_file
        judged = read_recordings(options.unseen, map_file=unseen_map, rows=options.unseen_rows)
        robot = robot_of_recordings(options.robot, (*fitted, *judged), locked=options.lock)
    sets = [
        FittedSet(
            name=name, recordings=fitted[part], candidates=_candidates(robot, fitted[part], logs[part], options)
        )
        for name, part in _parts(options).items()
    ]  # fmt: skip
    with working("comparing"):
        result = compare_sets(sets, judged, cutoff=options.cutoff, tell=lambda name: say("identifying", name))
    document = result.to_dict()
    if options.output is not None:
        from tauhat.report.page import write_comparison

        write_comparison(options.output, result, title=f"{robot.name}: models and estimators compared")
        document["page"] = str(options.output)
    show(document, lambda: _view(result, options), as_json=options.as_json)


def _parts(options: Options) -> dict[str, slice]:
    """Return which of the logs and those of the task models are fitted to, by the name of the part."""
    if not options.task:
        return {"": slice(None)}
    count = len(options.logs)
    return {"global": slice(count), "task": slice(count, None), "both": slice(None)}


def _candidates(robot: Robot, fitted: tuple[Recording, ...], logs: list[Path], options: Options) -> list[Candidate]:
    """Return every model with every estimator, models in the outer loop."""
    from tauhat.studies.comparison import candidate_named

    candidates = [
        candidate_named(robot, model, estimator, recordings=fitted)
        for model in options.models or ["plain", "robust"]
        for estimator in options.estimators or _ESTIMATORS
    ]
    return candidates if options.controller is None else _driven(candidates, robot, logs, options)


def _driven(candidates: list[Candidate], robot: Robot, logs: list[Path], options: Options) -> list[Candidate]:
    """Return the candidates, the simulating ones with the controller of the fitted logs."""
    from tauhat.cli.inputs import loop_of, sources_of
    from tauhat.estimation.estimators import SIMULATING, estimator_named

    sources = sources_of(logs, map_file=options.map_file, rows=options.rows, period=None)
    loop = loop_of(options.controller, robot, sources)
    return [
        replace(candidate, estimator=estimator_named(candidate.estimator.key, loop=loop))
        if candidate.estimator.key in SIMULATING
        else candidate
        for candidate in candidates
    ]


def _view(result: Comparison, options: Options) -> Iterator[RenderableType]:
    from rich.markup import escape

    from tauhat.cli.views.tables import graded, table

    made = table(
        "Error over torque, by model and estimator",
        ("model", "estimator", *(("fitted to",) if options.task else ())),
        ("fit", *(f"unseen {index + 1}" for index in range(len(result.judged))), "parameters", "s"),
    )
    for outcome in result.outcomes:
        unseen = [graded(error) for error in outcome.unseen] or ["failed"] * len(result.judged)
        fit = "" if outcome.failure else graded(outcome.fit)
        names = [escape(outcome.model), outcome.estimator, *([outcome.fitted_to] if options.task else [])]
        made.add_row(*names, fit, *unseen, str(outcome.n_parameters), f"{outcome.seconds:.1f}")
    yield made
    for index, name in enumerate(result.judged):
        yield unbroken(f"unseen {index + 1}: {name}")
    for outcome in result.outcomes:
        if outcome.failure:
            yield unbroken(f"{outcome.name}: {outcome.failure}")
    best = result.best
    if best is not None:
        where = f", fitted to {best.fitted_to}" if options.task else ""
        yield unbroken(f"Least error on unseen recordings: {best.model} with {best.estimator}{where}.")
    if options.output is not None:
        yield unbroken(f"Written: {options.output}")
