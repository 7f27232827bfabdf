"""Samples over WebSocket: one text message each, behind a handshake that no page of another site passes."""

from __future__ import annotations

import asyncio
import logging
import socket
from contextlib import suppress
from functools import partial
from http import HTTPStatus
from typing import TYPE_CHECKING, Any, cast

from tauhat.errors import LiveError, MissingExtraError
from tauhat.live.access import Access
from tauhat.live.clients import Clients
from tauhat.live.conversation import converse
from tauhat.live.reasons import reason_of

try:
    from websockets.asyncio.server import Server, ServerConnection, serve
    from websockets.exceptions import ConnectionClosed
except ImportError as error:
    raise MissingExtraError("websockets", "live") from error

if TYPE_CHECKING:
    from websockets.http11 import Request, Response

PATH = "/"
_RESTING = 20.0  # [s] between pings, and for their answer
_FAREWELL = 2.0  # [s] for a client to agree that it ends
_READ_AHEAD = 16  # messages
_AT_ONCE = 8  # control frames' answers may fill the buffer so many times over before the client is cut off
_LOG = logging.getLogger("tauhat.live")
_LOG.addHandler(logging.NullHandler())  # a client's faults are no news to the terminal, unless somebody asks


class _Connection(ServerConnection):
    """A connection that is one of a bounded number and writes into a bounded buffer, whatever its client does."""

    def __init__(self, *arguments: Any, clients: Clients, **settings: Any) -> None:
        super().__init__(*arguments, **settings)
        self._waiting = clients.waiting
        self._buffer = clients.service.limits.buffer

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        connected: socket.socket = transport.get_extra_info("socket")
        connected.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, self._buffer)
        self._waiting.enter(self, hang_up=self.transport.abort)

    def connection_lost(self, exc: Exception | None) -> None:
        self._waiting.leave(self)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        if self.transport.get_write_buffer_size() > _AT_ONCE * self._buffer:
            self.transport.abort()  # asks for answers, pongs among them, and reads none


class _Channel:
    """A WebSocket as a channel of whole messages."""

    kind = "websocket"

    def __init__(self, connection: ServerConnection, clients: Clients) -> None:
        self._connection = connection
        self._clients = clients

    async def receive(self) -> bytes:
        try:
            return await self._connection.recv(decode=False)
        except ConnectionClosed as error:
            raise EOFError from error

    async def send(self, text: str) -> None:
        try:
            await self._connection.send(text)
        except ConnectionClosed as error:
            raise EOFError from error

    def abort(self) -> None:
        self._connection.transport.abort()

    def admitted(self) -> None:
        self._clients.waiting.leave(self._connection)


async def serve_websocket(clients: Clients, access: Access, *, port: int) -> tuple[Server, int]:
    """Return a server that answers WebSocket clients until it is closed, and its port.

    Parameters
    ----------
    clients : all that are connected
    access : where to listen, and who is let in
    port : 0 for any that is free

    Raises
    ------
    LiveError
        when the port cannot be had.
    """
    limits = clients.service.limits

    async def answer(connection: ServerConnection) -> None:
        known = connection.request is not None and "Authorization" in connection.request.headers
        await converse(_Channel(connection, clients), clients, access=None if known else access)
        await _closed(connection)

    try:
        server = await serve(
            answer, access.host, port, process_request=partial(_judged, access=access, clients=clients),
            create_connection=cast("type[ServerConnection]", partial(_Connection, clients=clients)),
            compression=None, server_header=None, open_timeout=limits.handshake, close_timeout=_FAREWELL,
            ping_interval=_RESTING, ping_timeout=_RESTING, max_size=limits.message, max_queue=_READ_AHEAD,
            write_limit=limits.buffer, logger=_LOG,
        )  # fmt: skip
    except (OSError, UnicodeError) as error:
        raise LiveError(
            "cannot listen for WebSockets", where=f"{access.host}:{port}", got=reason_of(error),
            remedy="choose another port or host",
        ) from error  # fmt: skip
    return server, next(iter(server.sockets)).getsockname()[1]


async def _closed(connection: ServerConnection) -> None:
    """Close a connection; what its client still says is read past, since its farewell comes behind that."""
    closing = asyncio.ensure_future(connection.close())
    with suppress(ConnectionClosed, TimeoutError):
        async with asyncio.timeout(_FAREWELL):
            while True:
                await connection.recv(decode=False)
    connection.transport.abort()
    await closing


def _judged(connection: ServerConnection, request: Request, *, access: Access, clients: Clients) -> Response | None:
    """Return a refusal of whoever has no business here, None for all others."""
    hosts, origins = (request.headers.get_all(name) for name in ("Host", "Origin"))
    given = request.headers.get_all("Authorization")
    if request.path != PATH:
        return connection.respond(HTTPStatus.NOT_FOUND, "no such path\n")
    if len(hosts) != 1 or not access.knows_host(hosts[0]):
        return connection.respond(HTTPStatus.MISDIRECTED_REQUEST, "not a name of this server\n")
    if len(origins) > 1 or not access.knows_origin(next(iter(origins), None), hosts[0]):
        return connection.respond(HTTPStatus.FORBIDDEN, "not from this page\n")
    if given and not (len(given) == 1 and access.admits_authorization(given[0])):
        clients.totals["turned_away"] += 1
        return connection.respond(HTTPStatus.UNAUTHORIZED, "not the token\n")
    return None
