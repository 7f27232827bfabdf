"""Generalised momentum of one state, and what changes it beside torque: `dp/dt = tau - friction + drift + tau_ext`.

    p = M(q) dq          drift = dT/dq - g(q) = C(q, dq)' dq - g(q)

Outward: velocity of every link about its own origin O with position P in its parent,
    w = R'w_p + e dq      v = R'(v_p + w_p x P)          (+ e dq there, where the joint slides)
and the link's momentum, `l = m v + w x h`, `k = I w + h x v` about O. Inward: `l_p += R l`, `k_p += R k + P x (R l)`, so
that l and k are those of all that moves with the joint; mass and first moment alike. Then
    revolute   p_i = e.k    (dT/dq)_i = k.(w x e) + l.(v x e)    g_i = e.(gravity x h)
    prismatic  p_i = e.l    (dT/dq)_i = l.(w x e)                g_i = -m e.gravity
since the velocity of a body changes with q_i by the cross product of motions `V x S`. All is linear in (m, h, I): base
parameters do as well as standard ones.

`work` is scratch, 40 numbers a link from `o = 40 i` on: 0-8 R, 9-11 P as `forward_kernel` has them, 12-14 w, 15-17 v,
18-20 gravity in the link's frame, 21-23 l, 24-26 k, 27 m, 28-30 h.

Source: De Luca, Albu-Schaeffer, Haddadin, Hirzinger 2006 (momentum in place of accelerations); Featherstone 2008 (V x S).
"""

from __future__ import annotations

from numba import njit

from tauhat.dynamics.forward_kernel import place_link


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def momentum_kernel(body, q, dq, work, out):  # type: ignore[no-untyped-def]
    """Fill `out` (2, n_v) with momentum and drift at `q`, `dq` (n_v,); `body` is links, inertia (n_v, 10), rotor (n_v, n_v).

    What rotors keep, `Ia dq`, is part of the momentum; it drifts by nothing.
    """
    links, inertia, rotor = body
    n_v = q.size
    for i in range(n_v):
        place_link(links[i], q[i], work, 40 * i)
        _moving(links[i], dq[i], work, 40 * i)
        _momentum(i, inertia, work, 40 * i)
    for i in range(n_v - 1, -1, -1):
        _read(links[i], work, 40 * i, i, out)
        for j in range(n_v):
            out[0, i] += rotor[i, j] * dq[j]
        if links[i].parent >= 0:
            _merged(work, 40 * i, 40 * links[i].parent)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _moving(link, dq, work, o):  # type: ignore[no-untyped-def]
    """Velocity of the link, and gravity in its frame."""
    axis, gravity = link.axis, link.gravity
    if link.parent < 0:
        w0 = w1 = w2 = v0 = v1 = v2 = 0.0
        g0, g1, g2 = gravity[0], gravity[1], gravity[2]
    else:
        p = 40 * link.parent
        w0, w1, w2 = work[p + 12], work[p + 13], work[p + 14]
        p0, p1, p2 = work[o + 9], work[o + 10], work[o + 11]
        v0 = work[p + 15] + w1 * p2 - w2 * p1
        v1 = work[p + 16] + w2 * p0 - w0 * p2
        v2 = work[p + 17] + w0 * p1 - w1 * p0
        g0, g1, g2 = work[p + 18], work[p + 19], work[p + 20]
    for k in range(3):
        r0, r1, r2 = work[o + k], work[o + 3 + k], work[o + 6 + k]
        work[o + 12 + k] = r0 * w0 + r1 * w1 + r2 * w2
        work[o + 15 + k] = r0 * v0 + r1 * v1 + r2 * v2
        work[o + 18 + k] = r0 * g0 + r1 * g1 + r2 * g2
        work[o + (15 if link.prismatic else 12) + k] += axis[k] * dq


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _momentum(i, inertia, work, o):  # type: ignore[no-untyped-def]
    m, h0, h1, h2 = inertia[i, 0], inertia[i, 1], inertia[i, 2], inertia[i, 3]
    xx, xy, yy, xz, yz, zz = inertia[i, 4], inertia[i, 5], inertia[i, 6], inertia[i, 7], inertia[i, 8], inertia[i, 9]
    w0, w1, w2, v0, v1, v2 = work[o + 12], work[o + 13], work[o + 14], work[o + 15], work[o + 16], work[o + 17]
    work[o + 21] = m * v0 + w1 * h2 - w2 * h1
    work[o + 22] = m * v1 + w2 * h0 - w0 * h2
    work[o + 23] = m * v2 + w0 * h1 - w1 * h0
    work[o + 24] = xx * w0 + xy * w1 + xz * w2 + h1 * v2 - h2 * v1
    work[o + 25] = xy * w0 + yy * w1 + yz * w2 + h2 * v0 - h0 * v2
    work[o + 26] = xz * w0 + yz * w1 + zz * w2 + h0 * v1 - h1 * v0
    work[o + 27], work[o + 28], work[o + 29], work[o + 30] = m, h0, h1, h2


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _read(link, work, o, i, out):  # type: ignore[no-untyped-def]
    axis = link.axis
    e0, e1, e2 = axis[0], axis[1], axis[2]
    w0, w1, w2, v0, v1, v2 = work[o + 12], work[o + 13], work[o + 14], work[o + 15], work[o + 16], work[o + 17]
    g0, g1, g2 = work[o + 18], work[o + 19], work[o + 20]
    l0, l1, l2, k0, k1, k2 = work[o + 21], work[o + 22], work[o + 23], work[o + 24], work[o + 25], work[o + 26]
    c0, c1, c2 = w1 * e2 - w2 * e1, w2 * e0 - w0 * e2, w0 * e1 - w1 * e0
    if link.prismatic:
        out[0, i] = e0 * l0 + e1 * l1 + e2 * l2
        out[1, i] = l0 * c0 + l1 * c1 + l2 * c2 + work[o + 27] * (e0 * g0 + e1 * g1 + e2 * g2)
        return
    h0, h1, h2 = work[o + 28], work[o + 29], work[o + 30]
    out[0, i] = e0 * k0 + e1 * k1 + e2 * k2
    along = l0 * (v1 * e2 - v2 * e1) + l1 * (v2 * e0 - v0 * e2) + l2 * (v0 * e1 - v1 * e0)
    weight = e0 * (g1 * h2 - g2 * h1) + e1 * (g2 * h0 - g0 * h2) + e2 * (g0 * h1 - g1 * h0)
    out[1, i] = k0 * c0 + k1 * c1 + k2 * c2 + along - weight


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _merged(work, o, p):  # type: ignore[no-untyped-def]
    """Add momentum, mass and first moment of a link, and all that moves with it, to its parent's."""
    p0, p1, p2 = work[o + 9], work[o + 10], work[o + 11]
    m, l0, l1, l2 = work[o + 27], work[o + 21], work[o + 22], work[o + 23]
    k0, k1, k2, h0, h1, h2 = work[o + 24], work[o + 25], work[o + 26], work[o + 28], work[o + 29], work[o + 30]
    L0 = work[o] * l0 + work[o + 1] * l1 + work[o + 2] * l2
    L1 = work[o + 3] * l0 + work[o + 4] * l1 + work[o + 5] * l2
    L2 = work[o + 6] * l0 + work[o + 7] * l1 + work[o + 8] * l2
    work[p + 21] += L0
    work[p + 22] += L1
    work[p + 23] += L2
    work[p + 24] += work[o] * k0 + work[o + 1] * k1 + work[o + 2] * k2 + p1 * L2 - p2 * L1
    work[p + 25] += work[o + 3] * k0 + work[o + 4] * k1 + work[o + 5] * k2 + p2 * L0 - p0 * L2
    work[p + 26] += work[o + 6] * k0 + work[o + 7] * k1 + work[o + 8] * k2 + p0 * L1 - p1 * L0
    work[p + 27] += m
    work[p + 28] += work[o] * h0 + work[o + 1] * h1 + work[o + 2] * h2 + m * p0
    work[p + 29] += work[o + 3] * h0 + work[o + 4] * h1 + work[o + 5] * h2 + m * p1
    work[p + 30] += work[o + 6] * h0 + work[o + 7] * h1 + work[o + 8] * h2 + m * p2
