"""How many messages a second one client is granted, with bursts of a tenth of a second."""

from __future__ import annotations

_BURST = 0.1  # [s]


class Throttle:
    """A bucket that fills at a rate and holds a burst; a message takes one.

    Parameters
    ----------
    rate : messages a second
    """

    __slots__ = ("_free", "_period", "_reach")

    def __init__(self, rate: float) -> None:
        self._period = 1.0 / rate
        self._reach = max(_BURST, 2.0 * self._period)
        self._free = -float("inf")  # when the bucket will be full again [s]

    def wait(self, now: float) -> float:
        """Return how long until the next message is granted [s]; not above zero where it is."""
        return self._free - self._reach + self._period - now

    def take(self, now: float) -> float:
        """Take one and return how long the message after it has to wait [s]; not above zero where it need not."""
        self._free = max(self._free, now) + self._period
        return self.wait(now)
