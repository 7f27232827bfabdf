"""Sensed force beside that of a real sensor: sizes only, so that axes, signs and mounting do not matter."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray

_LONGEST_LAG = 0.5  # [s] looked for either way
_FEWEST_RATE = 100.0  # [Hz] at which lags are looked for; faster logs are thinned
_LEAST = 20  # samples below which nothing is said


class BesideSensor(NamedTuple):
    """How the size of the sensed force compares with that of a measured one, at the lag that fits best.

    correlation : of the sizes
    lag : by which the sensed force is later [s]
    scale : slope of measured on sensed
    rms : of their difference [N]
    """

    correlation: float
    lag: float
    scale: float
    rms: float


def beside_sensor(sensed: FloatArray, measured: FloatArray, *, step: float) -> BesideSensor | None:
    """Return how sensed force compares with a measured one; None where one of them does not change or is not finite.

    Parameters
    ----------
    sensed, measured : (n_t, 3) [N], `step` seconds apart; behind starts left out
    """
    thin = max(1, int(1.0 / (step * _FEWEST_RATE)))
    ours, theirs = (np.linalg.norm(force[::thin], axis=1) for force in (sensed, measured))
    most = min(int(_LONGEST_LAG / (thin * step)), ours.size // 4)
    if ours.size < _LEAST or not np.isfinite(theirs).all() or not (np.ptp(ours) > 0.0 and np.ptp(theirs) > 0.0):
        return None
    lags = range(-most, most + 1)
    found = [_correlation(*_shifted(ours, theirs, lag)) for lag in lags]
    best = int(np.argmax(found))
    later, reference = _shifted(ours, theirs, lags[best])
    spread = later - later.mean()
    return BesideSensor(
        correlation=found[best],
        lag=lags[best] * thin * step,
        scale=float(spread @ reference / (spread @ spread)),
        rms=float(np.sqrt(np.mean((later - reference) ** 2))),
    )


def _shifted(ours: FloatArray, theirs: FloatArray, lag: int) -> tuple[FloatArray, FloatArray]:
    """Return both series where they overlap when ours is `lag` samples later."""
    n = ours.size - abs(lag)
    return ours[max(lag, 0) :][:n], theirs[max(-lag, 0) :][:n]


def _correlation(one: FloatArray, other: FloatArray) -> float:
    a, b = one - one.mean(), other - other.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / size if size > 0.0 else -1.0
