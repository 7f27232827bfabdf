"""Samples to a server and its answers back: a recording in its own time or faster, or a robot's as they come."""

from __future__ import annotations

import json
import time
from collections import deque
from collections.abc import Iterator, Sequence
from typing import Any, Self

import numpy as np

from tauhat.errors import LiveError
from tauhat.live.connection import connect
from tauhat.recordings.log import Log
from tauhat.recordings.recording import Recording

_KEPT = 1000  # notices
_QUIET = 2.0  # [s] without an answer after which those that are missing are no longer waited for
_AHEAD = 64  # samples without an answer before the next is sent
_NAP = 0.05  # [s]
_BURST = 0.02  # [s] of samples that may be made up for at once
_CLOSER, _ASSUMED = 1.1, 1000.0  # of the gap that the server grants; messages a second before it has said


class Sender:
    """A client of `tauhat serve` on any of its channels, in one thread; use as a context.

    Parameters
    ----------
    address : as the server prints it, `ws://host:port/`, `udp://host:port` or `unix:path`
    token : where the server asks for one

    Raises
    ------
    LiveError
        when nobody answers there, or the server refuses.
    """

    def __init__(self, address: str, *, token: str | None = None) -> None:
        self.address = address
        self.hello: dict[str, Any] = {}
        self.notices: deque[dict[str, Any]] = deque(maxlen=_KEPT)
        self._connection = connect(address)
        if token is not None:
            self._connection.send(json.dumps({"token": token}))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the connection."""
        self._connection.close()

    def send(self, t: float, q: Sequence[float], tau: Sequence[float]) -> None:
        """Send a sample.

        Parameters
        ----------
        t : time stamp [s]
        q, tau : position and motor torque of every joint, joint side [rad or m, Nm or N]
        """
        self._connection.send(json.dumps({"t": t, "q": list(q), "tau": list(tau)}))

    def command(self, name: str) -> None:
        """Ask for something: `zero`, `unzero`, `counts` or `follow`, the answer is a notice; `end` ends the stream."""
        self._connection.send(json.dumps({"command": name}))

    def answers(self, seconds: float = 0.0) -> list[dict[str, Any]]:
        """Return the answers that have come, in order; notices go to `notices`, the greeting to `hello`.

        Parameters
        ----------
        seconds : to wait for the first answer or notice; the greeting alone is neither

        Raises
        ------
        LiveError
            when the server has refused, or ended the connection.
        """
        end = time.monotonic() + seconds
        found: list[dict[str, Any]] = []
        texts = self._connection.exchange(seconds)
        while not self._sorted(texts, found) and self._connection.is_open and (left := end - time.monotonic()) > 0.0:
            texts = self._connection.exchange(left)
        if not found and not self._connection.is_open:
            raise LiveError("the server ended the connection" if self.hello else "nobody answers", where=self.address)
        return found

    def _sorted(self, texts: Sequence[str], found: list[dict[str, Any]]) -> bool:
        """Put messages where they belong, answers into `found`; return whether there is an answer or a notice."""
        heard = False
        for message in map(json.loads, texts):
            if "refused" in message:
                raise LiveError("the server refuses", where=self.address, got=message["refused"])
            if "hello" in message:
                self.hello = message
                continue
            heard = True
            (self.notices if "notice" in message else found).append(message)
        return heard

    def replay(self, log: Recording | Log, *, speed: float = 1.0) -> Iterator[dict[str, Any]]:
        """Yield the answers to a recording's samples, sent at the pace of its time stamps.

        Samples that the server skips have no answer; when nothing has come for two seconds it is not waited for.

        Parameters
        ----------
        log : position and torque
        speed : times as fast as it was recorded; inf for as fast as the server grants

        Raises
        ------
        LiveError
            a log without torque, a speed that is none, or a server that refuses or never answers.
        """
        if log.tau is None or not speed > 0.0:
            raise LiveError("nothing to replay", where=self.address, expected="a log with torque and a speed above 0")
        times = log.t.tolist()
        place = {t: number for number, t in enumerate(times)}
        rows = zip(times, log.q.tolist(), log.tau.tolist(), strict=True)
        begin = latest = free = time.monotonic()
        sent = answered = 0
        while sent < len(times) or answered < len(times):
            now, due = time.monotonic(), np.inf
            if sent < len(times) and sent - answered < _AHEAD:
                due = max(begin + (times[sent] - times[0]) / speed, free)
            if due <= now:
                self.send(*next(rows))
                sent, latest, free = sent + 1, now, max(free, now - _BURST) + self._gap
                continue
            found = self.answers(min(_NAP, due - now))
            for answer in found:
                answered, latest = max(answered, place.get(answer["t"], -1) + 1), now
                yield answer
            if not found and now - latest > _QUIET:
                self._check_greeted()
                answered = sent

    def _check_greeted(self) -> None:
        if not self.hello:  # over UDP a server says nothing to whoever does not know its token
            raise LiveError(
                "nobody answers",
                where=self.address,
                remedy="check the address, and the token if the server asks for one",
            )

    @property
    def _gap(self) -> float:
        """Least time between samples [s]: a little more than the server grants, which it tells in its greeting."""
        return _CLOSER / float(self.hello.get("messages_a_second", _ASSUMED))
