"""What every command that senses takes: of the sensor, and of contacts."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer

from tauhat.cli.options import EstimateArgument, MapOption, frequency
from tauhat.cli.zero_choice import ZeroChoice, zero_choice

_SENSOR, _CONTACTS = "Sensor", "Contacts"  # panels of the help text


@dataclass(frozen=True, slots=True, kw_only=True)
class SensingOptions:
    """What a command takes that senses."""

    estimate: EstimateArgument
    observer: Annotated[
        str, typer.Option("--observer", metavar="NAME", rich_help_panel=_SENSOR, help="How torque is observed.")
    ] = "momentum"
    gain: Annotated[
        float | None,
        typer.Option(
            "--gain", metavar="K", parser=frequency, show_default="20", rich_help_panel=_SENSOR,
            help="Of the observer [1/s]: half of a push comes through after 0.7 / K, beside the filter.",
        ),
    ] = None  # fmt: skip
    cutoff: Annotated[
        float | None,
        typer.Option(
            "--cutoff", metavar="HZ", parser=frequency, show_default="10, or what the rate allows",
            rich_help_panel=_SENSOR, help="Of the filter that position and torque share.",
        ),
    ] = None  # fmt: skip
    frame: Annotated[
        str | None,
        typer.Option(
            "--frame", metavar="NAME", show_default="the robot's last", rich_help_panel=_SENSOR,
            help="Where the wrench acts.",
        ),
    ] = None  # fmt: skip
    directions: Annotated[
        str,
        typer.Option(
            "--directions", metavar="NAME", rich_help_panel=_SENSOR,
            help="What may act there: wrench, force, fx, fy or fz.",
        ),
    ] = "wrench"  # fmt: skip
    axes: Annotated[
        Literal["base", "frame"],
        typer.Option("--axes", rich_help_panel=_SENSOR, help="Whose axes wrench and directions are along."),
    ] = "base"
    tool: Annotated[
        Path | None,
        typer.Option(
            "--tool", metavar="TOOL.json", show_default=False, readable=False, rich_help_panel=_SENSOR,
            help="What the arm carries and the estimate does not know: what `tauhat payload --json` prints.",
        ),
    ] = None  # fmt: skip
    stamps: Annotated[
        Literal["auto", "exact", "jittered"],
        typer.Option(
            "--stamps", rich_help_panel=_SENSOR,
            help="Samples were taken at their time stamps, or evenly with stamps that jitter; auto: as positions tell.",
        ),
    ] = "auto"  # fmt: skip
    free: Annotated[
        list[Path] | None,
        typer.Option(
            "--free", metavar="LOG", show_default=False, readable=False, rich_help_panel=_CONTACTS,
            help="A recording without contact, to learn from how large errors are and when something touches the arm; "
            "may be repeated.",
        ),
    ] = None  # fmt: skip
    thresholds: Annotated[
        Path | None,
        typer.Option(
            "--thresholds", metavar="FILE.json", show_default=False, rich_help_panel=_CONTACTS,
            help="What --free has taught, error bars and thresholds of contact, to read; with --free, to write.",
        ),
    ] = None  # fmt: skip
    alarms: Annotated[
        float | None,
        typer.Option(
            "--alarms", metavar="RATE", parser=frequency, show_default="1", rich_help_panel=_CONTACTS,
            help="False contacts an hour allowed, with --free.",
        ),
    ] = None  # fmt: skip
    zero: Annotated[
        ZeroChoice | None,
        typer.Option(
            "--zero", metavar="ZERO", parser=zero_choice, rich_help_panel=_CONTACTS,
            show_default="off what contacts are told by alone",
            help="What is taken off: standing[:SECONDS[:FOLLOW]], what friction holds as the arm comes to rest; "
            "air:LOG, the same motion without contact, along logs alone; none.",
        ),
    ] = None  # fmt: skip
    map_file: MapOption = None

    @property
    def inputs(self) -> tuple[Path, ...]:
        """Files that are read, beside those of `--free` and `--thresholds`."""
        passed = None if self.zero is None else self.zero.log
        return (self.estimate, *filter(None, [self.map_file, self.tool, passed]))
