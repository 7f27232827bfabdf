"""`tauhat serve`: samples of a running robot in, what touches it out, and a page in the browser."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tauhat.cli.current_options import ConstantsOption, currents_of
from tauhat.cli.options import JsonOption, frequency
from tauhat.cli.output import counted, show, unbroken
from tauhat.cli.reporting import say, working
from tauhat.cli.sensing_options import SensingOptions
from tauhat.cli.zero_choice import ZeroChoice, check_without_air

if TYPE_CHECKING:
    from tauhat.cli.contact_choice import Prepared
    from tauhat.live.access import Access
    from tauhat.live.feed import Page
    from tauhat.live.server import Channels
    from tauhat.live.universal_robots import UniversalRobot

_WEBSOCKET, _PAGE = 8765, 8080


@dataclass(frozen=True, slots=True, kw_only=True)
class Options(SensingOptions):
    """What `tauhat serve` takes."""

    rate: Annotated[
        float | None,
        typer.Option(
            "--rate", metavar="HZ", parser=frequency, show_default="with --robot, all its controller has",
            help="Of the samples; needed without --robot.",
        ),
    ] = None  # fmt: skip
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot", metavar="ur://ADDRESS", show_default=False,
            help="A Universal Robots controller to read; --map or --constants makes its currents torques.",
        ),
    ] = None  # fmt: skip
    constants: ConstantsOption = None
    websocket: Annotated[
        int | None,
        typer.Option(
            "--websocket", metavar="PORT", min=0, max=65535, show_default="8765, without --udp, --pipe, --robot",
            help="Samples over WebSocket, one a text message; 0 for any port that is free.",
        ),
    ] = None  # fmt: skip
    udp: Annotated[
        int | None,
        typer.Option(
            "--udp", metavar="PORT", min=0, max=65535, show_default=False,
            help="Samples as datagrams, answered to where they come from.",
        ),
    ] = None  # fmt: skip
    pipe: Annotated[
        Path | None,
        typer.Option(
            "--pipe", metavar="PATH", show_default=False, help="Samples as lines over a Unix socket made at this path."
        ),
    ] = None
    host: Annotated[
        str,
        typer.Option("--host", metavar="ADDRESS", help="Where ports listen; any but this machine's needs a token."),
    ] = "127.0.0.1"
    token_file: Annotated[
        Path | None,
        typer.Option(
            "--token-file", metavar="FILE", show_default=False, readable=False,
            help="File of mode 0600 with the secret that clients and browsers have to know.",
        ),
    ] = None  # fmt: skip
    clients: Annotated[int, typer.Option("--clients", metavar="N", min=1, help="At a time, over all channels.")] = 8
    page: Annotated[
        int | None,
        typer.Option(
            "--page", metavar="PORT", min=0, max=65535, show_default=False,
            help=f"Of the page in the browser; {_PAGE} where not stated.",
        ),
    ] = None  # fmt: skip
    no_page: Annotated[bool, typer.Option("--no-page", help="Serve without a page.")] = False
    realtime: Annotated[
        bool, typer.Option("--realtime", help="Samples go before all ordinary programs; needs the right to (Linux).")
    ] = False
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Answer the samples of running robots with what touches them, and show it in the browser, until interrupted."""
    from tauhat.cli.contact_choice import prepared
    from tauhat.cli.sensor_choice import sensor_of
    from tauhat.live.feed import Feed
    from tauhat.live.limits import Limits
    from tauhat.live.priority import take_realtime_priority
    from tauhat.live.server import serve
    from tauhat.live.service import Service

    check_without_air(options.zero)
    if options.map_file is not None and options.robot is None and not options.free:
        raise typer.BadParameter("needs --robot or --free, whose columns it explains", param_hint="'--map'")
    if options.no_page and options.page is not None:
        raise typer.BadParameter("without a page there is no port of it", param_hint="'--page'")
    source = _source(options)
    channels = _channels(options, source)
    with working("preparing"):
        rate = _rate(options, source)
        known = prepared(options, sensor_of(options, rate))
        page = None if options.no_page else _page(known, channels.access, options.page)
    limits = Limits(clients=options.clients)
    service = Service(
        sensor=known.sensor, thresholds=known.thresholds, limits=limits, feed=Feed(page),
        zero=(options.zero or ZeroChoice()).told,
    )  # fmt: skip
    robot = known.sensor.model.robot.name
    if options.realtime:
        take_realtime_priority()  # after the page's process has begun, which does not take it over

    def started(addresses: Mapping[str, str]) -> None:
        document = {"robot": robot, "rate": rate, **addresses}
        document |= {} if page is None else {"page": page.url}
        show(document, lambda: [unbroken(_text(document))], as_json=options.as_json)
        sys.stdout.flush()

    totals = serve(service, channels, started=started)
    say("done", counted({_called(name, count): count for name, count in totals.items()}, none="nobody came"))


def _source(options: Options) -> UniversalRobot | None:
    """Return the robot that is to be read, None for none."""
    from tauhat.live.universal_robots import SCHEME, UniversalRobot

    if options.robot is None:
        if options.constants is not None:
            raise typer.BadParameter("needs --robot, whose currents they make torques", param_hint="'--constants'")
        return None
    if not options.robot.startswith(SCHEME):
        raise typer.BadParameter(f"not a robot that can be read: {options.robot}", param_hint="'--robot'")
    currents = currents_of(options.map_file, options.constants)
    return UniversalRobot(address=options.robot, currents=currents, rate=options.rate)


def _rate(options: Options, source: UniversalRobot | None) -> float:
    """Return the rate of the samples; a robot is asked whether it has it, before anything takes time."""
    from tauhat.live.limits import Limits

    if source is not None:
        fastest = source.greeted().fastest
        return fastest if options.rate is None else options.rate
    if options.rate is None:
        raise typer.BadParameter("needed without --robot: the rate of the samples", param_hint="'--rate'")
    if options.rate > (most := Limits().messages):
        raise typer.BadParameter(
            f"a client may send {most:g} samples a second, not {options.rate:g}", param_hint="'--rate'"
        )
    return options.rate


def _channels(options: Options, source: UniversalRobot | None) -> Channels:
    from tauhat.live.access import Access, read_token
    from tauhat.live.server import Channels

    token = None if options.token_file is None else read_token(options.token_file)
    alone = options.udp is None and options.pipe is None and source is None
    websocket = _WEBSOCKET if options.websocket is None and alone else options.websocket
    access = Access(host=options.host, token=token)
    return Channels(websocket=websocket, udp=options.udp, pipe=options.pipe, robot=source, access=access)


def _called(name: str, count: int) -> str:
    """Return what a count of the end is called: nouns in their number, the rest as they are."""
    words = name.replace("_", " ")
    return words[:-1] if count == 1 and words in {"clients", "restarts", "unknown datagrams"} else words


def _page(known: Prepared, access: Access, port: int | None) -> Page:
    from tauhat.live.page_process import start_page

    solver, at = known.sensor.solver, _PAGE if port is None else port
    return start_page(solver.robot, frame=str(solver.frame), axes=solver.axes, port=at, access=access)


def _text(document: Mapping[str, Any]) -> str:
    names = {"source": "robot", "websocket": "WebSocket", "udp": "UDP", "pipe": "pipe", "page": "page"}
    lines = [f"  {name:10}{document[key]}" for key, name in names.items() if key in document]
    return "\n".join([f"{document['robot']}, samples of {document['rate']:g} Hz at", *lines, "Ctrl-C ends it."])
