"""`tauhat sense`: what touches the robot, from position and motor torque, with error bars."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from tauhat.cli.options import EstimateArgument, JsonOption, MapOption, RowsOption, frequency, page
from tauhat.cli.output import show, unbroken
from tauhat.cli.reporting import working

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tauhat.cli.contact_choice import ContactChoice
    from tauhat.recordings.log import Log
    from tauhat.sensing.sensed_log import SensedLog

_STANDARD_INPUT = "-"


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What `tauhat sense` takes."""

    estimate: EstimateArgument
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
    observer: Annotated[str, typer.Option("--observer", metavar="NAME", help="How torque is observed.")] = "momentum"
    gain: Annotated[
        float | None,
        typer.Option(
            "--gain", metavar="K", parser=frequency, show_default="20",
            help="Of the observer [1/s]: half of a push comes through after 0.7 / K, beside the filter.",
        ),
    ] = None  # fmt: skip
    cutoff: Annotated[
        float | None,
        typer.Option(
            "--cutoff", metavar="HZ", parser=frequency, show_default="10, or what the rate allows",
            help="Of the filter that position and torque share.",
        ),
    ] = None  # fmt: skip
    frame: Annotated[
        str | None,
        typer.Option("--frame", metavar="NAME", help="Where the wrench acts.", show_default="the robot's last"),
    ] = None
    directions: Annotated[
        str,
        typer.Option("--directions", metavar="NAME", help="What may act there: wrench, force, fx, fy or fz."),
    ] = "wrench"
    axes: Annotated[
        Literal["base", "frame"], typer.Option("--axes", help="Whose axes wrench and directions are along.")
    ] = "base"
    tool: Annotated[
        Path | None,
        typer.Option(
            "--tool", metavar="TOOL.json", show_default=False, readable=False,
            help="What the arm carries and the estimate does not know: what `tauhat payload --json` prints.",
        ),
    ] = None  # fmt: skip
    stamps: Annotated[
        Literal["auto", "exact", "jittered"],
        typer.Option(
            "--stamps",
            help="Samples were taken at their time stamps, or evenly with stamps that jitter; auto: as positions tell.",
        ),
    ] = "auto"
    free: Annotated[
        list[Path] | None,
        typer.Option(
            "--free", metavar="LOG", show_default=False, readable=False,
            help="A recording without contact, to learn from when something touches the arm; may be repeated.",
        ),
    ] = None  # fmt: skip
    thresholds: Annotated[
        Path | None,
        typer.Option(
            "--thresholds", metavar="FILE.json", show_default=False,
            help="Thresholds of contact to read; with --free, to write.",
        ),
    ] = None  # fmt: skip
    alarms: Annotated[
        float,
        typer.Option("--alarms", metavar="RATE", parser=frequency, help="False contacts an hour allowed, with --free."),
    ] = 1.0
    map_file: MapOption = None
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
    from tauhat.cli.contact_choice import found_contacts
    from tauhat.cli.sensor_choice import SensorChoice
    from tauhat.cli.views.contacts import contacts_view

    choice = SensorChoice(
        estimate=options.estimate, observer=options.observer, gain=options.gain, cutoff=options.cutoff,
        frame=options.frame, directions=options.directions, axes=options.axes, tool=options.tool,
        stamps=options.stamps,
    )  # fmt: skip
    if options.stream is not None:
        from tauhat.cli.sensing_lines import answer

        sensor = choice.sensor(_streamed_rate(options))
        answer(sensor, _contacts(options).limits(sensor) if options.free or options.thresholds else None)
        return
    if not options.logs:
        raise typer.BadParameter("a LOG, or --input - for samples from standard input")
    _check_outputs(options)
    with working("sensing"):
        logs = _logs(options)
        sensed = [_sensed(choice, log, options.rate) for log in logs]
        limits = _contacts(options).limits(choice.sensor(1.0 / sensed[0].step))
        contacts = found_contacts(limits, sensed)
    _write(sensed, logs, options)
    events = [{"log": log, **event.to_dict()} for log, event in contacts]

    def view() -> Iterator[RenderableType]:
        yield from _view(sensed)
        yield from contacts_view(contacts, [log.name for log in sensed], limits)
        for path in filter(None, (options.output, options.report, options.thresholds if options.free else None)):
            yield unbroken(f"Written: {path}")

    show(_document(sensed, events, options), view, as_json=options.as_json)


def _contacts(options: Options) -> ContactChoice:
    from tauhat.cli.contact_choice import ContactChoice

    return ContactChoice(
        free=tuple(options.free or ()), thresholds=options.thresholds, alarms=options.alarms, map_file=options.map_file
    )


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
    if options.rate is None:
        raise typer.BadParameter("needs --rate, the rate of the samples", param_hint="'--input'")
    return options.rate


def _check_outputs(options: Options) -> None:
    from tauhat.files import check_output
    from tauhat.recordings.writing import log_ending
    from tauhat.report.page import require_libraries

    inputs = [options.estimate, *(options.logs or ()), *filter(None, [options.map_file, options.tool])]
    if options.output is not None:
        log_ending(options.output)
        check_output(options.output, inputs=inputs)
    if options.report is not None:
        require_libraries()
        check_output(options.report, inputs=[*inputs, *filter(None, [options.output])])


def _logs(options: Options) -> list[Log]:
    from tauhat.recordings.reading import read_log

    return [read_log(log, map=options.map_file, rows=options.rows) for log in options.logs or ()]


def _sensed(choice: Any, log: Log, rate: float | None) -> SensedLog:
    from tauhat.errors import SensingError
    from tauhat.sensing.sensor import usual_step

    step = usual_step(log.t) if rate is None else 1.0 / rate
    if not step > 0.0:
        raise SensingError("the log has no rate", where=log.path, got=f"{log.n_t} samples")
    found: SensedLog = choice.sensor(1.0 / step).along(log)
    return found


def _write(sensed: Sequence[SensedLog], logs: Sequence[Log], options: Options) -> None:
    if options.output is not None:
        from tauhat.recordings.writing import write_columns
        from tauhat.sensing.sensed_log import sensed_columns, sensed_metadata

        write_columns(sensed_columns(sensed), options.output, metadata=sensed_metadata(sensed[0]))
    if options.report is not None:
        from tauhat.report.sensing_page import write_sensing_report

        write_sensing_report(options.report, sensed, measured=[log.wrench for log in logs])


def _document(sensed: Sequence[SensedLog], events: list[dict[str, Any]], options: Options) -> dict[str, Any]:
    return {
        "samples": sum(log.n_t for log in sensed),
        "events": events,
        "observer": options.observer,
        "frame": sensed[0].frame,
        "axes": sensed[0].axes,
        "output": str(options.output) if options.output else None,
        "report": str(options.report) if options.report else None,
        "logs": [log.to_dict() for log in sensed],
    }


def _view(sensed: Sequence[SensedLog]) -> Iterator[RenderableType]:
    from tauhat.cli.views.sensing import sensing_view

    for log in sensed:
        yield from sensing_view(log)
