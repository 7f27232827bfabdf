"""Connections that have not said yet who they are: a bounded number, and a newcomer takes the place of the oldest.

So nobody is kept out by those who connect and say nothing: an honest client is through in milliseconds.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable


class WaitingRoom:
    """Room for so many.

    Parameters
    ----------
    room : how many
    """

    def __init__(self, room: int) -> None:
        self._room = room
        self._waiting: dict[Hashable, Callable[[], object]] = {}

    def __len__(self) -> int:
        return len(self._waiting)

    def enter(self, who: Hashable, *, hang_up: Callable[[], object]) -> None:
        """Let in, and send away whoever has waited longest where there is no room.

        Parameters
        ----------
        hang_up : ends the connection
        """
        self._waiting[who] = hang_up
        if len(self._waiting) > self._room:
            oldest = next(iter(self._waiting))
            self._waiting.pop(oldest)()

    def leave(self, who: Hashable) -> None:
        """Forget one that is a client now, or gone."""
        self._waiting.pop(who, None)
