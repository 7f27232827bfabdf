"""A viser server behind a door: no port, bounded messages, and headers that keep other sites' pages out.

viser answers whoever finds its port: any program of this machine, and any page in a browser on it, since a WebSocket is
not bound to the page's own site. So it gets no port. It listens at a Unix socket, which browsers cannot name and the
rights of a folder guard; whatever lets others in stands in front of it.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

from tauhat.errors import MissingExtraError, OutputError

_LONGEST = 65536  # [bytes] of a message from a browser; a camera that moves sends some 300
_PORT_VARIABLE = "_VISER_PORT_OVERRIDE"  # of viser, which would number a port that is not there


def hidden_server(door: Path) -> Any:
    """Return a viser server that listens at a Unix socket and nowhere else.

    Parameters
    ----------
    door : path of the socket, in a folder that no other user may enter

    Raises
    ------
    MissingExtraError
        when viser is not installed.
    OutputError
        when the door cannot be made.
    """
    try:
        import viser
    except ImportError as error:
        raise MissingExtraError("viser", "live") from error
    os.environ.pop(_PORT_VARIABLE, None)
    with _listening_at(door), redirect_stdout(StringIO()):  # viser greets on standard output
        server = viser.ViserServer(host="hidden", port=0, label="tauhat", verbose=False)
    # Any page may ask viser for a tunnel through a server of others, which would go round whatever guards the door.
    server.request_share_url = _no_tunnel
    _take_only_values(server)
    return server


def page_headers(host: str) -> dict[str, str]:
    """Return headers under which the page loads nothing from elsewhere, and no page of another site shows it.

    Parameters
    ----------
    host : as the browser named it, known to be ours: where the page's WebSocket goes
    """
    sources = {
        "default-src": "'none'",
        "script-src": "'unsafe-inline' 'unsafe-eval' blob:",  # viser's page unpacks itself
        "worker-src": "blob:",
        "style-src": "'unsafe-inline'",
        "img-src": "data: blob:",
        "font-src": "data:",
        "connect-src": f"'self' ws://{host} wss://{host} data: blob:",
        "base-uri": "'none'",
        "form-action": "'none'",
        "frame-ancestors": "'none'",
    }
    return {
        "Content-Security-Policy": "; ".join(f"{name} {value}" for name, value in sources.items()),
        "X-Content-Type-Options": "nosniff",
        "Referrer-Policy": "no-referrer",
        "Cache-Control": "no-store",
    }


def _take_only_values(server: Any) -> None:
    """Let pages set values and press buttons, and nothing else.

    viser would let a page write any attribute of a button or a list, and upload files to it that nobody asked for,
    until memory is full. The camera is told on another way.
    """
    interface = server.gui._websock_interface  # noqa: SLF001 - viser has no public way to refuse a message
    plain = interface._handle_incoming_message  # noqa: SLF001

    async def handle(client: int, message: Any) -> None:
        updates = getattr(message, "updates", None)
        if type(message).__name__ == "GuiUpdateMessage" and isinstance(updates, dict) and updates.keys() == {"value"}:
            await plain(client, message)

    interface._handle_incoming_message = handle  # noqa: SLF001


def _no_tunnel(*_given: Any, **_named: Any) -> None:
    """Make none."""


@contextmanager
def _listening_at(door: Path) -> Iterator[None]:
    """Let viser's WebSocket library listen at a door while viser starts: viser itself knows hosts and ports only."""
    from viser.infra import _infra

    library = _infra.websockets.asyncio.server
    plain = library.serve
    try:
        listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        listening.bind(str(door))
        door.chmod(0o600)
    except OSError as error:
        raise OutputError("the page's socket cannot be made", got=door, remedy="is the path too long?") from error

    def at_door(handler: Any, _host: str, _port: int, *, process_request: Any, **options: Any) -> Any:
        bounded = {**options, "max_size": _LONGEST, "process_request": _with_headers(process_request)}
        return plain(handler, sock=listening, **bounded)

    library.serve = at_door
    try:
        yield
    finally:
        library.serve = plain


def _with_headers(process_request: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    def process(connection: Any, request: Any) -> Any:
        response = process_request(connection, request)
        if response is not None:
            for name, value in page_headers(request.headers.get("Host", "")).items():
                response.headers[name] = value
        return response

    return process
