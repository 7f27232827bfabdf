"""Samples as datagrams: one each, answered to the address it came from.

Whoever sends datagrams can write any address on them. So an address that has not said the token gets no answer at all,
and no small datagram makes the server send much to an address: only samples of a known client are answered, one for
one. An address is a client from its first datagram on until it has been silent for the idle time.
"""

from __future__ import annotations

import asyncio
import socket
from typing import Any, TypeAlias, cast

from tauhat.errors import LiveError, TauhatError
from tauhat.live.access import Access
from tauhat.live.clients import Client, Clients
from tauhat.live.protocol import decoded, refusal_text
from tauhat.live.throttle import Throttle

_STRANGERS = 10_000.0  # datagrams a second of unknown addresses that are looked into
_KERNEL = 2**20  # [bytes] of datagrams that the system may hold while the server is busy

_Address: TypeAlias = tuple[Any, ...]


class UdpServer(asyncio.DatagramProtocol):
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
        self._transport: asyncio.DatagramTransport | None = None
        self._is_paused = False

    async def start(self, port: int) -> int:
        """Listen at a port, 0 for any that is free; return which.

        Raises
        ------
        LiveError
            when it cannot be had.
        """
        address = (self._access.host, port)
        try:
            transport, _ = await self._loop.create_datagram_endpoint(lambda: self, local_addr=address)
        except OSError as error:
            raise LiveError("cannot listen for datagrams", where=f"{address[0]}:{port}", got=str(error)) from error
        bound: socket.socket = transport.get_extra_info("socket")
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _KERNEL)
        return cast("int", bound.getsockname()[1])

    def close(self) -> None:
        """Forget all clients and stop listening."""
        for address in list(self._known):
            self._forget(address)
        if self._transport is not None:
            self._transport.close()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Answer over this transport from now on."""
        self._transport = cast("asyncio.DatagramTransport", transport)
        cast("Any", transport).set_write_buffer_limits(high=self._clients.service.limits.buffer)

    def pause_writing(self) -> None:
        """Let answers wait: the system takes no more."""
        self._is_paused = True

    def resume_writing(self) -> None:
        """Send what waits."""
        self._is_paused = False
        for address, client in self._known.items():
            self._flush(address, client)

    def datagram_received(self, data: bytes, addr: _Address) -> None:
        """Answer a datagram, or look whether it lets its address in."""
        now = self._loop.time()
        client = self._known.get(addr) or self._newcomer(data, addr, now)
        if client is None:
            return
        client.heard = now
        if client.throttle.wait(now) > 0.0:
            client.session.slowed(now, lost=1)
        else:
            client.throttle.take(now)
            self._answer(client, data, addr, now)
        self._flush(addr, client)

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
        while not self._is_paused and (text := client.outbox.take(self._loop.time())) is not None:
            self._send(text, address)

    def _send(self, text: str, address: _Address) -> None:
        if self._transport is not None and not self._transport.is_closing():
            self._transport.sendto(text.encode(), address)
