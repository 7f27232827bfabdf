"""Thinning of long series that hides no peak."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from tauhat.arrays import FloatArray, IntArray

MOST_POINTS = 4000  # per trace: more than a screen has columns, few enough to zoom without delay


def thinned(values: FloatArray, *, most: int = MOST_POINTS) -> IntArray:
    """Return increasing indices, at most `most`, that keep the smallest and the largest value of every stretch.

    The first and last sample stay. A series that is short enough is kept whole.

    Parameters
    ----------
    values : (n,) in the order in which they are drawn
    most : largest number of indices, at least 4
    """
    n = values.size
    if n <= most:
        return np.arange(n)
    bounds = np.linspace(0, n, (most - 2) // 2 + 1).astype(np.intp)
    kept = [0, n - 1]
    for start, stop in pairwise(bounds.tolist()):
        stretch = values[start:stop]
        kept += [start + int(stretch.argmin()), start + int(stretch.argmax())]
    return np.unique(np.array(kept, dtype=np.intp))


def thinned_cloud(x: FloatArray, y: FloatArray, *, most: int = MOST_POINTS) -> IntArray:
    """Return indices, at most `most`, of a cloud's points: its envelope along x, and as many evenly spread samples.

    The envelope alone would look as if every point were an outlier; even samples alone would hide the outliers.

    Parameters
    ----------
    x, y : (n,)
    most : largest number of indices, at least 8
    """
    n = x.size
    if n <= most:
        return np.arange(n)
    along = np.argsort(x, kind="stable")
    envelope = along[thinned(y[along], most=most // 2)]
    spread = np.linspace(0, n - 1, most // 2).astype(np.intp)
    return np.union1d(envelope, spread)
