"""Ninety-five percent intervals of the parameters."""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.estimation.estimate import Estimate

CONFIDENCE = 0.95


def half_intervals(estimate: Estimate) -> FloatArray:
    """Return half of each base parameter's 95 % interval, (n_b,), by Student's t with the estimate's degrees."""
    from scipy.special import stdtrit

    factor = float(stdtrit(max(1, estimate.degrees), 0.5 + 0.5 * CONFIDENCE))
    half: FloatArray = factor * estimate.standard_errors
    return half


def relative_halves(estimate: Estimate) -> FloatArray:
    """Return the half intervals over the size of the values, (n_b,); infinite where a value is zero."""
    size = np.abs(estimate.values)
    relative = np.full(size.shape, np.inf)
    np.divide(half_intervals(estimate), size, out=relative, where=size > 0)
    return relative
