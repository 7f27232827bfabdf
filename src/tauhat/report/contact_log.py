"""Contacts of a stream, from first to last touch, as far as the page was shown them: one row a contact."""

from __future__ import annotations

from collections import deque

from tauhat.sensing.touch import Touch

_KEPT = 50


class ContactLog:
    """The latest contacts, the newest first."""

    def __init__(self) -> None:
        self._contacts: deque[Touch] = deque(maxlen=_KEPT)

    @property
    def contacts(self) -> tuple[Touch, ...]:
        """The newest first; older ones than the last fifty are forgotten."""
        return tuple(self._contacts)

    def see(self, newest: Touch) -> None:
        """Take note of a contact of a stream as it is now: the latest that was seen, or a later one."""
        if self._contacts and self._contacts[0].number == newest.number:
            self._contacts[0] = newest
            return
        self.end()  # of the one before, if nothing of its end was shown
        self._contacts.appendleft(newest)

    def end(self) -> None:
        """Say that the contact that goes on, if there is one, ended when it was last seen."""
        if self._contacts:
            self._contacts[0] = self._contacts[0]._replace(open=False)
