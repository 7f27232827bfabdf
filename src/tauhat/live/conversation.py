"""One client on a connection, from who it is to its last answer; the same over WebSocket and pipe.

Messages are read one by one and answered into an outbox; a task beside writes it out as fast as the client reads. So a
client that does not read holds up nothing, and one that sends too fast is read more slowly.
"""

from __future__ import annotations

import asyncio
from contextlib import suppress
from itertools import count
from typing import Protocol

from tauhat.errors import LiveError, TauhatError
from tauhat.live.access import Access
from tauhat.live.clients import Client, Clients
from tauhat.live.outbox import Outbox
from tauhat.live.protocol import decoded, notice_text, refusal_text

_FAREWELL = 2.0  # [s] for what still waits when a conversation ends
_IN_A_ROW = 4  # messages that may be there already, before others have their turn


class Channel(Protocol):
    """A connection that carries whole messages."""

    @property
    def kind(self) -> str:
        """How messages call it."""

    async def receive(self) -> bytes:
        """Return the next message.

        Raises
        ------
        EOFError
            when the client has ended.
        LiveError
            when what it sends is no message.
        """

    async def send(self, text: str) -> None:
        """Send a message; waits for a reader that is slow."""

    def abort(self) -> None:
        """End the connection at once."""

    def admitted(self) -> None:
        """Take note that the client is known and served."""


async def converse(channel: Channel, clients: Clients, *, access: Access | None) -> None:
    """Answer a client until it ends or is refused.

    Parameters
    ----------
    access : knows the token that the first message has to hold; None where the client is known already
    """
    try:
        if access is not None and access.is_guarded:
            await _introduced(channel, clients, access)
        client = clients.admit(channel.kind, asyncio.get_running_loop().time(), hang_up=channel.abort)
        channel.admitted()
    except TauhatError as error:
        clients.totals["turned_away"] += 1
        await _said(channel, refusal_text(error))
        return
    except (EOFError, OSError):
        return
    try:
        await _served(channel, client, clients.service.hello)
    finally:
        clients.leave(client)


async def _introduced(channel: Channel, clients: Clients, access: Access) -> None:
    """Pass when the first message holds the token, in time."""
    service = clients.service
    try:
        async with asyncio.timeout(service.limits.handshake):
            first = decoded(await channel.receive(), service.limits)
    except TimeoutError as error:
        raise LiveError("no token in time", where=channel.kind) from error
    if first is None or not access.admits(first.get("token")):
        raise LiveError("not the token", where=channel.kind, expected='a first message {"token": ...}')


async def _served(channel: Channel, client: Client, hello: str) -> None:
    client.outbox.put(hello, answers=0)
    writing = asyncio.create_task(_deliver(client.outbox, channel))
    try:
        await _answered(channel, client)
    except TauhatError as error:
        client.outbox.put(refusal_text(error), answers=0)
    except asyncio.CancelledError:
        client.outbox.put(notice_text("ended"), answers=0)
    except (EOFError, OSError):
        pass
    client.outbox.close()
    await asyncio.wait({writing}, timeout=_FAREWELL)
    writing.cancel()
    with suppress(asyncio.CancelledError, OSError, EOFError):
        await writing


async def _answered(channel: Channel, client: Client) -> None:
    loop, session, throttle = asyncio.get_running_loop(), client.session, client.throttle
    for number in count():
        data = await channel.receive()
        client.heard = now = loop.time()
        wait = throttle.take(now)
        session.receive(data, now)
        if wait > 0.0:
            session.slowed(now)
            await asyncio.sleep(wait)
        elif number % _IN_A_ROW == 0:
            await asyncio.sleep(0)


async def _deliver(outbox: Outbox, channel: Channel) -> None:
    """Write out what waits until the outbox is closed or the reader is gone."""
    with suppress(EOFError, OSError):
        while True:
            await channel.send(await outbox.next())


async def _said(channel: Channel, text: str) -> None:
    """Send a last message to a client that was not served, if it reads."""
    with suppress(EOFError, OSError, TimeoutError):
        async with asyncio.timeout(_FAREWELL):
            await channel.send(text)
