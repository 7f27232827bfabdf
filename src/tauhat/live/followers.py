"""Clients that follow the robot which the server itself reads: its answers are theirs too, in their own outboxes."""

from __future__ import annotations

from collections.abc import Callable

from tauhat.live.outbox import Outbox
from tauhat.live.protocol import notice_text

_ANSWER = '{"t"'


def nobody(_: str) -> bool:
    """Zero nothing, where there is no robot's stream."""
    return False


class Followers:
    """Who is told what is said of the robot; a follower that reads slowly holds up nobody.

    Attributes
    ----------
    robot : its address, None where the server reads none
    state : what it does, as its link says
    command : zeroes or unzeroes the robot's stream; returns whether it has samples
    """

    def __init__(self) -> None:
        self.robot: str | None = None
        self.state = ""
        self.command: Callable[[str], bool] = nobody
        self._outboxes: set[Outbox] = set()

    def __contains__(self, outbox: Outbox) -> bool:
        return outbox in self._outboxes

    def add(self, outbox: Outbox) -> None:
        """Tell a client everything from now on."""
        self._outboxes.add(outbox)

    def leave(self, outbox: Outbox) -> None:
        """Tell a client nothing more."""
        self._outboxes.discard(outbox)

    def tell(self, text: str) -> None:
        """Pass on an answer or a notice."""
        answers = int(text.startswith(_ANSWER))
        for outbox in self._outboxes:
            outbox.put(text, answers=answers)

    def tell_state(self, state: str) -> None:
        """Say that the robot does something else now."""
        self.state = state
        self.tell(notice_text("robot", state=state))
