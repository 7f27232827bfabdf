"""A gate in front of the page in the browser: viser asks nobody who they are, so nobody reaches it but through here.

Every connection says in one bounded head, within a bounded time, what it wants. Who is let in gets the page or a
WebSocket, byte by byte; all else gets a line of text and the end of the connection. The token of the first visit turns
into a cookie that scripts cannot read and other sites cannot send, and leaves the address.
"""

from __future__ import annotations

import asyncio
import hmac
import secrets
import socket
import threading
from collections.abc import Coroutine
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, quote

from tauhat.errors import LiveError, OutputError
from tauhat.live.access import Access
from tauhat.live.reasons import reason_of
from tauhat.live.request_head import Answer, RequestHead, read_head

_PIECE = 65536  # [bytes] handed on at a time
_WILD = {"0.0.0.0": "127.0.0.1", "::": "::1"}  # noqa: S104  # addresses of all of a machine, and one of each
_GREETING = '<!doctype html><meta http-equiv="refresh" content="0;url=/"><a href="/">To the page</a>'
_HTML = ("Content-Type", "text/html; charset=utf-8")


@dataclass(frozen=True, slots=True, kw_only=True)
class GateLimits:
    """What a connection may take, so that none takes it from the others.

    head : longest head of a request [bytes]
    handshake : time to say what one wants [s]
    waiting : connections that have not said it yet; a newcomer beyond takes the place of the oldest
    pages : WebSockets at a time
    delay : before a wrong token is refused [s]
    stalled : time after which a browser that takes nothing is let go [s]
    """

    head: int = 16384
    handshake: float = 5.0
    waiting: int = 32
    pages: int = 8
    delay: float = 0.5
    stalled: float = 30.0

    def __post_init__(self) -> None:
        if min(self.head, self.handshake, self.waiting, self.pages, self.delay, self.stalled) <= 0:
            raise LiveError("a limit that bounds nothing", where="gate", expected="all above zero", got=self)


class Gate:
    """A gate that listens at once and lets in while it runs.

    Parameters
    ----------
    access : where it listens and who is let in
    port : of this machine; 0 for any free one
    door : Unix socket of the page behind it
    """

    def __init__(self, access: Access, *, port: int, door: Path, limits: GateLimits | None = None) -> None:
        self._access, self._door, self._limits = access, door, limits or GateLimits()
        self._socket = _bound(access.host, port)
        self.port: int = self._socket.getsockname()[1]
        self._session = secrets.token_urlsafe(32)
        self._cookie = f"tauhat_{self.port}"  # browsers share cookies between the ports of a machine
        self._waiting: dict[asyncio.StreamWriter, None] = {}
        self._pages = 0
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="gate", daemon=True)

    @property
    def url(self) -> str:
        """Where a browser finds the page; the token is part of it where there is one."""
        host = _WILD.get(self._access.host, self._access.host)
        shown = f"[{host}]" if ":" in host else host
        token = f"/?token={quote(self._access.token, safe='')}" if self._access.token is not None else ""
        return f"http://{shown}:{self.port}{token}"

    def start(self) -> None:
        """Let in from now on, in a thread of its own."""
        self._thread.start()

    def close(self) -> None:
        """End all connections."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join(timeout=2.0)
        self._socket.close()

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.set_exception_handler(_go_on)
        listening = asyncio.start_server(self._receive, sock=self._socket, limit=self._limits.head)
        server = self._loop.run_until_complete(listening)
        self._loop.run_forever()
        server.close()
        tasks = asyncio.all_tasks(self._loop)
        for task in tasks:
            task.cancel()
        self._loop.run_until_complete(asyncio.gather(*tasks, return_exceptions=True))
        self._loop.close()

    async def _receive(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Attend to one connection from its first byte to its last."""
        try:
            wanted = await self._wanted(reader, writer)
            if isinstance(wanted, Answer):
                await _send(writer, wanted.encoded(), seconds=self._limits.handshake)
            else:
                await self._hand_on(wanted, reader, writer)
        except (OSError, TimeoutError, asyncio.IncompleteReadError):
            pass  # gone, or too slow to be told
        finally:
            self._part(writer)

    def _part(self, writer: asyncio.StreamWriter) -> None:
        """End a connection; one that does not take what is left of its answer is not kept for it."""
        writer.close()
        if writer.transport.get_write_buffer_size():
            self._loop.call_later(self._limits.stalled, writer.transport.abort)

    async def _wanted(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> RequestHead | Answer:
        """Return what a connection asks for, or what it is told instead."""
        self._waiting[writer] = None
        if len(self._waiting) > self._limits.waiting:
            oldest = next(iter(self._waiting))
            del self._waiting[oldest]
            oldest.transport.abort()
        try:
            async with asyncio.timeout(self._limits.handshake):
                data = await reader.readuntil(b"\r\n\r\n")
        except asyncio.LimitOverrunError:
            return Answer(431, "The request is too long.\n")
        except TimeoutError:
            return Answer(408, "The request took too long.\n")
        finally:
            self._waiting.pop(writer, None)
        head = read_head(data)
        return head if isinstance(head, Answer) else (await self._judged(head) or head)

    async def _judged(self, head: RequestHead) -> Answer | None:
        """Return the answer to a request that is not let in, None for one that is."""
        if (stranger := self._strange(head)) is not None:
            return stranger
        if head.query and not head.is_upgrade:
            return await self._greeted(head.query)
        if head.query:
            return Answer(400, "The page takes no settings in its address.\n")
        if self._access.is_guarded and not self._is_known(head.fields.get("cookie", "")):
            return Answer(401, "This page asks for a token: open the address that the server printed.\n")
        if head.is_upgrade and self._pages >= self._limits.pages:
            return Answer(503, f"{self._pages} pages are open already: close one.\n")
        return None

    def _strange(self, head: RequestHead) -> Answer | None:
        """Return the answer to a request that no page of this server makes."""
        host, origin = head.fields["host"], head.fields.get("origin")
        if not self._access.knows_host(host):
            return Answer(403, "This server has another name: open it by its address.\n")
        if (origin is None and head.is_upgrade) or not self._access.knows_origin(origin, host):
            return Answer(403, "Pages of other sites are not let in.\n")
        return None if head.path == "/" else Answer(404, "There is one page here, at /.\n")

    async def _greeted(self, query: str) -> Answer:
        """Return the cookie for the token, and the way to the page without the token in its address.

        The browser is sent on by a page of our own: a redirection that began on another site would go without the
        cookie. Other settings are refused, since viser's page would take its data from a server named there.
        """
        given = parse_qs(query, keep_blank_values=True, encoding="ascii", errors="replace")
        if list(given) != ["token"] or len(given["token"]) != 1:
            return Answer(400, "The page takes no settings in its address but the token.\n")
        if not self._access.admits(given["token"][0]):
            await asyncio.sleep(self._limits.delay)
            return Answer(403, "The token is wrong: open the address that the server printed.\n")
        cookie = f"{self._cookie}={self._session}; Path=/; HttpOnly; SameSite=Strict"
        return Answer(200, _GREETING, (_HTML, ("Set-Cookie", cookie)))

    def _is_known(self, cookies: str) -> bool:
        named = (cookie.strip().partition("=") for cookie in cookies.split(";"))
        values = [value for name, _, value in named if name == self._cookie]
        return any(hmac.compare_digest(value.encode(), self._session.encode()) for value in values)

    async def _hand_on(self, head: RequestHead, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Connect the browser with the page until one of them ends it; it counts before anything is waited for."""
        self._pages += head.is_upgrade
        try:
            await self._joined(head, reader, writer)
        finally:
            self._pages -= head.is_upgrade

    async def _joined(self, head: RequestHead, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            inner_reader, inner_writer = await asyncio.open_unix_connection(str(self._door))
        except OSError:
            answer = Answer(502, "The page has ended, or has not begun.\n")
            return await _send(writer, answer.encoded(), seconds=self._limits.handshake)
        try:
            inner_writer.write(head.forwarded())
            outward = _copy(inner_reader, writer, stalled=self._limits.stalled)
            if head.is_upgrade:
                await _first(outward, _copy(reader, inner_writer, stalled=self._limits.stalled))
            else:
                await outward  # what the browser says after its request is not read
        finally:
            inner_writer.close()


def _go_on(_loop: asyncio.AbstractEventLoop, _context: dict[str, Any]) -> None:
    """Leave a connection that broke to itself: whoever breaks off could fill the log."""


async def _first(*ways: Coroutine[Any, Any, None]) -> None:
    """Run until one of these ends, and end the others."""
    tasks = [asyncio.ensure_future(way) for way in ways]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def _copy(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, *, stalled: float) -> None:
    while data := await reader.read(_PIECE):
        await _send(writer, data, seconds=stalled)


async def _send(writer: asyncio.StreamWriter, data: bytes, *, seconds: float) -> None:
    writer.write(data)
    async with asyncio.timeout(seconds):
        await writer.drain()


def _bound(host: str, port: int) -> socket.socket:
    """Return a socket that listens at an address.

    Raises
    ------
    OutputError
        when the address cannot be used.
    """
    try:
        family, *_, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
        return socket.create_server(address[:2], family=family, backlog=64)
    except (OSError, OverflowError, UnicodeError) as error:
        raise OutputError(
            "the page's address cannot be used", where=f"{host}, port {port}", got=reason_of(error),
            remedy="choose another port or host",
        ) from error  # fmt: skip
