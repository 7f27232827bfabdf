"""`tauhat verify`: how well an estimate predicts recordings it was not fitted to."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from tauhat.cli.options import CutoffOption, EstimateArgument, JsonOption, LogArguments, MapOption, RowsOption
from tauhat.cli.output import show
from tauhat.cli.pairs import LinkOption
from tauhat.cli.reporting import working

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tauhat.estimation.estimate import Estimate
    from tauhat.recordings.processing import Processing
    from tauhat.recordings.recording import Recording
    from tauhat.verification.known_payload import PayloadCheck


class Weighed(NamedTuple):
    """What is known of a payload: mass [kg] and centre of mass in the frame of its link [m]."""

    mass: float
    centre: tuple[float, ...] | None


def weighed(text: str) -> Weighed:
    """Return the payload that MASS[:X,Y,Z] names."""
    mass, colon, centre = text.partition(":")
    try:
        place = tuple(float(part) for part in centre.split(",")) if colon else None
        known = Weighed(float(mass), place)
    except ValueError as error:
        raise typer.BadParameter(f"not MASS or MASS:X,Y,Z: {text!r}") from error
    if known.centre is not None and len(known.centre) != 3:
        raise typer.BadParameter(f"a centre of mass has three numbers: {text!r}")
    return known


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What `tauhat verify` takes."""

    estimate: EstimateArgument
    logs: LogArguments
    map_file: MapOption = None
    cutoff: CutoffOption = None
    rows: RowsOption = None
    warm_start: Annotated[
        float | None,
        typer.Option(
            "--warm-start", metavar="SECONDS", show_default=False,
            help="Tell from the first seconds of the log how warm the joints are, and judge the rest (term thermal).",
        ),
    ] = None  # fmt: skip
    residuals: Annotated[
        bool, typer.Option("--residuals", help="Search the residuals for effects that the model does not have.")
    ] = False
    gear: Annotated[
        list[str] | None,
        typer.Option(
            "--gear", metavar="JOINT=RATIO", help="Gear ratio, for ripple of the motor; may be given several times."
        ),
    ] = None
    static: Annotated[
        bool, typer.Option("--static", help="Compare gravity and friction in poses reached from both sides.")
    ] = False
    known_payload: Annotated[
        Weighed | None,
        typer.Option(
            "--known-payload", metavar="MASS[:X,Y,Z]", parser=weighed, show_default=False,
            help="Payload that was weighed [kg], with its centre of mass in its link's frame [m].",
        ),
    ] = None  # fmt: skip
    payload_logs: Annotated[
        list[Path] | None,
        typer.Option(
            "--payload-log", metavar="LOG", readable=False, show_default=False,
            help="A recording with that payload, through the same map; may be given several times.",
        ),
    ] = None  # fmt: skip
    link: LinkOption = ""
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Predict the torque of recordings and tell how far it is from the measured one, joint by joint."""
    from tauhat.cli.inputs import processing_of, recordings_of_estimate
    from tauhat.cli.views.verification import verification_view
    from tauhat.estimation.estimate import load_estimate
    from tauhat.verification.prediction import verify

    if (options.known_payload is None) is not (not options.payload_logs):
        raise typer.BadParameter("--known-payload and --payload-log belong together")
    estimate = load_estimate(options.estimate)
    processing = processing_of(estimate, cutoff=options.cutoff)
    with working("predicting"):
        recordings = recordings_of_estimate(estimate, options.logs, map_file=options.map_file, rows=options.rows)
        if options.warm_start is not None:
            estimate, recordings = _warm_started(estimate, recordings, options.warm_start)
        verification = verify(estimate, recordings, processing=processing)
    parts = [_Part(verification.to_dict(), verification_view(verification))]
    parts += _further(estimate, recordings, processing, options)
    document = {key: value for part in parts for key, value in part.document.items()}
    show(document, lambda: (line for part in parts for line in part.lines), as_json=options.as_json)


def _warm_started(
    estimate: Estimate, recordings: tuple[Recording, ...], seconds: float
) -> tuple[Estimate, tuple[Recording, ...]]:
    """Return the estimate as warm as the robot is behind the first seconds of a log, and the rest of the log."""
    from tauhat.estimation.warm_start import warm_start

    if len(recordings) != 1:
        raise typer.BadParameter("--warm-start takes one log at a time: each begins at another warmth")
    found = warm_start(estimate, recordings[0], seconds=seconds)
    if found.rest is None:
        raise typer.BadParameter(f"nothing of the log is left behind its first {seconds:g} s")
    return found.later, (found.rest,)


class _Part(NamedTuple):
    """One further check: what it adds to the document, and how it is shown."""

    document: dict[str, Any]
    lines: Iterator[RenderableType]


def _further(
    estimate: Estimate, recordings: tuple[Recording, ...], processing: Processing, options: Options
) -> Iterator[_Part]:
    from tauhat.cli.views.residuals import payload_check_view, residuals_view, static_view

    if options.residuals:
        from tauhat.verification.residual_tests import residual_tests

        with working("searching the residuals"):
            found = residual_tests(estimate, recordings, processing=processing, gear_ratios=_ratios(options.gear or ()))
        yield _Part({"residuals": [log.to_dict() for log in found]}, residuals_view(found))
    if options.static:
        from tauhat.verification.static import static_check

        with working("looking for held poses"):
            check = static_check(estimate, recordings)
        yield _Part({"static": check.to_dict()}, static_view(check))
    if options.known_payload is not None:
        with working("weighing"):
            known = _payload_check(estimate, processing, options.known_payload, options)
        yield _Part({"known_payload": known.to_dict()}, payload_check_view(known))


def _payload_check(estimate: Estimate, processing: Processing, known: Weighed, options: Options) -> PayloadCheck:
    import numpy as np

    from tauhat.cli.inputs import recordings_of_estimate
    from tauhat.verification.known_payload import check_payload

    loaded = recordings_of_estimate(estimate, options.payload_logs or (), map_file=options.map_file, rows=None)
    centre = None if known.centre is None else np.array(known.centre)
    return check_payload(
        estimate, loaded, mass=known.mass, centre=centre, link=options.link, processing=processing
    )  # fmt: skip


def _ratios(texts: list[str] | tuple[str, ...]) -> dict[str, float]:
    """Return the ratios that JOINT=RATIO names."""
    ratios = {}
    for text in texts:
        name, _, number = text.rpartition("=")
        try:
            ratios[name] = float(number)
        except ValueError as error:
            raise typer.BadParameter(f"not JOINT=RATIO: {text!r}") from error
    return ratios
