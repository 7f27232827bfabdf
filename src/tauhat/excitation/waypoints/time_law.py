"""How far along a curve a motion is at each time: cubic polynomials, one after the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import ExcitationError
from tauhat.excitation.point_to_point import Course

_LEAST_TIME = 1e-12  # [s]


class RateLimits(NamedTuple):
    """Largest derivatives of a fraction of a way: by time [1/s], [1/s^2] and [1/s^3]."""

    speed: float
    acceleration: float
    jerk: float

    def slowed(self, factor: float) -> RateLimits:
        """Return the limits of the same motion with its time stretched by 1 / factor."""
        return RateLimits(self.speed * factor, self.acceleration * factor**2, self.jerk * factor**3)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TimeLaw:
    """A fraction of a way by time: phases of constant jerk.

    begin : (n,) when each phase begins, from 0 on [s]
    state : (n, 4) fraction, speed, acceleration and jerk at the beginning of each phase
    duration : [s]
    """

    begin: FloatArray
    state: FloatArray
    duration: float

    def __post_init__(self) -> None:
        begin = frozen("begin", self.begin, (None,), where="time law")
        object.__setattr__(self, "begin", begin)
        object.__setattr__(self, "state", frozen("state", self.state, (begin.size, 4), where="time law"))
        if not begin.size or begin[0] != 0.0 or (np.diff(begin) <= 0.0).any() or not begin[-1] < self.duration:
            raise ExcitationError("time law", expected="phases that begin at 0 and one after the other")

    def course(self, t: FloatArray) -> Course:
        """Return the fraction and its derivatives at the times t, (n_t,) [s]."""
        phase = np.clip(np.searchsorted(self.begin, t, side="right") - 1, 0, self.begin.size - 1)
        s, ds, dds, jerk = self.state[phase].T
        u = t - self.begin[phase]
        return Course(s + u * (ds + u * (dds / 2.0 + u * jerk / 6.0)), ds + u * (dds + u * jerk / 2.0), dds + u * jerk)

    def within(self, phase: int, parts: FloatArray) -> tuple[FloatArray, Course]:
        """Return times and course at parts from 0 to 1 of one phase, its two ends as limits from inside."""
        ends = np.append(self.begin, self.duration)
        u = parts * (ends[phase + 1] - ends[phase])
        s, ds, dds, jerk = self.state[phase]
        position = s + u * (ds + u * (dds / 2.0 + u * jerk / 6.0))
        return ends[phase] + u, Course(position, ds + u * (dds + u * jerk / 2.0), dds + u * jerk)


def law_of_phases(start: float, rate: float, phases: list[tuple[float, float, float]]) -> TimeLaw:
    """Return the law that begins at a fraction and rate and runs through phases of time, acceleration and jerk.

    Phases shorter than rounding are left out.
    """
    begin, states, now, s, ds = [], [], 0.0, start, rate
    for time, acceleration, jerk in phases:
        if time <= _LEAST_TIME:
            continue
        begin.append(now)
        states.append((s, ds, acceleration, jerk))
        s += time * (ds + time * (acceleration / 2.0 + time * jerk / 6.0))
        ds += time * (acceleration + time * jerk / 2.0)
        now += time
    return TimeLaw(begin=np.array(begin), state=np.array(states), duration=now)


def steady(duration: float) -> TimeLaw:
    """Return the law that runs from 0 to 1 at constant speed."""
    return law_of_phases(0.0, 1.0 / duration, [(duration, 0.0, 0.0)])
