"""What a motion is to the rest of the library: a function of time to position, velocity and acceleration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from tauhat.arrays import FloatArray, frozen


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MotionSamples:
    """A motion at given times.

    t : (n_t,) [s]
    q, dq, ddq : (n_t, n_v) [rad, rad/s, rad/s^2] or [m, m/s, m/s^2]
    """

    t: FloatArray
    q: FloatArray
    dq: FloatArray
    ddq: FloatArray

    def __post_init__(self) -> None:
        t = frozen("t", self.t, (None,))
        q = frozen("q", self.q, (t.size, None))
        object.__setattr__(self, "t", t)
        object.__setattr__(self, "q", q)
        for name in ("dq", "ddq"):
            object.__setattr__(self, name, frozen(name, getattr(self, name), q.shape))

    @property
    def n_t(self) -> int:
        """Number of samples."""
        return int(self.q.shape[0])

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return int(self.q.shape[1])


class Trajectory(Protocol):
    """A motion that starts at t = 0 and ends at t = `duration`."""

    @property
    def n_v(self) -> int:
        """Number of joints."""
        ...

    @property
    def duration(self) -> float:
        """Time from start to end [s]."""
        ...

    def sample(self, t: FloatArray) -> MotionSamples:
        """Return the motion at the times t, (n_t,) [s]."""
        ...
