"""Answers that wait for their reader: so many and no more, then the oldest are dropped and the reader is told."""

from __future__ import annotations

import asyncio
from collections import deque

from tauhat.live.protocol import notice_text


class Outbox:
    """A queue of messages with room for so many.

    What is dropped is told in place of it, as soon as a reader takes something: at most once a second while it goes on,
    and at the latest when nothing else waits.

    Parameters
    ----------
    room : messages that wait at most
    pause : least time between two notices [s]
    """

    __slots__ = ("_closed", "_notices", "_pause", "_room", "_told", "_untold", "_waiter", "_waiting", "dropped")

    def __init__(self, room: int, *, pause: float = 1.0) -> None:
        self._waiting: deque[tuple[str, bool]] = deque()
        self._room = room
        self._pause = pause
        self._told = -float("inf")
        self._untold = 0
        self._waiter: asyncio.Future[None] | None = None
        self._closed = False
        self.dropped = 0

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, text: str, *, answers: int = 1) -> None:
        """Add a message; without room the oldest goes.

        Parameters
        ----------
        answers : 0 for a notice, which nobody counts when it is dropped
        """
        if len(self._waiting) >= self._room:
            _, lost = self._waiting.popleft()
            self._untold += lost
            self.dropped += lost
        self._waiting.append((text, bool(answers)))
        self._wake()

    def take(self, now: float) -> str | None:
        """Return the next message, None where there is none."""
        if self._untold and (not self._waiting or now - self._told >= self._pause):
            count, self._untold, self._told = self._untold, 0, now
            return notice_text("dropped", count=count, total=self.dropped)
        return self._waiting.popleft()[0] if self._waiting else None

    def close(self) -> None:
        """Say that nothing more will be added."""
        self._closed = True
        self._wake()

    async def next(self) -> str:
        """Return the next message as soon as there is one.

        Raises
        ------
        EOFError
            when it was closed and nothing waits any more.
        """
        loop = asyncio.get_running_loop()
        while (text := self.take(loop.time())) is None:
            if self._closed:
                raise EOFError
            self._waiter = loop.create_future()
            await self._waiter
        return text

    def _wake(self) -> None:
        if self._waiter is not None and not self._waiter.done():
            self._waiter.set_result(None)
