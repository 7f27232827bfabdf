"""Contacts of a stream, from first to last touch, as far as the page was shown them."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace

_KEPT = 50


@dataclass(frozen=True, slots=True, kw_only=True)
class Contact:
    """One contact.

    link : that is touched
    begin, end : time stamps of the stream [s]; the end is that of its last sample while it lasts
    peak : largest force meanwhile [N]
    lasts : whether it goes on
    """

    link: str
    begin: float
    end: float
    peak: float
    lasts: bool = True


class ContactLog:
    """The latest contacts, the newest first."""

    def __init__(self) -> None:
        self._contacts: deque[Contact] = deque(maxlen=_KEPT)

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """The newest first; older ones than the last fifty are forgotten."""
        return tuple(self._contacts)

    def see(self, t: float, link: str, force: float) -> None:
        """Take note of one moment.

        Parameters
        ----------
        t : time stamp [s]
        link : that is touched, empty without contact; another link is another contact
        force : size of the force [N]
        """
        newest = self._contacts[0] if self._contacts else None
        if newest is not None and newest.lasts:
            if link == newest.link and t >= newest.begin:
                self._contacts[0] = replace(newest, end=t, peak=max(newest.peak, force))
                return
            self._contacts[0] = replace(newest, end=max(t, newest.end), lasts=False)
        if link:
            self._contacts.appendleft(Contact(link=link, begin=t, end=t, peak=force))
