"""Sine sweeps: every joint oscillates, slowly and far at first, fast and little at the end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import ExcitationError
from tauhat.excitation.limits.joint_limits import MotionLimits
from tauhat.excitation.point_to_point import Quintic
from tauhat.excitation.trajectory import MotionSamples

_APART = 0.13  # by which part of the frequency neighbouring joints differ, so that they do not move as one
_GRID = 64  # samples a period of the fastest oscillation, on which limits are checked
_SLACK = 0.99  # of the limits: what lies between the samples of the grid


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sweep:
    """A sweep from rest to rest: `q = centre + amplitude w(t) exp(-k t) sin(phi(t))`, `phi' = 2 pi start exp(k t)`.

    The amplitude falls as the frequency grows, so that the speed stays and the acceleration grows. The window w rises
    and falls as a quintic over a tenth of the time.

    centre : (n_v,) [rad or m]
    amplitude : (n_v,) at the start [rad or m]
    start : (n_v,) first frequency of each joint [Hz]
    growth : k, over which the frequency grows e-fold [1/s]
    duration : [s]
    """

    centre: FloatArray
    amplitude: FloatArray
    start: FloatArray
    growth: float
    duration: float

    def __post_init__(self) -> None:
        centre = frozen("centre", self.centre, (None,), where="sweep")
        object.__setattr__(self, "centre", centre)
        for name in ("amplitude", "start"):
            object.__setattr__(self, name, frozen(name, getattr(self, name), centre.shape, where="sweep"))
        if not (self.start > 0.0).all() or not (0.0 < self.growth < np.inf and 0.0 < self.duration < np.inf):
            raise ExcitationError("sweep", expected="frequencies, growth and duration above zero")

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return int(self.centre.size)

    def sample(self, t: FloatArray) -> MotionSamples:
        """Return the motion at the times t, (n_t,) [s]."""
        w, dw, ddw = _window(t, self.duration)
        k, faded = self.growth, np.exp(-self.growth * t)
        g, dg, ddg = w * faded, (dw - k * w) * faded, (ddw - 2.0 * k * dw + k**2 * w) * faded
        rate = 2.0 * np.pi * np.multiply.outer(np.exp(k * t), self.start)
        phase = (rate - 2.0 * np.pi * self.start) / k
        sine, cosine = np.sin(phase), np.cos(phase)
        columns = [part[:, None] for part in (g, dg, ddg)]
        q = columns[0] * sine
        dq = columns[1] * sine + columns[0] * rate * cosine
        ddq = columns[2] * sine + (2.0 * columns[1] + k * columns[0]) * rate * cosine - columns[0] * rate**2 * sine
        return MotionSamples(
            t=t, q=self.centre + self.amplitude * q, dq=self.amplitude * dq, ddq=self.amplitude * ddq
        )  # fmt: skip


def sweep(limits: MotionLimits, *, duration: float, start: float = 0.1, end: float = 2.0, speed: float = 1.0) -> Sweep:
    """Return the largest sweep about the middle of the ranges inside all limits.

    Parameters
    ----------
    duration : [s]
    start, end : frequency of the first joint at both ends [Hz]; the others are a little faster
    speed : part of the limits that is used, in (0, 1]

    Raises
    ------
    ExcitationError
        when the frequencies do not rise, or the speed is out of range.
    """
    if not 0.0 < start < end < np.inf or not 0.0 < duration < np.inf or not 0.0 < speed <= 1.0:
        raise ExcitationError(
            "sweep", expected="0 < start < end, a duration above zero, 0 < speed <= 1",
            got=f"{start:g} to {end:g} Hz in {duration:g} s, speed {speed:g}",
        )  # fmt: skip
    n_v = limits.lower.size
    apart = np.asarray(1.0 + _APART * np.arange(n_v), dtype=np.float64)
    unit = Sweep(
        centre=np.zeros(n_v), amplitude=np.ones(n_v), start=start * apart,
        growth=float(np.log(end / start)) / duration, duration=duration,
    )  # fmt: skip
    fastest = end * float(unit.start.max()) / start
    motion = unit.sample(np.linspace(0.0, duration, int(np.ceil(_GRID * fastest * duration)) + 1))
    room = np.array([0.5 * (limits.upper - limits.lower), limits.velocity, limits.acceleration])
    used = np.array([np.abs(part).max(axis=0) for part in (motion.q, motion.dq, motion.ddq)])
    amplitude = _SLACK * speed * (room / used).min(axis=0)
    return Sweep(
        centre=0.5 * (limits.lower + limits.upper), amplitude=amplitude, start=unit.start, growth=unit.growth,
        duration=duration,
    )  # fmt: skip


def _window(t: FloatArray, duration: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the window and its derivatives, (n_t,) each."""
    edge = 0.1 * duration
    rise = Quintic().course(np.clip(t / edge, 0.0, 1.0))
    fall = Quintic().course(np.clip((duration - t) / edge, 0.0, 1.0))
    first = t < 0.5 * duration
    return (
        np.where(first, rise.s, fall.s),
        np.where(first, rise.ds, -fall.ds) / edge,
        np.where(first, rise.dds, fall.dds) / edge**2,
    )
