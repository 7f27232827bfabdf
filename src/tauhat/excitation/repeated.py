"""A motion run several times without a pause."""

from __future__ import annotations

from dataclasses import dataclass

from tauhat.arrays import FloatArray
from tauhat.errors import ExcitationError
from tauhat.excitation.fourier import FourierSeries
from tauhat.excitation.trajectory import MotionSamples


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Repeated:
    """A Fourier motion run `periods` times: it passes each end at rest, so nothing jumps there."""

    series: FourierSeries
    periods: int

    def __post_init__(self) -> None:
        if self.periods < 1:
            raise ExcitationError("a motion is run at least once", got=self.periods)

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return self.series.n_v

    @property
    def duration(self) -> float:
        """Time from the first start to the last end [s]."""
        return self.periods * self.series.period

    def sample(self, t: FloatArray) -> MotionSamples:
        """Return the motion at the times t, (n_t,) [s]."""
        return self.series.sample(t)
