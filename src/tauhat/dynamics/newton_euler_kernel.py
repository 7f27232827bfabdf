"""Inverse dynamics by recursive Newton-Euler in blocks of 64 samples.

Outward: `sweep_kernel`. Per link, with `m, h = m c, I` about the link's origin (standard parameters):
    f = m a + dw x h + w x (w x h)          n = I dw + w x (I w) + h x a
Inward: tau_i = e.n_i (revolute) or e.f_i (prismatic);  f_p += R f,  n_p += R n + P x (R f).

Layout as in `sweep_kernel`; `pose[768 * i]` keeps R, P of every link, `wrench[384 * i]` its f, n.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from tauhat.dynamics.block_kernel import load_block
from tauhat.dynamics.sweep_kernel import sweep_link


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def newton_euler_kernel(links, inertia, q, dq, ddq, out):  # type: ignore[no-untyped-def]
    """Fill `out` (n_v, n_t) with joint torques from `inertia` (n_v, 10) and `q`, `dq`, `ddq` (n_v, n_t)."""
    n_v, n_t = q.shape
    x = np.empty(64 * 56)
    state = np.empty(576 * n_v)
    pose = np.empty(768 * n_v)
    wrench = np.empty(384 * n_v)
    block = np.zeros((5, n_v, 64))
    for start in range(0, n_t, 64):
        size = min(64, n_t - start)
        load_block(start, size, q, dq, ddq, block)
        for i in range(n_v):
            sweep_link(i, links, block, x, state)
            kept = pose[768 * i : 768 * i + 768]
            for k in range(768):
                kept[k] = x[k]
            _link_wrench(i, inertia, x, wrench)
        for i in range(n_v - 1, -1, -1):
            link = links[i]
            base = 384 * i + (0 if link.prismatic else 192)
            along = wrench[base : base + 192]
            torque = out[i, start : start + size]
            e0, e1, e2 = link.axis[0], link.axis[1], link.axis[2]
            for s in range(size):
                torque[s] = e0 * along[s] + e1 * along[64 + s] + e2 * along[128 + s]
            if link.parent >= 0:
                _hand_inward(i, link.parent, pose, wrench, x)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _link_wrench(i, inertia, x, wrench):  # type: ignore[no-untyped-def]
    m, h0, h1, h2 = inertia[i, 0], inertia[i, 1], inertia[i, 2], inertia[i, 3]
    xx, xy, yy = inertia[i, 4], inertia[i, 5], inertia[i, 6]
    xz, yz, zz = inertia[i, 7], inertia[i, 8], inertia[i, 9]
    for s in range(64):
        w0, w1, w2 = x[64 * 21 + s], x[64 * 22 + s], x[64 * 23 + s]
        d0, d1, d2 = x[64 * 24 + s], x[64 * 25 + s], x[64 * 26 + s]
        a0, a1, a2 = x[64 * 27 + s], x[64 * 28 + s], x[64 * 29 + s]
        c0, c1, c2 = w1 * h2 - w2 * h1, w2 * h0 - w0 * h2, w0 * h1 - w1 * h0
        g0, g1, g2 = xx * w0 + xy * w1 + xz * w2, xy * w0 + yy * w1 + yz * w2, xz * w0 + yz * w1 + zz * w2
        x[64 * 33 + s] = m * a0 + d1 * h2 - d2 * h1 + w1 * c2 - w2 * c1
        x[64 * 34 + s] = m * a1 + d2 * h0 - d0 * h2 + w2 * c0 - w0 * c2
        x[64 * 35 + s] = m * a2 + d0 * h1 - d1 * h0 + w0 * c1 - w1 * c0
        x[64 * 36 + s] = xx * d0 + xy * d1 + xz * d2 + w1 * g2 - w2 * g1 + h1 * a2 - h2 * a1
        x[64 * 37 + s] = xy * d0 + yy * d1 + yz * d2 + w2 * g0 - w0 * g2 + h2 * a0 - h0 * a2
        x[64 * 38 + s] = xz * d0 + yz * d1 + zz * d2 + w0 * g1 - w1 * g0 + h0 * a1 - h1 * a0
    kept = wrench[384 * i : 384 * i + 384]
    for k in range(384):
        kept[k] = x[64 * 33 + k]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _hand_inward(i, p, pose, wrench, x):  # type: ignore[no-untyped-def]
    placed, carried = pose[768 * i : 768 * i + 768], wrench[384 * i : 384 * i + 384]
    onto = wrench[384 * p : 384 * p + 384]
    for k in range(768):
        x[k] = placed[k]
    for k in range(384):
        x[64 * 12 + k] = carried[k]
    for s in range(64):
        f0, f1, f2 = x[64 * 12 + s], x[64 * 13 + s], x[64 * 14 + s]
        n0, n1, n2 = x[64 * 15 + s], x[64 * 16 + s], x[64 * 17 + s]
        p0, p1, p2 = x[64 * 9 + s], x[64 * 10 + s], x[64 * 11 + s]
        F0 = x[s] * f0 + x[64 + s] * f1 + x[64 * 2 + s] * f2
        F1 = x[64 * 3 + s] * f0 + x[64 * 4 + s] * f1 + x[64 * 5 + s] * f2
        F2 = x[64 * 6 + s] * f0 + x[64 * 7 + s] * f1 + x[64 * 8 + s] * f2
        x[64 * 33 + s] = F0
        x[64 * 34 + s] = F1
        x[64 * 35 + s] = F2
        x[64 * 36 + s] = x[s] * n0 + x[64 + s] * n1 + x[64 * 2 + s] * n2 + p1 * F2 - p2 * F1
        x[64 * 37 + s] = x[64 * 3 + s] * n0 + x[64 * 4 + s] * n1 + x[64 * 5 + s] * n2 + p2 * F0 - p0 * F2
        x[64 * 38 + s] = x[64 * 6 + s] * n0 + x[64 * 7 + s] * n1 + x[64 * 8 + s] * n2 + p0 * F1 - p1 * F0
    for k in range(384):
        onto[k] += x[64 * 33 + k]
