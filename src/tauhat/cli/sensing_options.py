"""Options of a force sensor, each with one name and one help text."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, TypeAlias

import typer

from tauhat.cli.options import frequency

ObserverOption: TypeAlias = Annotated[str, typer.Option("--observer", metavar="NAME", help="How torque is observed.")]
GainOption: TypeAlias = Annotated[
    float | None,
    typer.Option(
        "--gain", metavar="K", parser=frequency, show_default="20",
        help="Of the observer [1/s]: half of a push comes through after 0.7 / K, beside the filter.",
    ),
]  # fmt: skip
CutoffOption: TypeAlias = Annotated[
    float | None,
    typer.Option(
        "--cutoff", metavar="HZ", parser=frequency, show_default="10, or what the rate allows",
        help="Of the filter that position and torque share.",
    ),
]  # fmt: skip
FrameOption: TypeAlias = Annotated[
    str | None,
    typer.Option("--frame", metavar="NAME", help="Where the wrench acts.", show_default="the robot's last"),
]
DirectionsOption: TypeAlias = Annotated[
    str, typer.Option("--directions", metavar="NAME", help="What may act there: wrench, force, fx, fy or fz.")
]
AxesOption: TypeAlias = Annotated[
    Literal["base", "frame"], typer.Option("--axes", help="Whose axes wrench and directions are along.")
]
ToolOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--tool", metavar="TOOL.json", show_default=False, readable=False,
        help="What the arm carries and the estimate does not know: what `tauhat payload --json` prints.",
    ),
]  # fmt: skip
StampsOption: TypeAlias = Annotated[
    Literal["auto", "exact", "jittered"],
    typer.Option(
        "--stamps",
        help="Samples were taken at their time stamps, or evenly with stamps that jitter; auto: as positions tell.",
    ),
]
FreeOption: TypeAlias = Annotated[
    list[Path] | None,
    typer.Option(
        "--free", metavar="LOG", show_default=False, readable=False,
        help="A recording without contact, to learn from how large errors are and when something touches the arm; "
        "may be repeated.",
    ),
]  # fmt: skip
ThresholdsOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--thresholds", metavar="FILE.json", show_default=False,
        help="What --free has taught, error bars and thresholds of contact, to read; with --free, to write.",
    ),
]  # fmt: skip
AlarmsOption: TypeAlias = Annotated[
    float | None,
    typer.Option(
        "--alarms", metavar="RATE", parser=frequency, show_default="1",
        help="False contacts an hour allowed, with --free.",
    ),
]  # fmt: skip
