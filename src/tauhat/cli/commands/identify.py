"""`tauhat identify`: from logs to an estimate file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tauhat.cli.options import (
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
    from tauhat.estimation.estimate import Estimate
    from tauhat.estimation.physical_constraints import PhysicalConstraints
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
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Identify a robot's torque model from recordings and write it as an estimate file."""
    from tauhat.cli.inputs import averaged, read_recordings, robot_of_recordings
    from tauhat.cli.models import model_of
    from tauhat.estimation.estimators import estimator_named
    from tauhat.files import check_output

    estimator_named(options.estimator)
    check_output(
        options.output, inputs=[options.robot, *options.logs, *([options.map_file] if options.map_file else [])]
    )
    with working("reading"):
        measured = read_recordings(options.logs, map_file=options.map_file, rows=options.rows)
        recordings = averaged(measured, period=options.period)
        robot = robot_of_recordings(options.robot, recordings, locked=options.lock)
        model = model_of(robot, options.model, recordings)
    with working("identifying"):
        estimate = _identified(model, recordings, options)
    estimate.save(options.output)
    show(_document(estimate, options.output), lambda: _view(estimate, options), as_json=options.as_json)


def _identified(model: TorqueModel, recordings: Sequence[Recording], options: Options) -> Estimate:
    """Return the estimate, of the model that cross-validation chose where that was asked for."""
    from tauhat.cli.models import AUTO
    from tauhat.estimation.essential import EssentialLeastSquares
    from tauhat.estimation.estimators import estimator_named
    from tauhat.estimation.identify import identify
    from tauhat.estimation.selecting import identify_selected

    named = estimator_named(options.estimator)
    estimator = EssentialLeastSquares(inner=named) if options.essential else named
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
    through = f" --map {options.map_file}" if options.map_file else ""
    yield unbroken(
        f"Written: {options.output}\n"
        f"Next, on a recording of another motion: tauhat verify {options.output} OTHER_LOG{through}"
    )
