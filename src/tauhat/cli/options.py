"""Arguments and options that several commands share, each with one name and one help text."""

from __future__ import annotations

import math
from collections import UserDict
from pathlib import Path
from typing import Annotated, NamedTuple, TypeAlias

import typer

from tauhat.errors import TauhatError

TERM_NAMES = "plain"


class Window(NamedTuple):
    """Rows of a log: zero-based, end excluded, None for the end of the file."""

    start: int
    stop: int | None


class Locks(UserDict[str, float]):
    """Joint name -> position at which to freeze it [rad or m]."""


def window(text: str) -> Window:
    """Return the rows that FROM:TO names."""
    from tauhat.recordings.logmap import parse_rows

    try:
        return Window(*parse_rows(text))
    except TauhatError as error:
        raise typer.BadParameter(str(error)) from error


def page(text: str) -> Path:
    """Return the path of a page to be written: whatever its name says, it is HTML."""
    if Path(text).suffix.lower() not in {".html", ".htm"}:
        raise typer.BadParameter(f"a page is HTML, its name ends in .html: {text}")
    return Path(text)


def locks(text: str) -> Locks:
    """Return the joints that NAME[=VALUE],... names; without a value a joint is frozen at zero."""
    positions = Locks()
    for item in text.split(","):
        name, equals, value = (part.strip() for part in item.partition("="))
        if not name:
            raise typer.BadParameter(f"no joint name in {item!r}; expected NAME or NAME=VALUE")
        try:
            positions[name] = float(value) if equals else 0.0
        except ValueError as error:
            raise typer.BadParameter(f"position of {name} is not a number: {value!r}") from error
    return positions


def frequency(text: str) -> float:
    """Return a positive frequency [Hz]."""
    try:
        value = float(text)
    except ValueError as error:
        raise typer.BadParameter(f"not a number: {text!r}") from error
    if not 0.0 < value < math.inf:
        raise typer.BadParameter(f"not a positive frequency: {text}")
    return value


RobotArgument: TypeAlias = Annotated[
    str,
    typer.Argument(
        metavar="ROBOT", help="Built-in name (see `tauhat robots`), .urdf file or .toml DH table.", show_default=False
    ),
]
RobotOrExperimentArgument: TypeAlias = Annotated[
    str,
    typer.Argument(
        metavar="ROBOT",
        help="Built-in name (see `tauhat robots`), .urdf file, .toml DH table, or EXPERIMENT.toml.",
        show_default=False,
    ),
]
EstimateArgument: TypeAlias = Annotated[
    Path,
    typer.Argument(
        metavar="ESTIMATE", help="Estimate file written by `tauhat identify`.", show_default=False, readable=False
    ),
]
LogArguments: TypeAlias = Annotated[
    list[Path],
    typer.Argument(
        metavar="LOG",
        help="Recordings: CSV (also .gz), Parquet, NPZ or MAT.",
        show_default=False,
        readable=False,
    ),
]
MapOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--map",
        metavar="MAP.toml",
        help="What the columns mean; by default the map beside each log.",
        show_default=False,
        readable=False,
    ),
]
RowsOption: TypeAlias = Annotated[
    Window | None,
    typer.Option(
        "--rows",
        metavar="FROM:TO",
        parser=window,
        help="Window of rows of each log, zero-based, end excluded.",
        show_default=False,
    ),
]
CutoffOption: TypeAlias = Annotated[
    float | None,
    typer.Option(
        "--cutoff",
        metavar="HZ",
        parser=frequency,
        help="Low-pass of torque and model.",
        show_default="chosen from the data",
    ),
]
ModelOption: TypeAlias = Annotated[
    str, typer.Option("--model", metavar="TERMS", help="plain, robust, or terms with commas between.")
]
FittedModelOption: TypeAlias = Annotated[
    str,
    typer.Option(
        "--model",
        metavar="TERMS",
        help="robust, plain, auto (terms by cross-validation), terms with commas between, or a TOML file.",
    ),
]
LockOption: TypeAlias = Annotated[
    Locks | None,
    typer.Option(
        "--lock",
        metavar="NAME[=VALUE],...",
        parser=locks,
        help="Freeze joints of the robot, e.g. a gripper's, at VALUE or 0 (rad or m).",
        show_default=False,
    ),
]
PeriodOption: TypeAlias = Annotated[
    float | None,
    typer.Option(
        "--period",
        metavar="SECONDS",
        min=0.0,
        help="Length of a repeated motion: its periods are averaged, the first is left out.",
        show_default="not averaged",
    ),
]
MotionOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--motion",
        metavar="MOTION",
        help="Motion file written by `tauhat excite`: .parquet, .csv or .csv.gz.",
        show_default=False,
        readable=False,
    ),
]
ControllerOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--controller",
        metavar="CONTROLLER.toml",
        help="Law, gains and reference of the recorded robot, for estimators that simulate it.",
        show_default=False,
        readable=False,
    ),
]
ClusterOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--cluster",
        metavar="ADDRESS",
        help="Dask scheduler whose workers do the work, such as tcp://10.0.0.5:8786.",
        show_default="this machine",
    ),
]
WorkersOption: TypeAlias = Annotated[
    int | None, typer.Option("--workers", metavar="N", min=1, help="Processes.", show_default="one a core")
]
StudyPageOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "-o",
        "--output",
        metavar="PAGE.html",
        parser=page,
        help="Page with all text and drawings.",
        show_default=False,
    ),
]
ExperimentSeedOption: TypeAlias = Annotated[
    int | None,
    typer.Option("--seed", min=0, help="Seed of everything random.", show_default="0 or the experiment's"),
]
SeedOption: TypeAlias = Annotated[int, typer.Option("--seed", min=0, help="Seed of everything random.")]
JsonOption: TypeAlias = Annotated[
    bool, typer.Option("--json", help="Print one JSON document on standard output and nothing else.")
]
