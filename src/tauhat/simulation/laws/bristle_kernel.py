"""Bending of bristles, Dahl's model as the differential equation that it is.

    dz/dq = (1 - z) / x0 forwards,   dz/dq = (-1 - z) / x0 backwards,   z in -1 to 1

A displacement is passed in pieces of a tenth of x0 by the implicit midpoint rule; after forty x0 only the end is left.
"""

from __future__ import annotations

import numpy as np
from numba import njit

PIECES = 10.0  # to a length
ALL_BENT = 40.0  # lengths, behind which nothing of the start is left: exp(-40)


@njit(cache=True, nogil=True, error_model="numpy")
def bend(moved, length, z):  # type: ignore[no-untyped-def]
    """Carry the bending z (k, n_v) with lengths (k, n_v) along the displacements moved (n_v,)."""
    for j in range(moved.size):
        end = 1.0 if moved[j] > 0.0 else -1.0
        for i in range(z.shape[0]):
            lengths = abs(moved[j]) / length[i, j]
            if lengths > ALL_BENT:
                z[i, j] = end
                continue
            pieces = int(np.ceil(PIECES * lengths))
            for _ in range(pieces):
                step = lengths / pieces
                z[i, j] += step * (end - z[i, j]) / (1.0 + 0.5 * step)


@njit(cache=True, nogil=True, error_model="numpy")
def add_bent(peak, z, torque):  # type: ignore[no-untyped-def]
    """Add `sum_i peak_i z_i`, peak and z (k, n_v)."""
    for i in range(z.shape[0]):
        for j in range(z.shape[1]):
            torque[j] += peak[i, j] * z[i, j]
