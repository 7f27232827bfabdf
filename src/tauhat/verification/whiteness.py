"""How far a residual is from white noise: its colour inside the pass band, and how many independent rows it holds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray

_INSIDE = 0.7  # part of the pass band that is looked at: the filter's own slope is left out


class Whiteness(NamedTuple):
    """Colour of a residual; that of a model is never white, so that the size counts more than the p-value.

    colour : largest distance of the cumulative spectrum from that of white noise, 0 to 1: the share of the residual's
        power that sits at other frequencies than noise would
    p : of white noise showing as much colour
    effective : number of independent rows that the correlated ones are worth
    correlation_time : [s]
    """

    colour: float
    p: float
    effective: float
    correlation_time: float


def whiteness(residual: FloatArray, *, step: float, cutoff: float) -> Whiteness:
    """Return how far a residual is from white noise, by its cumulative periodogram below 0.7 of the cut-off.

    Unlike sums of autocorrelations (Ljung and Box) it is not moved by the low-pass that the rows went through.

    Parameters
    ----------
    residual : (n,) at equal steps
    step : [s]
    cutoff : of the low-pass [Hz]

    Source: Bartlett, "An introduction to stochastic processes", 1955; effective size: Geyer, "Practical Markov chain
    Monte Carlo", 1992.
    """
    from scipy.special import kolmogorov

    centred = residual - residual.mean()
    power = np.abs(np.fft.rfft(centred)) ** 2
    frequency = np.fft.rfftfreq(residual.size, step)
    inside = power[(frequency > 0.0) & (frequency < _INSIDE * cutoff)]
    redundancy = correlated_rows(centred)
    effective = residual.size / redundancy
    if inside.size < 3 or not inside.any():
        return Whiteness(0.0, 1.0, effective, redundancy * step)
    expected = np.arange(1, inside.size + 1) / inside.size
    colour = float(np.abs(np.cumsum(inside) / inside.sum() - expected).max())
    return Whiteness(colour, float(kolmogorov(np.sqrt(inside.size) * colour)), effective, redundancy * step)


def correlated_rows(centred: FloatArray) -> float:
    """Return how many rows are worth one independent one, at least one: the sum of the autocorrelation.

    Pairs of neighbouring lags are summed up to the first pair that is negative.
    """
    size = centred.size
    spectrum = np.abs(np.fft.rfft(centred, 2 * size)) ** 2
    covariance = np.fft.irfft(spectrum)[: size // 2]
    if covariance.size < 2 or covariance[0] <= 0.0:
        return 1.0
    pairs = (covariance / covariance[0])[: 2 * (covariance.size // 2)].reshape(-1, 2).sum(axis=1)
    ends = np.flatnonzero(pairs <= 0.0)
    return max(1.0, float(2.0 * pairs[: ends[0] if ends.size else pairs.size].sum() - 1.0))
