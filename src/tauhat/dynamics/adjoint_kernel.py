"""The adjoint of the regressor: gradients with respect to the motion, in blocks of 64 samples.

For a scalar f of the regressor with sensitivities `Ybar = df/dY`, the gradient with respect to q, dq, ddq is Newton-Euler
with virtual inertial parameters. For link i and joint j that carries it let (b, B, S) be the ten entries of Ybar[i, j] as
mass, first moment and symmetric matrix, with z, u, w, d = dw, a as in `regressor_kernel`:
    ubar += b a + d x B + w x (w x B)      zbar += B x a + S d + w x S w      abar += b u + z x B      dbar += B x u + S z
    wbar += u (w.B) + B (w.u) - 2 w (u.B) + (S w) x z + S (z x w)
Across joint i, with x = R'w_p, g = R'd_p, A = R abar, and a sum over the joints j that carry the parent:
    revolute   ddqbar = e.dbar    dqbar = e.wbar + (x x e).dbar    xbar = wbar + dq (e x dbar)
               qbar = e.(xbar x x + dbar x g + abar x a + sum zbar_j x z_j + ubar_j x u_j)
    prismatic  ddqbar = e.abar    dqbar = 2 (x x e).abar           xbar = wbar + 2 dq (e x abar)
               qbar = D.(A x d_p + w_p (w_p.A) - A w_p^2 + sum R ubar_j x z_p,j),   D = R0 e
    parent     abar += A    dbar += R dbar + P x A    wbar += R xbar + A (w_p.P) + P (w_p.A) - 2 w_p (A.P)
               ubar_j += R ubar_j    zbar_j += R zbar_j + P x R ubar_j
No derivative of R is needed.

Layout as in `sweep_kernel`; slots 33-35 qbar, dqbar, ddqbar, 36-38 xbar, 39-41 A. `kept[1536 * i]` are link i's R and P, from
768 on its x, from 960 on the bars of w d a; `axes[768 * (n_v * i + j)]` z, u of joint j seen from link i, from 384 on their bars.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from tauhat.dynamics.block_kernel import load_block
from tauhat.dynamics.regressor_kernel import carry_axis, own_axis
from tauhat.dynamics.sweep_kernel import sweep_link


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def adjoint_kernel(links, q, dq, ddq, ybar, gradient):  # type: ignore[no-untyped-def]
    """Add df/dq, df/ddq, df/dddq to the `gradient` (n_v, n_t) each, from `ybar` (10 n_v, n_v, n_t).

    Entries of `ybar` that are never loaded are ignored.
    """
    q_out, dq_out, ddq_out = gradient
    n_v, n_t = q.shape
    x = np.zeros(64 * 56)
    state, kept, axes = np.zeros(576 * n_v), np.zeros(1536 * n_v), np.zeros(768 * n_v * n_v)
    block = np.zeros((5, n_v, 64))
    bars = np.zeros(640)
    for start in range(0, n_t, 64):
        size = min(64, n_t - start)
        load_block(start, size, q, dq, ddq, block)
        for i in range(n_v):
            sweep_link(i, links, block, x, state)
            _keep(x, kept[1536 * i : 1536 * i + 1536])
            _see_axes(i, links, axes, x)
        for i in range(n_v - 1, -1, -1):
            link, link_bar = state[576 * i : 576 * i + 576], kept[1536 * i + 960 : 1536 * i + 1536]
            j = i
            while j >= 0:
                _load_bars(i, j, start, size, ybar, bars)
                _pull_columns(bars, _of(axes, n_v, i, j), link, link_bar, _bar_of(axes, n_v, i, j))
                j = links[j].parent
            _pull_rates(i, links, block, state, kept, x)
            if links[i].parent >= 0:
                _hand_inward(i, links, state, kept, axes, x)
            for s in range(size):
                q_out[i, start + s] += x[64 * 33 + s]
                dq_out[i, start + s] += x[64 * 34 + s]
                ddq_out[i, start + s] += x[64 * 35 + s]


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _of(axes, n_v, i, j):  # type: ignore[no-untyped-def]
    base = 768 * (n_v * i + j)
    return axes[base : base + 384]


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _bar_of(axes, n_v, i, j):  # type: ignore[no-untyped-def]
    base = 768 * (n_v * i + j) + 384
    return axes[base : base + 384]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _keep(x, kept):  # type: ignore[no-untyped-def]
    """Keep R, P and x of a link, and clear its bars."""
    for k in range(768):
        kept[k] = x[k]
    for k in range(192):
        kept[768 + k] = x[64 * 30 + k]
    for k in range(960, 1536):
        kept[k] = 0.0


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _see_axes(i, links, axes, x):  # type: ignore[no-untyped-def]
    """Fill z, u of every joint that carries link i, and clear their bars."""
    n_v, p = links.size, links[i].parent
    j = i
    while j >= 0:
        seen = _of(axes, n_v, i, j)
        if j == i:
            own_axis(links[i], seen)
        else:
            carry_axis(_of(axes, n_v, p, j), seen, x)
        _bar_of(axes, n_v, i, j)[:] = 0.0
        j = links[j].parent


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _load_bars(i, j, start, size, ybar, bars):  # type: ignore[no-untyped-def]
    for k in range(10):
        row = ybar[10 * i + k, j, start : start + size]
        base = 64 * k
        for s in range(size):
            bars[base + s] = row[s]
        for s in range(size, 64):
            bars[base + s] = 0.0


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _pull_columns(bars, seen, link, link_bar, seen_bar):  # type: ignore[no-untyped-def]
    for s in range(64):
        b, B0, B1, B2 = bars[s], bars[64 + s], bars[64 * 2 + s], bars[64 * 3 + s]
        xx, xy, yy = bars[64 * 4 + s], bars[64 * 5 + s], bars[64 * 6 + s]
        xz, yz, zz = bars[64 * 7 + s], bars[64 * 8 + s], bars[64 * 9 + s]
        w0, w1, w2 = link[s], link[64 + s], link[64 * 2 + s]
        d0, d1, d2 = link[64 * 3 + s], link[64 * 4 + s], link[64 * 5 + s]
        a0, a1, a2 = link[64 * 6 + s], link[64 * 7 + s], link[64 * 8 + s]
        z0, z1, z2 = seen[s], seen[64 + s], seen[64 * 2 + s]
        u0, u1, u2 = seen[64 * 3 + s], seen[64 * 4 + s], seen[64 * 5 + s]
        c0, c1, c2 = w1 * B2 - w2 * B1, w2 * B0 - w0 * B2, w0 * B1 - w1 * B0
        g0, g1, g2 = xx * w0 + xy * w1 + xz * w2, xy * w0 + yy * w1 + yz * w2, xz * w0 + yz * w1 + zz * w2
        y0, y1, y2 = z1 * w2 - z2 * w1, z2 * w0 - z0 * w2, z0 * w1 - z1 * w0
        seen_bar[s] += B1 * a2 - B2 * a1 + xx * d0 + xy * d1 + xz * d2 + w1 * g2 - w2 * g1
        seen_bar[64 + s] += B2 * a0 - B0 * a2 + xy * d0 + yy * d1 + yz * d2 + w2 * g0 - w0 * g2
        seen_bar[64 * 2 + s] += B0 * a1 - B1 * a0 + xz * d0 + yz * d1 + zz * d2 + w0 * g1 - w1 * g0
        seen_bar[64 * 3 + s] += b * a0 + d1 * B2 - d2 * B1 + w1 * c2 - w2 * c1
        seen_bar[64 * 4 + s] += b * a1 + d2 * B0 - d0 * B2 + w2 * c0 - w0 * c2
        seen_bar[64 * 5 + s] += b * a2 + d0 * B1 - d1 * B0 + w0 * c1 - w1 * c0
        wB, wu, uB = w0 * B0 + w1 * B1 + w2 * B2, w0 * u0 + w1 * u1 + w2 * u2, u0 * B0 + u1 * B1 + u2 * B2
        link_bar[s] += u0 * wB + B0 * wu - 2.0 * w0 * uB + g1 * z2 - g2 * z1 + xx * y0 + xy * y1 + xz * y2
        link_bar[64 + s] += u1 * wB + B1 * wu - 2.0 * w1 * uB + g2 * z0 - g0 * z2 + xy * y0 + yy * y1 + yz * y2
        link_bar[64 * 2 + s] += u2 * wB + B2 * wu - 2.0 * w2 * uB + g0 * z1 - g1 * z0 + xz * y0 + yz * y1 + zz * y2
        link_bar[64 * 3 + s] += B1 * u2 - B2 * u1 + xx * z0 + xy * z1 + xz * z2
        link_bar[64 * 4 + s] += B2 * u0 - B0 * u2 + xy * z0 + yy * z1 + yz * z2
        link_bar[64 * 5 + s] += B0 * u1 - B1 * u0 + xz * z0 + yz * z1 + zz * z2
        link_bar[64 * 6 + s] += b * u0 + z1 * B2 - z2 * B1
        link_bar[64 * 7 + s] += b * u1 + z2 * B0 - z0 * B2
        link_bar[64 * 8 + s] += b * u2 + z0 * B1 - z1 * B0


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _pull_rates(i, links, block, state, kept, x):  # type: ignore[no-untyped-def]
    """Leave qbar so far, dqbar, ddqbar and xbar in slots 33-38."""
    link = links[i]
    turned, bar = kept[1536 * i + 768 : 1536 * i + 960], kept[1536 * i + 960 : 1536 * i + 1536]
    if link.prismatic:
        _slide_rates(link.axis, block[3, i], turned, bar, x)
    else:
        _turn_rates(link.axis, (block[3, i], block[4, i]), turned, state[576 * i : 576 * i + 576], bar, x)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _hand_inward(i, links, state, kept, axes, x):  # type: ignore[no-untyped-def]
    """Complete qbar in slot 33 and hand the rest to the parent."""
    n_v, link = links.size, links[i]
    p = link.parent
    placed, bar = kept[1536 * i : 1536 * i + 768], kept[1536 * i + 960 : 1536 * i + 1536]
    onto, before = kept[1536 * p + 960 : 1536 * p + 1536], state[576 * p : 576 * p + 576]
    _hand_link(placed, bar, before, onto, x)
    if link.prismatic:
        _slide_position(link.abc[0], link.axis, before, x)
    j = p
    while j >= 0:
        seen_bar = _bar_of(axes, n_v, i, j)
        if link.prismatic:
            _slide_axis(link.abc[0], link.axis, placed, seen_bar, _of(axes, n_v, p, j), x)
        else:
            _turn_axis(link.axis, seen_bar, _of(axes, n_v, i, j), x)
        _hand_axis(placed, seen_bar, _bar_of(axes, n_v, p, j))
        j = links[j].parent


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _turn_rates(e, rates, turned, here, bar, x):  # type: ignore[no-untyped-def]
    """Slots: 33 qbar so far, 34 dqbar, 35 ddqbar, 36-38 xbar; `rates` are dq, ddq (64,)."""
    e0, e1, e2 = e[0], e[1], e[2]
    speed, change = rates
    for s in range(64):
        dq, ddq = speed[s], change[s]
        v0, v1, v2 = turned[s], turned[64 + s], turned[64 * 2 + s]
        k0, k1, k2 = v1 * e2 - v2 * e1, v2 * e0 - v0 * e2, v0 * e1 - v1 * e0
        g0 = here[64 * 3 + s] - e0 * ddq - k0 * dq
        g1 = here[64 * 4 + s] - e1 * ddq - k1 * dq
        g2 = here[64 * 5 + s] - e2 * ddq - k2 * dq
        a0, a1, a2 = here[64 * 6 + s], here[64 * 7 + s], here[64 * 8 + s]
        d0, d1, d2 = bar[64 * 3 + s], bar[64 * 4 + s], bar[64 * 5 + s]
        A0, A1, A2 = bar[64 * 6 + s], bar[64 * 7 + s], bar[64 * 8 + s]
        x0 = bar[s] + dq * (e1 * d2 - e2 * d1)
        x1 = bar[64 + s] + dq * (e2 * d0 - e0 * d2)
        x2 = bar[64 * 2 + s] + dq * (e0 * d1 - e1 * d0)
        x[64 * 35 + s] = e0 * d0 + e1 * d1 + e2 * d2
        x[64 * 34 + s] = e0 * bar[s] + e1 * bar[64 + s] + e2 * bar[64 * 2 + s] + k0 * d0 + k1 * d1 + k2 * d2
        t0 = x1 * v2 - x2 * v1 + d1 * g2 - d2 * g1 + A1 * a2 - A2 * a1
        t1 = x2 * v0 - x0 * v2 + d2 * g0 - d0 * g2 + A2 * a0 - A0 * a2
        t2 = x0 * v1 - x1 * v0 + d0 * g1 - d1 * g0 + A0 * a1 - A1 * a0
        x[64 * 33 + s] = e0 * t0 + e1 * t1 + e2 * t2
        x[64 * 36 + s] = x0
        x[64 * 37 + s] = x1
        x[64 * 38 + s] = x2


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _slide_rates(e, speed, turned, bar, x):  # type: ignore[no-untyped-def]
    e0, e1, e2 = e[0], e[1], e[2]
    for s in range(64):
        dq = speed[s]
        v0, v1, v2 = turned[s], turned[64 + s], turned[64 * 2 + s]
        A0, A1, A2 = bar[64 * 6 + s], bar[64 * 7 + s], bar[64 * 8 + s]
        x[64 * 33 + s] = 0.0
        x[64 * 34 + s] = 2.0 * ((v1 * e2 - v2 * e1) * A0 + (v2 * e0 - v0 * e2) * A1 + (v0 * e1 - v1 * e0) * A2)
        x[64 * 35 + s] = e0 * A0 + e1 * A1 + e2 * A2
        x[64 * 36 + s] = bar[s] + 2.0 * dq * (e1 * A2 - e2 * A1)
        x[64 * 37 + s] = bar[64 + s] + 2.0 * dq * (e2 * A0 - e0 * A2)
        x[64 * 38 + s] = bar[64 * 2 + s] + 2.0 * dq * (e0 * A1 - e1 * A0)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _hand_link(placed, bar, before, onto, x):  # type: ignore[no-untyped-def]
    """Add to the parent's bars; leave A = R abar in slots 39-41."""
    for s in range(64):
        r0, r1, r2 = placed[s], placed[64 + s], placed[64 * 2 + s]
        r3, r4, r5 = placed[64 * 3 + s], placed[64 * 4 + s], placed[64 * 5 + s]
        r6, r7, r8 = placed[64 * 6 + s], placed[64 * 7 + s], placed[64 * 8 + s]
        p0, p1, p2 = placed[64 * 9 + s], placed[64 * 10 + s], placed[64 * 11 + s]
        w0, w1, w2 = before[s], before[64 + s], before[64 * 2 + s]
        a0, a1, a2 = bar[64 * 6 + s], bar[64 * 7 + s], bar[64 * 8 + s]
        d0, d1, d2 = bar[64 * 3 + s], bar[64 * 4 + s], bar[64 * 5 + s]
        x0, x1, x2 = x[64 * 36 + s], x[64 * 37 + s], x[64 * 38 + s]
        A0, A1, A2 = r0 * a0 + r1 * a1 + r2 * a2, r3 * a0 + r4 * a1 + r5 * a2, r6 * a0 + r7 * a1 + r8 * a2
        wP, wA, AP = w0 * p0 + w1 * p1 + w2 * p2, w0 * A0 + w1 * A1 + w2 * A2, A0 * p0 + A1 * p1 + A2 * p2
        onto[s] += r0 * x0 + r1 * x1 + r2 * x2 + A0 * wP + p0 * wA - 2.0 * w0 * AP
        onto[64 + s] += r3 * x0 + r4 * x1 + r5 * x2 + A1 * wP + p1 * wA - 2.0 * w1 * AP
        onto[64 * 2 + s] += r6 * x0 + r7 * x1 + r8 * x2 + A2 * wP + p2 * wA - 2.0 * w2 * AP
        onto[64 * 3 + s] += r0 * d0 + r1 * d1 + r2 * d2 + p1 * A2 - p2 * A1
        onto[64 * 4 + s] += r3 * d0 + r4 * d1 + r5 * d2 + p2 * A0 - p0 * A2
        onto[64 * 5 + s] += r6 * d0 + r7 * d1 + r8 * d2 + p0 * A1 - p1 * A0
        onto[64 * 6 + s] += A0
        onto[64 * 7 + s] += A1
        onto[64 * 8 + s] += A2
        x[64 * 39 + s] = A0
        x[64 * 40 + s] = A1
        x[64 * 41 + s] = A2


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _slide_position(r, e, before, x):  # type: ignore[no-untyped-def]
    D0 = r[0] * e[0] + r[1] * e[1] + r[2] * e[2]
    D1 = r[3] * e[0] + r[4] * e[1] + r[5] * e[2]
    D2 = r[6] * e[0] + r[7] * e[1] + r[8] * e[2]
    for s in range(64):
        w0, w1, w2 = before[s], before[64 + s], before[64 * 2 + s]
        d0, d1, d2 = before[64 * 3 + s], before[64 * 4 + s], before[64 * 5 + s]
        A0, A1, A2 = x[64 * 39 + s], x[64 * 40 + s], x[64 * 41 + s]
        wA, ww = w0 * A0 + w1 * A1 + w2 * A2, w0 * w0 + w1 * w1 + w2 * w2
        P0 = A1 * d2 - A2 * d1 + w0 * wA - A0 * ww
        P1 = A2 * d0 - A0 * d2 + w1 * wA - A1 * ww
        P2 = A0 * d1 - A1 * d0 + w2 * wA - A2 * ww
        x[64 * 33 + s] += D0 * P0 + D1 * P1 + D2 * P2


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _slide_axis(r, e, placed, seen_bar, inner, x):  # type: ignore[no-untyped-def]
    D0 = r[0] * e[0] + r[1] * e[1] + r[2] * e[2]
    D1 = r[3] * e[0] + r[4] * e[1] + r[5] * e[2]
    D2 = r[6] * e[0] + r[7] * e[1] + r[8] * e[2]
    for s in range(64):
        u0, u1, u2 = seen_bar[64 * 3 + s], seen_bar[64 * 4 + s], seen_bar[64 * 5 + s]
        U0 = placed[s] * u0 + placed[64 + s] * u1 + placed[64 * 2 + s] * u2
        U1 = placed[64 * 3 + s] * u0 + placed[64 * 4 + s] * u1 + placed[64 * 5 + s] * u2
        U2 = placed[64 * 6 + s] * u0 + placed[64 * 7 + s] * u1 + placed[64 * 8 + s] * u2
        z0, z1, z2 = inner[s], inner[64 + s], inner[64 * 2 + s]
        x[64 * 33 + s] += D0 * (U1 * z2 - U2 * z1) + D1 * (U2 * z0 - U0 * z2) + D2 * (U0 * z1 - U1 * z0)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _turn_axis(e, seen_bar, seen, x):  # type: ignore[no-untyped-def]
    e0, e1, e2 = e[0], e[1], e[2]
    for s in range(64):
        Z0, Z1, Z2 = seen_bar[s], seen_bar[64 + s], seen_bar[64 * 2 + s]
        U0, U1, U2 = seen_bar[64 * 3 + s], seen_bar[64 * 4 + s], seen_bar[64 * 5 + s]
        z0, z1, z2 = seen[s], seen[64 + s], seen[64 * 2 + s]
        u0, u1, u2 = seen[64 * 3 + s], seen[64 * 4 + s], seen[64 * 5 + s]
        t0 = Z1 * z2 - Z2 * z1 + U1 * u2 - U2 * u1
        t1 = Z2 * z0 - Z0 * z2 + U2 * u0 - U0 * u2
        t2 = Z0 * z1 - Z1 * z0 + U0 * u1 - U1 * u0
        x[64 * 33 + s] += e0 * t0 + e1 * t1 + e2 * t2


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _hand_axis(placed, seen_bar, inner_bar):  # type: ignore[no-untyped-def]
    for s in range(64):
        r0, r1, r2 = placed[s], placed[64 + s], placed[64 * 2 + s]
        r3, r4, r5 = placed[64 * 3 + s], placed[64 * 4 + s], placed[64 * 5 + s]
        r6, r7, r8 = placed[64 * 6 + s], placed[64 * 7 + s], placed[64 * 8 + s]
        p0, p1, p2 = placed[64 * 9 + s], placed[64 * 10 + s], placed[64 * 11 + s]
        z0, z1, z2 = seen_bar[s], seen_bar[64 + s], seen_bar[64 * 2 + s]
        u0, u1, u2 = seen_bar[64 * 3 + s], seen_bar[64 * 4 + s], seen_bar[64 * 5 + s]
        U0, U1, U2 = r0 * u0 + r1 * u1 + r2 * u2, r3 * u0 + r4 * u1 + r5 * u2, r6 * u0 + r7 * u1 + r8 * u2
        inner_bar[s] += r0 * z0 + r1 * z1 + r2 * z2 + p1 * U2 - p2 * U1
        inner_bar[64 + s] += r3 * z0 + r4 * z1 + r5 * z2 + p2 * U0 - p0 * U2
        inner_bar[64 * 2 + s] += r6 * z0 + r7 * z1 + r8 * z2 + p0 * U1 - p1 * U0
        inner_bar[64 * 3 + s] += U0
        inner_bar[64 * 4 + s] += U1
        inner_bar[64 * 5 + s] += U2
