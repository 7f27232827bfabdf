"""Who is connected: a bounded number, each with its session; those that fall silent are let go."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable
from typing import TypeAlias

from tauhat.errors import LiveError
from tauhat.live.followers import Followers, nobody
from tauhat.live.limits import Limits
from tauhat.live.outbox import Outbox
from tauhat.live.service import Service
from tauhat.live.session import Session
from tauhat.live.throttle import Throttle
from tauhat.live.waiting_room import WaitingRoom
from tauhat.sensing.stream import JUDGED

_LOOKED = 0.05  # [s] between looks at what the page asks for
_AGREED = frozenset({"robot"})  # whose rate was agreed on before the first sample
_UNPROVED = frozenset({"udp"})  # where anybody's address may be written on a message: nothing goes there unasked

_HangUp: TypeAlias = Callable[[], object]


class Client:
    """One stream and how it is reached.

    session, outbox, throttle : its own
    heard : when its last message came, by the loop's clock [s]
    hang_up : ends it
    """

    __slots__ = ("hang_up", "heard", "outbox", "session", "throttle")

    def __init__(self, session: Session, outbox: Outbox, *, limits: Limits, now: float, hang_up: _HangUp) -> None:
        self.session = session
        self.outbox = outbox
        self.throttle = Throttle(limits.messages)
        self.heard = now
        self.hang_up = hang_up


class Clients:
    """All that are connected, over all channels.

    Parameters
    ----------
    service : what they are given

    Attributes
    ----------
    totals : clients so far, connections that were turned away, datagrams of addresses that were not let in, and the
        counts of the clients that have left
    waiting : connections that are no clients yet
    followers : those that are sent what is said of the robot that the server reads
    """

    def __init__(self, service: Service) -> None:
        self.service = service
        self.totals: Counter[str] = Counter(clients=0, turned_away=0, unknown_datagrams=0)
        self.waiting = WaitingRoom(service.limits.waiting)
        self.followers = Followers()
        self._clients: set[Client] = set()

    def __len__(self) -> int:
        return len(self._clients)

    @property
    def is_full(self) -> bool:
        """Whether no more are let in."""
        return len(self._clients) >= self.service.limits.clients

    def admit(self, kind: str, now: float, *, hang_up: _HangUp) -> Client:
        """Return a new client with a session of its own.

        Parameters
        ----------
        kind : of its channel; messages and the page call it so, with a number
        now : by the loop's clock [s]
        hang_up : called when it has been silent for too long

        Raises
        ------
        LiveError
            when there are too many.
        """
        if self.is_full:
            raise LiveError(
                "too many clients", where="server", expected=f"at most {self.service.limits.clients}",
                remedy="come again when another has left",
            )  # fmt: skip
        self.totals["clients"] += 1
        limits = self.service.limits
        outbox = Outbox(limits.queue, pause=limits.notice)
        session = Session(
            self.service, name=f"{kind} {self.totals['clients']}", outbox=outbox,
            followers=None if kind in _UNPROVED else self.followers, judged=None if kind in _AGREED else JUDGED,
        )  # fmt: skip
        if kind in _AGREED:
            self.followers.command = session.command
        client = Client(session, outbox, limits=limits, now=now, hang_up=hang_up)
        self._clients.add(client)
        return client

    def leave(self, client: Client) -> None:
        """Forget a client; what it streamed is gone with its session."""
        self.followers.leave(client.outbox)
        if self.followers.command == client.session.command:
            self.followers.command = nobody
        if client in self._clients:
            self._clients.remove(client)
            self.totals.update(client.session.counts)
        self.service.feed.forget(client.session.name, client.session.unshown)

    async def obey(self) -> None:
        """Do for all streams, until cancelled, what is asked for on the page."""
        feed = self.service.feed
        while True:
            await asyncio.sleep(_LOOKED)
            for name in feed.commands():
                for client in self._clients:
                    client.session.command(name)

    async def watch(self) -> None:
        """Let go, until cancelled, of clients that have been silent for too long; who follows need not say anything.

        Where the server itself stood still, as on a machine that was stopped, nobody is blamed: what was said meanwhile
        still waits to be heard.
        """
        loop, idle = asyncio.get_running_loop(), self.service.limits.idle
        pause = min(1.0, idle / 4.0)
        while True:
            begun = loop.time()
            await asyncio.sleep(pause)
            now = loop.time()
            for client in list(self._clients):
                client.heard = min(now, client.heard + max(0.0, now - begun - pause))
                if now - client.heard > idle and client.outbox not in self.followers:
                    client.hang_up()
