"""`tauhat sense`: what touches the robot, from position and motor torque, with error bars."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tauhat.cli.options import JsonOption, RowsOption, frequency, page
from tauhat.cli.output import show, unbroken
from tauhat.cli.reporting import working
from tauhat.cli.sensing_options import SensingOptions
from tauhat.cli.zero_choice import ZeroChoice, check_without_air

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tauhat.cli.contact_choice import Prepared
    from tauhat.recordings.log import Log
    from tauhat.sensing.judged_log import JudgedLog
    from tauhat.sensing.sensor import ForceSensor

_STANDARD_INPUT = "-"


@dataclass(frozen=True, slots=True, kw_only=True)
class Options(SensingOptions):
    """What `tauhat sense` takes."""

    logs: Annotated[
        list[Path] | None,
        typer.Argument(metavar="LOG", help="Recordings to sense along.", show_default=False, readable=False),
    ] = None
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="OUT.parquet", show_default=False,
            help="External torque and wrench, sample by sample: .parquet, .csv or .csv.gz.",
        ),
    ] = None  # fmt: skip
    rows: RowsOption = None
    report: Annotated[
        Path | None,
        typer.Option("--report", metavar="PAGE.html", parser=page, help="Page to write.", show_default=False),
    ] = None
    stream: Annotated[
        str | None,
        typer.Option(
            "--input", metavar="-", show_default=False,
            help="Read samples from standard input instead, answer each on standard output.",
        ),
    ] = None  # fmt: skip
    rate: Annotated[
        float | None,
        typer.Option(
            "--rate", metavar="HZ", parser=frequency, show_default="that of each log",
            help="Of the samples; needed with --input.",
        ),
    ] = None  # fmt: skip
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Sense external torque and wrench with error bars, along logs or on samples as they come."""
    from tauhat.cli.contact_choice import prepared
    from tauhat.cli.sensor_choice import sensor_of

    if options.stream is not None:
        _answer(sensor_of(options, _streamed_rate(options)), options)
        return
    if not options.logs:
        raise typer.BadParameter("a LOG, or --input - for samples from standard input")
    _check_outputs(options)
    with working("sensing"):
        logs = _logs(options)
        rates = [_rate(log) if options.rate is None else options.rate for log in logs]
        known = prepared(options, sensor_of(options, min(rates)), logs=options.logs)
        judged = [_judged(known, log, rate, options) for log, rate in zip(logs, rates, strict=True)]
    _write(judged, logs, options)

    def view() -> Iterator[RenderableType]:
        yield from _view(judged, known)
        for path in filter(None, (options.output, options.report, options.thresholds if options.free else None)):
            yield unbroken(f"Written: {path}")

    show(_document(judged, known, options), view, as_json=options.as_json)


def _answer(sensor: ForceSensor, options: Options) -> None:
    """Answer samples from standard input; contacts are told where something is known of them, or has to be."""
    from tauhat.cli.contact_choice import prepared
    from tauhat.cli.sensing_lines import answer

    if not (options.free or options.thresholds or options.zero or options.alarms):
        answer(sensor)
        return
    known = prepared(options, sensor)
    answer(known.sensor, known.thresholds, zero=_zero(options).told)


def _zero(options: Options) -> ZeroChoice:
    return options.zero or ZeroChoice()


def _streamed_rate(options: Options) -> float:
    """Return the rate of the samples on standard input, after refusing options that have no place there."""
    if options.stream != _STANDARD_INPUT:
        raise typer.BadParameter("only - for standard input; give files as LOG", param_hint="'--input'")
    taken: list[tuple[str, object]] = [
        ("LOG", options.logs),
        ("-o", options.output),
        ("--report", options.report),
    ]
    taken += [("--rows", options.rows), ("--json", options.as_json)]
    taken += [] if options.free else [("--map", options.map_file)]
    for name, value in taken:
        if value:
            raise typer.BadParameter(
                f"not together with {name}: samples come and answers go as lines", param_hint="'--input'"
            )
    check_without_air(options.zero)
    if options.rate is None:
        raise typer.BadParameter("needs --rate, the rate of the samples", param_hint="'--input'")
    return options.rate


def _check_outputs(options: Options) -> None:
    from tauhat.files import check_output
    from tauhat.recordings.writing import log_ending
    from tauhat.report.page import require_libraries

    inputs = [
        *options.inputs, *(options.logs or ()), *(options.free or ()), *filter(None, [options.thresholds])
    ]  # fmt: skip
    if options.output is not None:
        log_ending(options.output)
        check_output(options.output, inputs=inputs)
    if options.report is not None:
        require_libraries()
        check_output(options.report, inputs=[*inputs, *filter(None, [options.output])])


def _logs(options: Options) -> list[Log]:
    from tauhat.recordings.reading import read_log

    return [read_log(log, map=options.map_file, rows=options.rows) for log in options.logs or ()]


def _rate(log: Log) -> float:
    from tauhat.errors import SensingError
    from tauhat.sensing.sample_rate import usual_step

    step = usual_step(log.t)
    if not step > 0.0:
        raise SensingError("the log has no rate", where=log.path, got=f"{log.n_t} samples")
    return 1.0 / step


def _judged(known: Prepared, log: Log, rate: float, options: Options) -> JudgedLog:
    from tauhat.sensing.judged_log import judged_log

    sensor = known.sensor if known.sensor.rate == rate else replace(known.sensor, rate=rate)
    return judged_log(sensor, log, known.thresholds, zero=_zero(options).told, air=known.air)


def _write(judged: Sequence[JudgedLog], logs: Sequence[Log], options: Options) -> None:
    if options.output is not None:
        from tauhat.recordings.writing import write_columns
        from tauhat.sensing.sensed_log import sensed_columns, sensed_metadata

        sensed = [log.sensed for log in judged]
        write_columns(sensed_columns(sensed), options.output, metadata=sensed_metadata(sensed[0]))
    if options.report is not None:
        from tauhat.report.sensing_page import write_sensing_report

        write_sensing_report(options.report, judged, measured=[log.wrench for log in logs])


def _document(judged: Sequence[JudgedLog], known: Prepared, options: Options) -> dict[str, Any]:
    sensed = [log.sensed for log in judged]
    return {
        "samples": sum(log.n_t for log in sensed),
        "events": [
            {"log": place, **event.to_dict()} for place, log in enumerate(judged) for event in log.contacts.events
        ],
        "observer": options.observer,
        "frame": sensed[0].frame,
        "axes": sensed[0].axes,
        "zero": _zero(options).kind,
        "error": {"from": known.source, "rms": known.sensor.model.rms.tolist()},
        "promised": known.thresholds.promised,
        "output": str(options.output) if options.output else None,
        "report": str(options.report) if options.report else None,
        "logs": [{**log.sensed.to_dict(), "hidden": log.hidden.to_dict()} for log in judged],
    }


def _view(judged: Sequence[JudgedLog], known: Prepared) -> Iterator[RenderableType]:
    from tauhat.cli.views.contacts import contacts_view
    from tauhat.cli.views.sensing import error_view, sensing_view

    for log in judged:
        yield from sensing_view(log)
    yield error_view(known.source)
    yield from contacts_view(judged)
