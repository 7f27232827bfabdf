"""Ninety-five percent intervals of the parameters."""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.estimation.estimate import Estimate


def relative_halves(estimate: Estimate) -> FloatArray:
    """Return the half intervals over the size of the values, (n_b,); infinite where a value is zero."""
    size = np.abs(estimate.values)
    relative = np.full(size.shape, np.inf)
    np.divide(estimate.half_intervals(), size, out=relative, where=size > 0)
    return relative
