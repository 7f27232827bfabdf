"""The numbers beside a logarithmic axis."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

_MOST = 13


def logarithmic_marks(values: ArrayLike) -> list[float]:
    """Return 1, 2, 5, 10 and so on around the values; over many decades powers of ten alone, at most 13 numbers.

    Plotly by itself writes 2 and 5 whatever the power of ten. Values that are not above zero do not count.
    """
    given = np.asarray(values, dtype=np.float64).ravel()
    shown = given[np.isfinite(given) & (given > 0.0)]
    exponents = np.log10(shown) if shown.size else np.zeros(1)
    decades = range(math.floor(exponents.min()), math.ceil(exponents.max()) + 1)
    steps = (1, 2, 5) if 3 * len(decades) <= _MOST else (1,)
    spacing = math.ceil(len(decades) * len(steps) / _MOST)
    return [float(f"{step}e{decade}") for decade in decades[::spacing] for step in steps]


def marked(values: ArrayLike) -> dict[str, list[float] | list[str]]:
    """Return what Plotly calls an axis with these numbers beside it."""
    marks = logarithmic_marks(values)
    return {"tickvals": marks, "ticktext": [f"{mark:g}" for mark in marks]}
