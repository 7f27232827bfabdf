"""What the page is shown: the newest of the streams, at most thirty times a second.

A stream asks whether it is due, which costs less than a microsecond, and only then makes a snapshot.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

from tauhat.arrays import FloatArray
from tauhat.sensing.touch import Touch

A_SECOND = 30.0  # snapshots, over all streams


class Snapshot(NamedTuple):
    """One moment of one stream.

    stream : its name
    t : time stamp [s]
    q, tau : (n_v,) position, and external torque less what was zeroed [rad or m, Nm or N]
    tau_std : (n_v,) its standard error
    wrench, covariance : (6,), (6, 6) at the sensor's frame [N, Nm]
    contacts : those that have ended since the last snapshot that was shown, the newest sixteen, and last the one that
        goes on, if there is one
    counts : taken, late, not_finite, dropped, refused, restarts, frozen
    """

    stream: str
    t: float
    q: FloatArray
    tau: FloatArray
    tau_std: FloatArray
    wrench: FloatArray
    covariance: FloatArray
    contacts: tuple[Touch, ...]
    counts: dict[str, int]


class Page(Protocol):
    """Whatever shows snapshots: the browser's page, in a process of its own."""

    @property
    def url(self) -> str:
        """Where it is seen."""

    def send(self, snapshot: Snapshot, /) -> bool:
        """Show a snapshot, or leave it where that would have to wait; return whether it is shown."""

    def end(self, stream: str, contacts: tuple[Touch, ...], /) -> None:
        """Say that a stream that was shown has ended, and with which contacts since, without waiting."""

    def commands(self) -> list[str]:
        """Return what was asked for since the last call, at once."""

    def close(self) -> None:
        """End it."""


class Feed:
    """Between streams and a page; without one it does nothing.

    Parameters
    ----------
    page : shows what is published
    """

    def __init__(self, page: Page | None = None) -> None:
        self._page = page
        self._due: dict[str, float] = {}

    @property
    def url(self) -> str | None:
        """Where the page is seen, None without one."""
        return None if self._page is None else self._page.url

    def is_due(self, stream: str, now: float) -> bool:
        """Return whether a stream's next snapshot is wanted; streams take turns.

        Parameters
        ----------
        now : on any clock [s]
        """
        if self._page is None or now < self._due.get(stream, -float("inf")):
            return False
        self._due[stream] = now
        self._due[stream] += len(self._due) / A_SECOND
        return True

    def publish(self, snapshot: Snapshot) -> bool:
        """Show a snapshot; return whether it is shown."""
        return self._page is not None and self._page.send(snapshot)

    def commands(self) -> list[str]:
        """Return what was asked for on the page since the last call."""
        return [] if self._page is None else self._page.commands()

    def forget(self, stream: str, contacts: tuple[Touch, ...] = ()) -> None:
        """Leave the turns to other streams: this one has ended, and where it was shown that is said.

        Parameters
        ----------
        contacts : that were not shown yet
        """
        if self._due.pop(stream, None) is not None and self._page is not None:
            self._page.end(stream, contacts)

    def close(self) -> None:
        """End the page."""
        if self._page is not None:
            self._page.close()
