"""A robot as a client of the server: its samples come in as everybody's do, and the page shows what touches it.

A thread waits for the robot; what it tells goes to the server's loop as messages. Answers go to the clients that
follow.
"""

from __future__ import annotations

import asyncio
import json
import threading
from collections import deque
from typing import TYPE_CHECKING

from tauhat.errors import LiveError, TauhatError
from tauhat.live.universal_robots import SCHEME

if TYPE_CHECKING:
    from collections.abc import Callable

    from tauhat.live.clients import Clients
    from tauhat.live.followers import Followers
    from tauhat.live.universal_robots import LiveSample, RobotLink

_GREETING, _REFUSED = '{"hello"', '{"refused"'
_WAITING = 4000  # samples that may wait for a loop that is busy; then the oldest go


async def stream_robot(link: RobotLink, clients: Clients) -> None:
    """Answer a robot's samples as those of a client, until cancelled; closes the link.

    Raises
    ------
    TauhatError
        when the robot has another rate than the sensor, is gone for good, its samples are refused, or there are too
        many clients.
    """
    from tauhat.live.conversation import converse

    channel = RobotChannel(link, clients.followers)
    try:
        link.check_rate_of(clients.service.sensor)
        await converse(channel, clients, access=None)
    finally:
        channel.close()
    if channel.error is not None:
        clients.followers.tell_state(str(channel.error))
        raise channel.error


class RobotChannel:
    """A robot's samples as messages.

    error : why there are no more
    """

    kind = "robot"

    def __init__(self, link: RobotLink, followers: Followers) -> None:
        self.error: TauhatError | None = None
        self._link = link
        self._followers = followers
        followers.robot, followers.state = f"{SCHEME}{link.robot.address}", link.state
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
        """Pass an answer on to those that follow, but keep why the server refuses the robot."""
        if text.startswith(_REFUSED):
            self.error = self.error or LiveError("the server refuses the robot", got=json.loads(text)["refused"])
        elif not text.startswith(_GREETING):
            self._followers.tell(text)

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
        state = ""
        try:
            for sample in self._link:
                if sample is not None:
                    self._hand_over(self._take, _message(sample))
                if state != (state := self._link.state):
                    self._hand_over(self._followers.tell_state, state)
        except TauhatError as error:
            self.error = error
        self._ended = True
        self._hand_over(self._news.set)

    def _hand_over(self, call: Callable[..., object], *values: object) -> None:
        """Let the loop do something, as long as there is one."""
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(call, *values)

    def _take(self, message: bytes) -> None:
        self._waiting.append(message)
        self._news.set()


def _message(sample: LiveSample) -> bytes:
    return json.dumps({"t": sample.t, "q": sample.q.tolist(), "tau": sample.tau.tolist()}).encode("ascii")
