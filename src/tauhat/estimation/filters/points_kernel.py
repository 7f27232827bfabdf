"""Forward dynamics of many states, each with bodies of its own: `ddq = M(q; x)^-1 (tau - b(q, dq; x))`.

A filter over parameters asks for the acceleration of as many robots as it has sigma points.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from tauhat.dynamics.forward_kernel import bias_and_mass, factorised, solved, sweep_outward


@njit(cache=True, nogil=True, error_model="numpy")
def points_kernel(links, bodies, states, out):  # type: ignore[no-untyped-def]
    """Fill `out` (n, n_v) from bodies ((n, n_v, 10), (n, n_v, n_v)) and q, dq, tau; return a failed point or -1."""
    inertia, rotor = bodies
    q, dq, tau = states
    n, n_v = q.shape
    work, bias, mass = np.empty(40 * n_v), np.empty(n_v), np.empty((n_v, n_v))
    for k in range(n):
        sweep_outward(links, inertia[k], q[k], dq[k], work)
        bias_and_mass(links, work, bias, mass)
        for i in range(n_v):
            for j in range(n_v):
                mass[i, j] += rotor[k, i, j]
            out[k, i] = tau[k, i] - bias[i]
        if factorised(mass) >= 0:
            return k
        solved(mass, out[k])
    return -1
