"""The steps of every Kalman filter as pure functions, and the watch that stops one which diverges."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ModelError
from tauhat.estimation.filters.forms import CovarianceForm, PlainCovariance
from tauhat.estimation.filters.spreading import BatchFunction, Extended, Spread, Spreading

_NARROWED = 5  # times that points without a mass matrix are drawn nearer to the mean


class Belief(NamedTuple):
    """A Gaussian: mean (n_x,) and what the filter's form keeps of the covariance, (n_x, n_x)."""

    mean: FloatArray
    kept: FloatArray


class Innovation(NamedTuple):
    """What a measurement said that was not expected.

    residual : (n_y,) measured less expected
    surprise : its squared size in the filter's own standard deviations, over n_y: about 1 when the filter is right
    """

    residual: FloatArray
    surprise: float


@dataclass(frozen=True, slots=True, kw_only=True)
class KalmanFilter:
    """A way through functions with a form of the covariance: what makes one of the six filters.

    spreading : extended, unscented or central difference
    form : plain or square root
    """

    spreading: Spreading = field(default_factory=Extended)
    form: CovarianceForm = field(default_factory=PlainCovariance)

    def start(self, mean: FloatArray, covariance: FloatArray) -> Belief:
        """Return the belief before the first sample; raise LinAlgError when the covariance is not positive."""
        return Belief(np.array(mean, dtype=np.float64), self.form.start(covariance))

    def predict(self, belief: Belief, transition: BatchFunction, noise: FloatArray) -> Belief:
        """Return the belief one step on: through `transition`, then with `noise` (n_x, k), columns of `N N'`."""
        spread = self._spread(transition, belief.mean, self.form.root(belief.kept))
        return Belief(spread.mean, self.form.predicted(spread.value, noise))

    def _spread(self, transition: BatchFunction, mean: FloatArray, root: FloatArray) -> Spread:
        """Return the Gaussian behind `transition`, with points drawn in while one of them is no robot."""
        spreading = self.spreading
        for _ in range(_NARROWED):
            try:
                return spreading.through(transition, mean, root)
            except np.linalg.LinAlgError:
                spreading = spreading.narrower()
        return spreading.through(transition, mean, root)

    def correct(
        self, belief: Belief, measure: BatchFunction, measured: FloatArray, noise: FloatArray
    ) -> tuple[Belief, Innovation]:
        """Return the belief after a measurement (n_y,) with `noise` (n_y, n_y), root of its covariance.

        Raises
        ------
        numpy.linalg.LinAlgError
            when a covariance has lost its positive definiteness.
        """
        spread = self.spreading.through(measure, belief.mean, self.form.root(belief.kept))
        gain = self.form.corrected(belief.kept, spread, noise)
        residual = measured - spread.mean
        scaled = np.linalg.solve(gain.root, residual)
        surprise = float(scaled @ scaled) / residual.size
        return Belief(belief.mean + gain.gain @ residual, gain.kept), Innovation(residual, surprise)

    def covariance(self, belief: Belief) -> FloatArray:
        """Return the covariance of a belief, (n_x, n_x)."""
        return self.form.covariance(belief.kept)


@dataclass(frozen=True, slots=True, kw_only=True)
class InnovationTest:
    """The watch on a filter: its mean surprise must not say that it believes too much.

    limit : largest mean surprise; a right filter has 1
    memory : number of samples over which it is averaged
    """

    limit: float = 100.0
    memory: int = 50

    def __post_init__(self) -> None:
        if not (self.limit > 1.0 and self.memory >= 1):
            raise ModelError(
                "innovation test", expected="limit above 1, memory of at least 1", got=f"{self.limit}, {self.memory}"
            )

    def averaged(self, before: float, surprise: float) -> float:
        """Return the mean surprise after one more sample."""
        return before + (surprise - before) / self.memory

    def verdict(self, belief: Belief, averaged: float) -> str:
        """Return why the filter must stop, empty while it need not."""
        if not (np.isfinite(belief.mean).all() and np.isfinite(belief.kept).all() and np.isfinite(averaged)):
            return "numbers grew beyond all bounds"
        if averaged > self.limit:
            return f"innovations are {np.sqrt(averaged):.0f} times as large as the filter expects"
        return ""
