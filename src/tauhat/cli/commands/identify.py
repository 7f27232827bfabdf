"""`tauhat identify`: from logs to an estimate file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tauhat.cli.options import (
    TERM_NAMES,
    CutoffOption,
    JsonOption,
    LockOption,
    LogArguments,
    MapOption,
    ModelOption,
    PeriodOption,
    RobotArgument,
    RowsOption,
)
from tauhat.cli.output import show, unbroken
from tauhat.cli.reporting import working

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import RenderableType

    from tauhat.estimation.estimate import Estimate

_SHOWN = ("tauhat_version", "fingerprint", "parameters", "fit", "processing", "inputs")


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What `tauhat identify` takes."""

    robot: RobotArgument
    logs: LogArguments
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="ESTIMATE.json", help="File to write.", show_default=False)
    ]
    map_file: MapOption = None
    model: ModelOption = TERM_NAMES
    estimator: Annotated[str, typer.Option("--estimator", metavar="NAME", help="Estimator: wls or ols.")] = "wls"
    cutoff: CutoffOption = None
    rows: RowsOption = None
    period: PeriodOption = None
    lock: LockOption = None
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Identify a robot's torque model from recordings and write it as an estimate file."""
    from tauhat.cli.inputs import averaged, read_recordings, robot_of_recordings
    from tauhat.dynamics.model import torque_model
    from tauhat.estimation.identify import identify
    from tauhat.estimation.least_squares import estimator_named
    from tauhat.files import check_output

    estimator = estimator_named(options.estimator)
    check_output(
        options.output, inputs=[options.robot, *options.logs, *([options.map_file] if options.map_file else [])]
    )
    with working("reading"):
        measured = read_recordings(options.logs, map_file=options.map_file, rows=options.rows)
        recordings = averaged(measured, period=options.period)
        robot = robot_of_recordings(options.robot, recordings, locked=options.lock)
        model = torque_model(robot, options.model)
    with working("identifying"):
        estimate = identify(model, recordings, estimator=estimator, cutoff=options.cutoff)
    estimate.save(options.output)
    show(_document(estimate, options.output), lambda: _view(estimate, options), as_json=options.as_json)


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
