"""The latest contact of a stream while it comes: what `ContactDetector.along` says of a log's contacts, so far."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from tauhat.arrays import FloatArray
    from tauhat.sensing.contact import ContactDetector, ContactMemory


class Touch(NamedTuple):
    """One contact, so far.

    number : along the stream, from one on
    link : the link that is touched, or one further out: as of `ContactEvent`, by all samples so far
    start, end : time stamps of its first and its latest sample [s]
    peak : largest force meanwhile, as it is told: not less that before the start, as `ContactEvent.peak` is [N]
    open : whether it goes on
    """

    number: int
    link: str
    start: float
    end: float
    peak: float
    open: bool


class TouchFollower:
    """Follows the contacts of a stream, sample by sample behind the detector's.

    Parameters
    ----------
    detector : that tells of contact

    Attributes
    ----------
    newest : the latest contact, None before the first
    """

    __slots__ = ("_detector", "_told", "newest")

    def __init__(self, detector: ContactDetector) -> None:
        self.newest: Touch | None = None
        self._detector = detector
        self._told: FloatArray = np.zeros(detector.thresholds.n_v)

    def see(self, t: float, memory: ContactMemory, force: float) -> str | None:
        """Take note of a sample; return `start` or `end` where a contact begins or has ended, else None.

        Parameters
        ----------
        t : time stamp [s]
        memory : of the detector behind the sample
        force : size of the force [N]
        """
        newest, touched = self.newest, bool(memory.state[0])
        if newest is None or not newest.open:
            if not touched:
                return None
            self._told = memory.rows[1].copy()
            number = 1 if newest is None else newest.number + 1
            self.newest = Touch(number, self._detector.link_of(self._told), t, t, force, open=True)
            return "start"
        if not touched:
            self.newest = newest._replace(open=False)
            return "end"
        self._told = np.maximum(self._told, memory.rows[1])
        link, peak = self._detector.link_of(self._told), max(newest.peak, force)
        self.newest = newest._replace(link=link, end=t, peak=peak)
        return None
