"""Simulation of elastic joints: the linear part exactly from step to step, dry friction of the motors held within it.

    x+ = T x + B (tau_k - coulomb tanh(dtheta / width))           x = (theta, dtheta, q, dq)

`linear` holds T (4 n_v, 4 n_v) and B (4 n_v, n_v) of one of `substeps` parts of the sampling step.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True, error_model="numpy")
def elastic_kernel(linear, friction, tau, substeps, out):  # type: ignore[no-untyped-def]
    """Fill `out` (n_t, 4 n_v) from rest at zero; `friction` (2, n_v) is coulomb and width, `tau` (n_t, n_v)."""
    transition, drive = linear
    n_t, n_v = tau.shape
    x, after, u = np.zeros(4 * n_v), np.empty(4 * n_v), np.empty(n_v)
    for k in range(n_t):
        out[k] = x
        for _ in range(substeps):
            for j in range(n_v):
                u[j] = tau[k, j] - friction[0, j] * np.tanh(x[n_v + j] / friction[1, j])
            _moved(transition, drive, x, u, after)
            x[:] = after


@njit(cache=True, nogil=True, error_model="numpy")
def _moved(transition, drive, x, u, after):  # type: ignore[no-untyped-def]
    """Fill `after` with T x + B u."""
    for i in range(x.size):
        total = 0.0
        for j in range(x.size):
            total += transition[i, j] * x[j]
        for j in range(u.size):
            total += drive[i, j] * u[j]
        after[i] = total
