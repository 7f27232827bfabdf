"""A robot as a client of the server: its samples come in as everybody's do, and the page shows what touches it.

A thread waits for the robot; what it tells goes to the server's loop as messages. Answers have no reader: they are let
go.
"""

from __future__ import annotations

import asyncio
import json
import threading
from collections import deque
from typing import TYPE_CHECKING

from tauhat.errors import LiveError, TauhatError

if TYPE_CHECKING:
    from tauhat.live.clients import Clients
    from tauhat.live.universal_robots import LiveSample, RobotLink

_WAITING = 4000  # samples that may wait for a loop that is busy; then the oldest go


async def stream_robot(link: RobotLink, clients: Clients) -> None:
    """Answer a robot's samples as those of a client, until cancelled; closes the link.

    Raises
    ------
    TauhatError
        when the robot is gone for good, its samples are refused, or there are too many clients.
    """
    from tauhat.live.conversation import converse

    channel = RobotChannel(link)
    try:
        await converse(channel, clients, access=None)
    finally:
        channel.close()
    if channel.error is not None:
        raise channel.error


class RobotChannel:
    """A robot's samples as messages.

    error : why there are no more
    """

    kind = "robot"

    def __init__(self, link: RobotLink) -> None:
        self.error: TauhatError | None = None
        self._link = link
        self._loop = asyncio.get_running_loop()
        self._waiting: deque[bytes] = deque(maxlen=_WAITING)
        self._news = asyncio.Event()
        self._ended = False
        self._thread = threading.Thread(target=self._read, name="robot", daemon=True)
        self._thread.start()

    async def receive(self) -> bytes:
        """Return the next sample as a message; `EOFError` when there are no more."""
        while not self._waiting:
            if self._ended:
                raise EOFError
            self._news.clear()
            await self._news.wait()
        return self._waiting.popleft()

    async def send(self, text: str) -> None:
        """Let an answer go, but keep why the server refuses the robot."""
        if text.startswith('{"refused"'):
            self.error = self.error or LiveError("the server refuses the robot", got=json.loads(text)["refused"])

    def abort(self) -> None:
        """Do nothing: a robot that stands still for long is not sent away."""

    def admitted(self) -> None:
        """Do nothing: it needs no token."""

    def close(self) -> None:
        """End the thread and the link."""
        self._link.stop()
        self._thread.join()
        self._link.close()

    def _read(self) -> None:
        try:
            for sample in self._link:
                if sample is not None:
                    self._tell(_message(sample))
        except TauhatError as error:
            self.error = error
        self._ended = True
        self._tell(None)

    def _tell(self, message: bytes | None) -> None:
        """Hand a message to the loop, as long as there is one."""
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._take, message)

    def _take(self, message: bytes | None) -> None:
        if message is not None:
            self._waiting.append(message)
        self._news.set()


def _message(sample: LiveSample) -> bytes:
    return json.dumps({"t": sample.t, "q": sample.q.tolist(), "tau": sample.tau.tolist()}).encode("ascii")
