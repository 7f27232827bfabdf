"""The torque of a whole model at one state: `M(q) a + b(q, v) + Ia a + passive(q_p, v_p)`.

Rigid links and rotors are at the state (q, v, a); friction, springs and offsets at (q_p, v_p), which may be another
one: that of a reference, where measured speeds are too noisy for a sign. The load that friction may grow with is
`|M a + b|`. Bristles bend by the displacement since the step before, exactly, whatever its size (`passive_kernel`).

Arguments in tuples: `body` are links, inertia (n_v, 10), rotor (n_v, n_v), elements of `passive_kernel`; `state` q, v,
a; `passing` q_p, v_p and the displacement, (n_v,) each. Changed: `bent` (n_elements,). Filled: `out` (n_v,).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from tauhat.dynamics.forward_kernel import bias_and_mass, sweep_outward
from tauhat.dynamics.passive_kernel import DAHL, LOAD_DAHL, bent_by, passive_kernel, turned_by


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def model_torque_kernel(body, state, passing, bent, out):  # type: ignore[no-untyped-def]
    """Fill `out` with the model's torque; see the head of this file."""
    links, inertia, rotor, elements = body
    q, v, a = state
    n_v = q.size
    work, bias, mass = np.empty(40 * n_v), np.empty(n_v), np.empty((n_v, n_v))
    load, passive = np.empty(n_v), np.empty((3, n_v))
    sweep_outward(links, inertia, q, v, work)
    bias_and_mass(links, work, bias, mass)
    for i in range(n_v):
        out[i] = bias[i]
        for j in range(n_v):
            out[i] += mass[i, j] * a[j]
        load[i] = abs(out[i])
        for j in range(n_v):
            out[i] += rotor[i, j] * a[j]
    bend_kernel(elements, passing[2], bent)
    passive_kernel(elements, passing[0], passing[1], load, bent, passive)
    for i in range(n_v):
        out[i] += passive[0, i]


@njit(cache=True, nogil=True, error_model="numpy")
def bend_kernel(elements, moved, bent):  # type: ignore[no-untyped-def]
    """Change the states of the bristles, `bent` (n_elements,), by a displacement of the joints `moved` (n_v,)."""
    for k in range(elements.size):
        if elements[k].kind == DAHL or elements[k].kind == LOAD_DAHL:
            bent[k] = bent_by(turned_by(elements[k], moved), elements[k].shape, bent[k])


@njit(cache=True, nogil=True, error_model="numpy")
def element_columns_kernel(elements, state, bent, out):  # type: ignore[no-untyped-def]
    """Fill `out` (n_elements, n_v) with the torque of each element alone at `state` q, v (n_v,), under no load."""
    q, v = state
    taken, load = np.empty((3, q.size)), np.zeros(q.size)
    for k in range(elements.size):
        passive_kernel(elements[k : k + 1], q, v, load, bent[k : k + 1], taken)
        out[k] = taken[0]
