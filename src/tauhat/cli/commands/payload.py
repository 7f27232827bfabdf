"""`tauhat payload`: what an identified arm carries, from a run with it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tauhat.cli.options import CutoffOption, EstimateArgument, JsonOption, MapOption, RowsOption
from tauhat.cli.output import show, unbroken
from tauhat.cli.pairs import LinkOption, LoadedArguments, UnloadedOption, UnloadedRowsOption
from tauhat.cli.reporting import working

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import RenderableType

    from tauhat.estimation.payload import Payload


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What `tauhat payload` takes."""

    estimate: EstimateArgument
    loaded: LoadedArguments
    unloaded: UnloadedOption = None
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="LOADED.json", help="Estimate of arm and payload.", show_default=False),
    ] = None
    mass: Annotated[
        float | None, typer.Option("--mass", metavar="KG", help="Mass of the payload, where it was weighed.")
    ] = None
    limit: Annotated[
        float | None, typer.Option("--limit", metavar="KG", help="Heaviest payload of the arm; heavier is refused.")
    ] = None
    link: LinkOption = ""
    map_file: MapOption = None
    rows: RowsOption = None
    unloaded_rows: UnloadedRowsOption = None
    cutoff: CutoffOption = None
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Find mass, centre of mass and inertia of what the arm of an estimate carries, from recordings with it."""
    from tauhat.cli.inputs import processing_of, recordings_of_estimate
    from tauhat.cli.pairs import unloaded_recordings
    from tauhat.estimation.estimate import load_estimate
    from tauhat.estimation.payload import KnownPayload, identify_payload
    from tauhat.files import check_output

    limit = float("inf") if options.limit is None else options.limit
    known = KnownPayload(link=options.link, mass=options.mass, limit=limit)
    estimate = load_estimate(options.estimate)
    if options.output is not None:
        inputs = [options.estimate, *options.loaded, *(options.unloaded or ()), *filter(None, [options.map_file])]
        check_output(options.output, inputs=inputs)
    with working("reading"):
        loaded = recordings_of_estimate(estimate, options.loaded, map_file=options.map_file, rows=options.rows)
        unloaded = unloaded_recordings(
            estimate, options.unloaded, map_file=options.map_file, rows=options.unloaded_rows
        )
    with working("weighing"):
        payload = identify_payload(
            estimate, loaded, unloaded=unloaded, known=known, processing=processing_of(estimate, cutoff=options.cutoff)
        )
    if options.output is not None:
        payload.loaded.save(options.output)
    document = {"estimate": str(options.output) if options.output else None, **payload.to_dict()}
    show(document, lambda: _view(payload, options), as_json=options.as_json)


def _view(payload: Payload, options: Options) -> Iterator[RenderableType]:
    from tauhat.cli.views.payload import payload_view

    yield from payload_view(payload)
    if options.output is not None:
        through = f" --map {options.map_file}" if options.map_file else ""
        yield unbroken(
            f"Written: {options.output}\n"
            f"Next, on another recording with the payload: tauhat verify {options.output} OTHER_LOG{through}"
        )
