"""`tauhat identify`: from logs to an estimate file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tauhat.cli.options import (
    ClusterOption,
    ControllerOption,
    CutoffOption,
    FittedModelOption,
    JsonOption,
    LockOption,
    LogArguments,
    MapOption,
    PeriodOption,
    RobotArgument,
    RowsOption,
)
from tauhat.cli.output import show, unbroken
from tauhat.cli.reporting import working

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from rich.console import RenderableType

    from tauhat.dynamics.model import TorqueModel
    from tauhat.estimation.closed_loop import ClosedLoop
    from tauhat.estimation.estimate import Estimate
    from tauhat.estimation.least_squares import Estimator
    from tauhat.estimation.physical_constraints import PhysicalConstraints
    from tauhat.recordings.log_source import LogSource
    from tauhat.recordings.recording import Recording

_SHOWN = ("tauhat_version", "fingerprint", "parameters", "fit", "structure", "physical", "processing", "inputs")


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What `tauhat identify` takes."""

    robot: RobotArgument
    logs: LogArguments
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="ESTIMATE.json", help="File to write.", show_default=False)
    ]
    map_file: MapOption = None
    model: FittedModelOption = "robust"
    estimator: Annotated[
        str, typer.Option("--estimator", metavar="NAME", help="Method of the fit; an unknown name lists all.")
    ] = "wls"
    controller: ControllerOption = None
    physical: Annotated[
        bool,
        typer.Option("--physical", help="Keep every link a possible body, friction positive; gives all parameters."),
    ] = False
    constraints: Annotated[
        Path | None,
        typer.Option(
            "--constraints",
            metavar="CONSTRAINTS.toml",
            help="The same with bounds on masses, centres and bodies of links.",
            show_default=False,
        ),
    ] = None
    essential: Annotated[
        bool, typer.Option("--essential", help="Drop the parameters that the recordings cannot see.")
    ] = False
    cutoff: CutoffOption = None
    rows: RowsOption = None
    period: PeriodOption = None
    lock: LockOption = None
    cluster: ClusterOption = None
    workers: Annotated[
        int | None,
        typer.Option(
            "--workers",
            metavar="N",
            min=1,
            help="Processes that read many logs, each its own; memory does not grow with their number.",
            show_default="logs are read into memory",
        ),
    ] = None
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Identify a robot's torque model from recordings and write it as an estimate file."""
    from tauhat.estimation.estimators import check_simulating, estimator_named
    from tauhat.files import check_output

    estimator_named(options.estimator)
    if options.controller is not None:
        check_simulating([options.estimator])
    given = [file for file in (options.map_file, options.controller) if file is not None]
    check_output(options.output, inputs=[options.robot, *options.logs, *given])
    away = options.cluster is not None or options.workers is not None
    estimate = _identified_by_workers(options) if away else _identified_here(options)
    estimate.save(options.output)
    show(_document(estimate, options.output), lambda: _view(estimate, options), as_json=options.as_json)


def _identified_here(options: Options) -> Estimate:
    """Return the estimate of logs that are read into memory."""
    from tauhat.cli.inputs import averaged, loop_of, read_recordings, robot_of_recordings
    from tauhat.cli.models import model_of

    with working("reading"):
        measured = read_recordings(options.logs, map_file=options.map_file, rows=options.rows)
        recordings = averaged(measured, period=options.period)
        robot = robot_of_recordings(options.robot, recordings, locked=options.lock)
        model = model_of(robot, options.model, recordings)
        estimator = _estimator(options, loop_of(options.controller, robot, _sources(options)))
    with working("identifying"):
        return _identified(model, recordings, estimator, options)


def _identified_by_workers(options: Options) -> Estimate:
    """Return the estimate of logs that workers read."""
    from tauhat.cli.inputs import robot_of_recordings
    from tauhat.cli.models import AUTO, model_of
    from tauhat.cluster import workers_of
    from tauhat.errors import ModelError
    from tauhat.estimation.log_survey import survey_logs
    from tauhat.estimation.many_logs import check_evidence_alone, identify_files

    estimator = _estimator(options)
    check_evidence_alone(estimator)
    if options.model.strip() == AUTO:
        raise ModelError(
            "the choice of terms reads all logs itself", got="--model auto", remedy="leave out --cluster and --workers"
        )
    workers = workers_of(options.cluster, options.workers)
    with working("reading"):
        logs = survey_logs(_sources(options), workers=workers)
        robot = robot_of_recordings(options.robot, logs.facts, locked=options.lock)
        model = model_of(robot, options.model, logs.facts)
    with working("identifying"):
        return identify_files(
            model, logs, estimator=estimator, cutoff=options.cutoff, constraints=_constraints(options)
        )


def _sources(options: Options) -> tuple[LogSource, ...]:
    from tauhat.cli.inputs import sources_of

    return sources_of(options.logs, map_file=options.map_file, rows=options.rows, period=options.period)


def _estimator(options: Options, loop: ClosedLoop | None = None) -> Estimator:
    from tauhat.estimation.essential import EssentialLeastSquares
    from tauhat.estimation.estimators import estimator_named

    named = estimator_named(options.estimator, loop=loop)
    return EssentialLeastSquares(inner=named) if options.essential else named


def _identified(
    model: TorqueModel, recordings: Sequence[Recording], estimator: Estimator, options: Options
) -> Estimate:
    """Return the estimate, of the model that cross-validation chose where that was asked for."""
    from tauhat.cli.models import AUTO
    from tauhat.estimation.identify import identify
    from tauhat.estimation.selecting import identify_selected

    way = identify_selected if options.model.strip() == AUTO else identify
    return way(model, recordings, estimator=estimator, cutoff=options.cutoff, constraints=_constraints(options))


def _constraints(options: Options) -> PhysicalConstraints | None:
    from tauhat.estimation.constraints_file import load_constraints
    from tauhat.estimation.physical_constraints import PhysicalConstraints

    if options.constraints is not None:
        return load_constraints(options.constraints)
    return PhysicalConstraints() if options.physical else None


def _document(estimate: Estimate, path: Path) -> dict[str, Any]:
    data = estimate.to_dict()
    return {"estimate": str(path), "robot": estimate.robot.name, **{key: data[key] for key in _SHOWN}}


def _view(estimate: Estimate, options: Options) -> Iterator[RenderableType]:
    from tauhat.cli.views.estimate import estimate_view

    yield from estimate_view(estimate)
    if options.controller is not None:
        yield unbroken(f"Simulated with the controller of {options.controller}.")
    through = f" --map {options.map_file}" if options.map_file else ""
    yield unbroken(
        f"Written: {options.output}\n"
        f"Next, on a recording of another motion: tauhat verify {options.output} OTHER_LOG{through}"
    )
