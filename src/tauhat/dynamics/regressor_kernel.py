"""The joint torque regressor in blocks of 64 samples.

For link i and each joint j that carries it, with `z` the axis of joint j and `u` the velocity of link i's origin per
unit speed of joint j, both in link i's frame, and `w, dw, a` of the outward sweep:
    Y[j, m]    = u.a
    Y[j, m c]  = -(dw x u) + w x (w x u) + a x z
    Y[j, I]    = z.(dI dw) + y.(dI w)  with y = z x w:  Ixx: z0 dw0 + y0 w0,  Ixy: z0 dw1 + z1 dw0 + y0 w1 + y1 w0, ...
Going one link outward only the six numbers (z, u) turn: `z = R'z_p, u = R'(u_p + z_p x P)`; own axis: revolute
`z = e, u = 0`, prismatic `z = 0, u = e`. Output order is Pinocchio's: m, mx, my, mz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz.

Layout as in `sweep_kernel`; slots 42-51 hold the ten entries of one joint and link before they go out.
`axes[384 * (n_v * i + j)]` keeps z, u of joint j seen from link i.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from tauhat.dynamics.block_kernel import load_block
from tauhat.dynamics.sweep_kernel import sweep_link


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def regressor_kernel(links, q, dq, ddq, out):  # type: ignore[no-untyped-def]
    """Fill `out` (10 n_v, n_v, n_t) from `q`, `dq`, `ddq` (n_v, n_t). Rows of links that do not load a joint stay."""
    n_v, n_t = q.shape
    x = np.empty(64 * 56)
    state = np.empty(576 * n_v)
    axes = np.empty(384 * n_v * n_v)
    block = np.zeros((5, n_v, 64))
    for start in range(0, n_t, 64):
        size = min(64, n_t - start)
        window = (start, size)
        load_block(start, size, q, dq, ddq, block)
        for i in range(n_v):
            p = links[i].parent
            sweep_link(i, links, block, x, state)
            j = p
            while j >= 0:
                inner, outer = 384 * (n_v * p + j), 384 * (n_v * i + j)
                seen = axes[outer : outer + 384]
                carry_axis(axes[inner : inner + 384], seen, x)
                _write_columns(i, j, window, seen, x, out)
                j = links[j].parent
            own = 384 * (n_v * i + i)
            seen = axes[own : own + 384]
            own_axis(links[i], seen)
            _write_columns(i, i, window, seen, x, out)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def carry_axis(inner, outer, x):  # type: ignore[no-untyped-def]
    """Turn z, u of one joint from the parent's frame into the link's."""
    for s in range(64):
        z0, z1, z2 = inner[s], inner[64 + s], inner[64 * 2 + s]
        p0, p1, p2 = x[64 * 9 + s], x[64 * 10 + s], x[64 * 11 + s]
        u0 = inner[64 * 3 + s] + z1 * p2 - z2 * p1
        u1 = inner[64 * 4 + s] + z2 * p0 - z0 * p2
        u2 = inner[64 * 5 + s] + z0 * p1 - z1 * p0
        outer[s] = x[s] * z0 + x[64 * 3 + s] * z1 + x[64 * 6 + s] * z2
        outer[64 + s] = x[64 + s] * z0 + x[64 * 4 + s] * z1 + x[64 * 7 + s] * z2
        outer[64 * 2 + s] = x[64 * 2 + s] * z0 + x[64 * 5 + s] * z1 + x[64 * 8 + s] * z2
        outer[64 * 3 + s] = x[s] * u0 + x[64 * 3 + s] * u1 + x[64 * 6 + s] * u2
        outer[64 * 4 + s] = x[64 + s] * u0 + x[64 * 4 + s] * u1 + x[64 * 7 + s] * u2
        outer[64 * 5 + s] = x[64 * 2 + s] * u0 + x[64 * 5 + s] * u1 + x[64 * 8 + s] * u2


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def own_axis(link, own):  # type: ignore[no-untyped-def]
    """Fill z, u of a link's own joint."""
    e0, e1, e2 = link.axis[0], link.axis[1], link.axis[2]
    turn = 0.0 if link.prismatic else 1.0
    slide = 1.0 - turn
    for s in range(64):
        own[s] = turn * e0
        own[64 + s] = turn * e1
        own[64 * 2 + s] = turn * e2
        own[64 * 3 + s] = slide * e0
        own[64 * 4 + s] = slide * e1
        own[64 * 5 + s] = slide * e2


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _write_columns(i, j, window, seen, x, out):  # type: ignore[no-untyped-def]
    start, size = window
    for s in range(64):
        w0, w1, w2 = x[64 * 21 + s], x[64 * 22 + s], x[64 * 23 + s]
        d0, d1, d2 = x[64 * 24 + s], x[64 * 25 + s], x[64 * 26 + s]
        a0, a1, a2 = x[64 * 27 + s], x[64 * 28 + s], x[64 * 29 + s]
        z0, z1, z2 = seen[s], seen[64 + s], seen[64 * 2 + s]
        u0, u1, u2 = seen[64 * 3 + s], seen[64 * 4 + s], seen[64 * 5 + s]
        y0, y1, y2 = z1 * w2 - z2 * w1, z2 * w0 - z0 * w2, z0 * w1 - z1 * w0
        c0, c1, c2 = w1 * u2 - w2 * u1, w2 * u0 - w0 * u2, w0 * u1 - w1 * u0
        x[64 * 42 + s] = u0 * a0 + u1 * a1 + u2 * a2
        x[64 * 43 + s] = u1 * d2 - u2 * d1 + w1 * c2 - w2 * c1 + a1 * z2 - a2 * z1
        x[64 * 44 + s] = u2 * d0 - u0 * d2 + w2 * c0 - w0 * c2 + a2 * z0 - a0 * z2
        x[64 * 45 + s] = u0 * d1 - u1 * d0 + w0 * c1 - w1 * c0 + a0 * z1 - a1 * z0
        x[64 * 46 + s] = z0 * d0 + y0 * w0
        x[64 * 47 + s] = z0 * d1 + z1 * d0 + y0 * w1 + y1 * w0
        x[64 * 48 + s] = z1 * d1 + y1 * w1
        x[64 * 49 + s] = z0 * d2 + z2 * d0 + y0 * w2 + y2 * w0
        x[64 * 50 + s] = z1 * d2 + z2 * d1 + y1 * w2 + y2 * w1
        x[64 * 51 + s] = z2 * d2 + y2 * w2
    for k in range(10):
        row = out[10 * i + k, j, start : start + size]
        base = 64 * (42 + k)
        for s in range(size):
            row[s] = x[base + s]
