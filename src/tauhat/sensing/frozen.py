"""Samples of a controller that hangs: it repeats the last one with new time stamps.

What is filtered of such samples keeps changing, so nobody finds out from the answers. Position alone is no sign, since
coarse encoders of an arm at rest repeat it; measured torque hardly ever does. So both have to be the same to the bit,
many times in a row: a reader that asks faster than its robot tells gets each sample a few times.
"""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray

IN_A_ROW = 10  # samples like the one before them


def newly_frozen(alike: int) -> int:
    """Return how many samples the last of so many in a row makes known as frozen: none, all of them, or itself."""
    if alike < IN_A_ROW:
        return 0
    return alike if alike == IN_A_ROW else 1


def frozen_along(q: FloatArray, tau: FloatArray) -> int:
    """Return how many samples of a log are frozen.

    Parameters
    ----------
    q, tau : (n_t, n_v) of the samples that were taken
    """
    bits = (np.ascontiguousarray(values, dtype=np.float64).view(np.int64) for values in (q, tau))
    alike = np.logical_and(*((value[1:] == value[:-1]).all(axis=1) for value in bits))
    edges = np.flatnonzero(np.diff(np.concatenate(([False], alike, [False])).astype(np.int8)))
    lengths = edges[1::2] - edges[::2]
    return int(lengths[lengths >= IN_A_ROW].sum())
