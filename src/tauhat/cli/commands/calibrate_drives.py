"""`tauhat calibrate-drives`: torque constants from a run with and a run without a payload of known mass."""

from __future__ import annotations

import math
from collections import UserList
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tauhat.cli.options import CutoffOption, EstimateArgument, JsonOption, MapOption, RowsOption
from tauhat.cli.output import show, unbroken
from tauhat.cli.pairs import LinkOption, LoadedArguments, UnloadedRowsOption
from tauhat.cli.reporting import working

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import RenderableType

    from tauhat.estimation.drives import DriveCalibration


class Point(UserList[float]):
    """Three coordinates [m]."""


def point(text: str) -> Point:
    """Return the three numbers of X,Y,Z."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError as error:
        raise typer.BadParameter(f"not numbers: {text!r}") from error
    if len(numbers) != 3 or not all(math.isfinite(number) for number in numbers):
        raise typer.BadParameter(f"expected X,Y,Z in metres, got {text!r}")
    return Point(numbers)


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What `tauhat calibrate-drives` takes."""

    estimate: EstimateArgument
    loaded: LoadedArguments
    unloaded: Annotated[
        list[Path],
        typer.Option(
            "--unloaded", metavar="LOG", help="A recording without the payload; may be given several times.",
            show_default=False, readable=False,
        ),
    ]  # fmt: skip
    mass: Annotated[float, typer.Option("--mass", metavar="KG", help="Mass of the payload.", show_default=False)]
    centre: Annotated[
        Point | None,
        typer.Option(
            "--centre", metavar="X,Y,Z", parser=point, help="Its centre of mass in the link's frame [m].",
            show_default="not known",
        ),
    ] = None  # fmt: skip
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="MAP.toml", help="Copy of the map with new gains.", show_default=False),
    ] = None
    link: LinkOption = ""
    map_file: MapOption = None
    rows: RowsOption = None
    unloaded_rows: UnloadedRowsOption = None
    cutoff: CutoffOption = None
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Find the factor by which the measured torque of each joint is wrong, from a payload that was weighed."""
    import numpy as np

    from tauhat.cli.inputs import processing_of, recordings_of_estimate
    from tauhat.cli.pairs import unloaded_recordings
    from tauhat.estimation.drives import WeighedPayload, calibrate_drives
    from tauhat.estimation.estimate import load_estimate
    from tauhat.files import check_output, write_text

    centre = None if options.centre is None else np.array(options.centre)
    payload = WeighedPayload(mass=options.mass, centre=centre, link=options.link)
    estimate = load_estimate(options.estimate)
    maps = _maps(options)
    if options.output is not None:
        check_output(options.output, inputs=[options.estimate, *options.loaded, *options.unloaded, *maps])
    with working("reading"):
        loaded = recordings_of_estimate(estimate, options.loaded, map_file=options.map_file, rows=options.rows)
        unloaded = unloaded_recordings(
            estimate, options.unloaded, map_file=options.map_file, rows=options.unloaded_rows
        )
    with working("calibrating"):
        calibration = calibrate_drives(
            estimate,
            loaded,
            unloaded=unloaded,
            payload=payload,
            processing=processing_of(estimate, cutoff=options.cutoff),
        )
    text, gains = _corrected(maps, calibration, options)
    if options.output is not None:
        write_text(options.output, text)
    document = {
        "map": str(options.output) if options.output else None, **calibration.to_dict(), "gains": list(gains),
    }  # fmt: skip
    show(document, lambda: _view(calibration, gains, options), as_json=options.as_json)


def _maps(options: Options) -> list[Path]:
    """Return the map of the logs, alone or nothing.

    Raises
    ------
    MapError
        when a map is to be written and the logs have none, or not one and the same.
    """
    from tauhat.errors import MapError
    from tauhat.recordings.mapfile import find_map

    if options.map_file is not None:
        return [options.map_file]
    found = {find_map(log) for log in (*options.loaded, *options.unloaded)}
    if options.output is not None and (len(found) > 1 or None in found):
        raise MapError("the logs do not share a map whose gains could be corrected", remedy="name it with --map")
    return [path for path in found if path is not None] if len(found) == 1 else []


def _corrected(maps: Sequence[Path], calibration: DriveCalibration, options: Options) -> tuple[str, tuple[float, ...]]:
    """Return the map's text with new gains, and these; nothing where none is asked for and a joint has no gain."""
    from tauhat.errors import MapError
    from tauhat.files import read_text
    from tauhat.recordings.gains import corrected_gains, with_gains
    from tauhat.recordings.mapfile import parse_map

    if not maps:
        return "", ()
    text, where = read_text(maps[0], error=MapError), str(maps[0])
    try:
        gains = corrected_gains(parse_map(text, where=where), calibration.factors.tolist())
        return with_gains(text, gains, where=where), gains
    except MapError:
        if options.output is not None:
            raise
        return "", ()


def _view(calibration: DriveCalibration, gains: Sequence[float], options: Options) -> Iterator[RenderableType]:
    from tauhat.cli.views.payload import drives_view

    yield from drives_view(calibration, gains)
    if options.output is not None:
        yield unbroken(f"Written: {options.output}\nNext: identify again with --map {options.output}")
