"""`tauhat record`: a log of a running robot, and its map beside it."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tauhat.cli.current_options import ConstantsOption, currents_of
from tauhat.cli.options import JsonOption, frequency
from tauhat.cli.output import counted, show, unbroken
from tauhat.cli.reporting import working

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tauhat.live.robot_log import RobotLog

_WANTED = ("time", "interrupted")  # ends of a recording that need no warning


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What `tauhat record` takes."""

    robot: Annotated[
        str, typer.Argument(metavar="ur://ADDRESS", help="A Universal Robots controller.", show_default=False)
    ]
    output: Annotated[
        Path,
        typer.Option(
            "-o", "--output", metavar="LOG", help="Log to write: .parquet, .csv or .csv.gz.", show_default=False
        ),
    ]
    seconds: Annotated[
        float, typer.Option("--seconds", min=0.1, max=3600.0, help="Length of the recording (s); Ctrl-C ends it early.")
    ] = 30.0
    map_file: Annotated[
        Path | None,
        typer.Option(
            "--map", metavar="MAP.toml", show_default=False, readable=False,
            help="A map of the robot's logs, for torque constants, signs and joint names.",
        ),
    ] = None  # fmt: skip
    constants: ConstantsOption = None
    rate: Annotated[
        float | None,
        typer.Option(
            "--rate", metavar="HZ", parser=frequency, help="Samples per second.", show_default="all the controller has"
        ),
    ] = None
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Record a running robot: positions, currents and temperatures as its controller tells them, and their map."""
    from tauhat.errors import TauhatWarning
    from tauhat.live.robot_log import record
    from tauhat.live.universal_robots import SCHEME, UniversalRobot

    if not options.robot.startswith(SCHEME):
        raise typer.BadParameter(f"not a robot that can be recorded: {options.robot}", param_hint="'ur://ADDRESS'")
    currents = currents_of(options.map_file, options.constants)
    robot = UniversalRobot(address=options.robot, currents=currents, rate=options.rate)
    with working(f"recording {options.seconds:g} s of {options.robot}"):
        inputs = [options.map_file] if options.map_file else []
        written = record(robot, options.seconds, options.output, inputs=inputs)
    if written.end not in _WANTED:
        warnings.warn(f"the recording ended early: {written.end}", TauhatWarning, stacklevel=1)
    show(_document(written, options.robot), lambda: _view(written), as_json=options.as_json)


def _document(written: RobotLog, robot: str) -> dict[str, Any]:
    return {"robot": robot, **written.to_dict()}


def _view(written: RobotLog) -> Iterator[RenderableType]:
    counts = written.counts
    skipped = {
        "lost": counts.lost, "while the robot was stopped": counts.stopped, "not finite": counts.not_finite,
        "late": written.late,
    }  # fmt: skip
    again = f"; disconnected {counts.disconnects} times" if counts.disconnects else ""
    yield f"{written.n_t} samples, {written.seconds:.1f} s at {written.rate:g} Hz; left out: {counted(skipped)}{again}"
    yield unbroken(f"Written: {written.log}")
    yield unbroken(f"Their map: {written.map}")
    yield unbroken(f"Next: tauhat check {written.log}")
    yield unbroken(f"Then: tauhat identify ROBOT {written.log} -o estimate.json")
