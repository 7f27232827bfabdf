"""Samples as datagrams: one each, answered to the address it came from.

Whoever sends datagrams can write any address on them. So an address that has not said the token gets no answer at all,
and no small datagram makes the server send much to an address: only samples of a known client are answered, one for
one; datagrams that let nobody in are counted. An address is a client from its first datagram on until it says that it
ends, or has been silent for the idle time.

All clients share one socket. When more comes in than the server can answer, the system drops datagrams, whoever sent
them: a stream that must lose nothing beside others belongs on another channel.
"""

from __future__ import annotations

import asyncio
import socket
from typing import Any, TypeAlias, cast

from tauhat.errors import LiveError, TauhatError
from tauhat.live.access import Access
from tauhat.live.clients import Client, Clients
from tauhat.live.protocol import decoded, refusal_text
from tauhat.live.reasons import reason_of
from tauhat.live.throttle import Throttle

_STRANGERS = 10_000.0  # datagrams a second of unknown addresses that are looked into
_KERNEL = 2**20  # [bytes] of datagrams that the system is asked to hold while the server is busy
_IN_A_ROW = 16  # datagrams, before others have their turn

_Address: TypeAlias = tuple[Any, ...]


class UdpServer:
    """Datagrams in, datagrams out.

    Parameters
    ----------
    clients : all that are connected
    access : where to listen, and who is let in
    """

    def __init__(self, clients: Clients, access: Access) -> None:
        self._clients = clients
        self._access = access
        self._known: dict[_Address, Client] = {}
        self._strangers = Throttle(_STRANGERS)
        self._loop = asyncio.get_running_loop()
        self._socket: socket.socket | None = None
        self._held: tuple[str, _Address] | None = None  # what the system did not take

    def start(self, port: int) -> int:
        """Listen at a port, 0 for any that is free; return which.

        Raises
        ------
        LiveError
            when it cannot be had.
        """
        host = self._access.host
        try:
            family, *_, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
            self._socket = socket.socket(family, socket.SOCK_DGRAM)
            self._socket.bind(address)
        except (OSError, UnicodeError) as error:
            self.close()
            raise LiveError(
                "cannot listen for datagrams", where=f"{host}:{port}", got=reason_of(error),
                remedy="choose another port or host",
            ) from error  # fmt: skip
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _KERNEL)
        self._loop.add_reader(self._socket, self._read, self._socket)
        return cast("int", self._socket.getsockname()[1])

    def close(self) -> None:
        """Forget all clients and stop listening."""
        for address in list(self._known):
            self._forget(address)
        if self._socket is not None:
            self._loop.remove_reader(self._socket)
            self._loop.remove_writer(self._socket)
            self._socket.close()
            self._socket = None

    def _read(self, listening: socket.socket) -> None:
        """Answer the datagrams that are there, a few at a time."""
        longest = self._clients.service.limits.message + 1  # one that is longer is cut off, and no message either way
        for _ in range(_IN_A_ROW):
            try:
                data, address = listening.recvfrom(longest)
            except BlockingIOError:
                return
            except OSError:
                continue  # an earlier answer did not arrive
            self._receive(data, address)

    def _receive(self, data: bytes, address: _Address) -> None:
        """Answer a datagram, or look whether it lets its address in."""
        now = self._loop.time()
        client = self._known.get(address) or self._newcomer(data, address, now)
        if client is None:
            self._clients.totals["unknown_datagrams"] += 1
            return
        client.heard = now
        if client.throttle.wait(now) > 0.0:
            client.session.slowed(now, lost=1)
        else:
            client.throttle.take(now)
            self._answer(client, data, address, now)
        self._flush(address, client)

    def _answer(self, client: Client, data: bytes, address: _Address, now: float) -> None:
        try:
            client.session.receive(data, now)
        except (TauhatError, EOFError) as error:
            if isinstance(error, TauhatError):
                client.outbox.put(refusal_text(error), answers=0)
            self._flush(address, client)
            self._forget(address)

    def _newcomer(self, data: bytes, address: _Address, now: float) -> Client | None:
        """Return the client that an unknown address becomes by this datagram, None where it does not."""
        if self._strangers.wait(now) > 0.0:
            return None
        self._strangers.take(now)
        found = decoded(data, self._clients.service.limits)
        if found is None or not self._access.admits(found.get("token")):
            return None
        try:
            client = self._clients.admit("udp", now, hang_up=lambda: self._forget(address))
        except LiveError as error:
            self._send(refusal_text(error), address)
            return None
        self._known[address] = client
        client.outbox.put(self._clients.service.hello, answers=0)
        return client

    def _forget(self, address: _Address) -> None:
        client = self._known.pop(address, None)
        if client is not None:
            self._clients.leave(client)

    def _flush(self, address: _Address, client: Client) -> None:
        while self._held is None and (text := client.outbox.take(self._loop.time())) is not None:
            self._send(text, address)

    def _send(self, text: str, address: _Address) -> None:
        """Send a datagram, or hold it, and all that come after it, until the system takes it."""
        if self._socket is None:
            return
        try:
            self._socket.sendto(text.encode(), address)
        except BlockingIOError:
            if self._held is None:
                self._held = (text, address)
                self._loop.add_writer(self._socket, self._resume, self._socket)
        except OSError:
            return  # nobody can be reached there

    def _resume(self, listening: socket.socket) -> None:
        """Send what was held and what waits behind it."""
        self._loop.remove_writer(listening)
        held, self._held = self._held, None
        if held is not None:
            self._send(*held)
        for address, client in list(self._known.items()):
            self._flush(address, client)
