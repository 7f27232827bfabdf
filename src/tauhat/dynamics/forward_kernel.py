"""Forward dynamics of one state: bias torque by Newton-Euler, mass matrix by composite bodies, Cholesky factor.

Bias b (velocity, gravity): Newton-Euler as in `newton_euler_kernel` with ddq = 0.
Mass matrix M: bodies are merged from the tips inward, about each link's own origin O with position P in its parent,
    m_p += m        h_p += R h + m P        I_p += R I R' + 2 (P.Rh) E - P (Rh)' - (Rh) P' + m (P.P E - P P')
and column i is the force of a unit acceleration of joint i on the merged body i, handed inward:
    revolute  f = e x h, n = I e        prismatic  f = m e, n = h x e        M_ij = e_j.n_j or e_j.f_j
Rotor inertia, a matrix where a motor turns with two joints, and what an integrator treats implicitly are added. M = L L' exists only when M is
positive definite; the index of the first joint whose pivot is not positive is returned, -1 when all are.

All of it is linear in (m, h, I): links without mass of their own, as base parameters leave them, are no exception.
`body` is the links of `KernelTree`, inertia (n_v, 10), rotor (n_v, n_v). `work` is scratch, 40 numbers a link, link i from `o = 40 i` on, its parent from p on: 0-8 R, 9-11 P, 12-14 w, 15-17 dw, 18-20 a, 21-23 f, 24-26 n, 27 m, 28-30 h, 31-36 I.

Source: Featherstone, "Rigid body dynamics algorithms", 2008, ch. 6 (composite rigid body algorithm).
"""

from __future__ import annotations

import numpy as np
from numba import njit

SMALLEST_PIVOT = 1e-12  # of the largest diagonal entry: less is no inertia


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def forward_kernel(body, states, out):  # type: ignore[no-untyped-def]
    """Fill `out` (n_t, n_v) with ddq of `states` q, dq, tau (n_t, n_v); return (sample, joint) of a failure or -1, -1."""
    links, inertia, rotor = body
    q, dq, tau = states
    n_t, n_v = q.shape
    work, bias, mass = np.empty(40 * n_v), np.empty(n_v), np.empty((n_v, n_v))
    for k in range(n_t):
        sweep_outward(links, inertia, q[k], dq[k], work)
        bias_and_mass(links, work, bias, mass)
        for i in range(n_v):
            for j in range(n_v):
                mass[i, j] += rotor[i, j]
            out[k, i] = tau[k, i] - bias[i]
        failed = factorised(mass)
        if failed >= 0:
            return k, failed
        solved(mass, out[k])
    return -1, -1


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def mass_kernel(body, q, out):  # type: ignore[no-untyped-def]
    """Fill `out` (n_t, n_v, n_v) with mass matrices at `q` (n_t, n_v), rotors included."""
    links, inertia, rotor = body
    n_t, n_v = q.shape
    work, bias, rest = np.empty(40 * n_v), np.empty(n_v), np.zeros(n_v)
    for k in range(n_t):
        sweep_outward(links, inertia, q[k], rest, work)
        bias_and_mass(links, work, bias, out[k])
        for i in range(n_v):
            for j in range(n_v):
                out[k, i, j] += rotor[i, j]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def sweep_outward(links, inertia, q, dq, work):  # type: ignore[no-untyped-def]
    """Fill `work` with every link's place, motion for ddq = 0, and body (n_v, 10) at the state `q`, `dq` (n_v,)."""
    for i in range(q.size):
        place_link(links[i], q[i], work, 40 * i)
        _outward(links[i], dq[i], work, 40 * i)
        _bodied(i, inertia, work, 40 * i)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def bias_and_mass(links, work, bias, mass):  # type: ignore[no-untyped-def]
    """Fill `bias` (n_v,) and `mass` (n_v, n_v), without rotors, from `work` as `sweep_outward` leaves it."""
    n_v = links.size
    for i in range(n_v - 1, -1, -1):
        o, link = 40 * i, links[i]
        axis, first = link.axis, o + (21 if link.prismatic else 24)
        bias[i] = axis[0] * work[first] + axis[1] * work[first + 1] + axis[2] * work[first + 2]
        if link.parent >= 0:
            _hand_inward(work, o, 40 * link.parent)
            _merge_inward(work, o, 40 * link.parent)
    for i in range(n_v):
        for j in range(n_v):
            mass[i, j] = 0.0
    for i in range(n_v):
        _column(i, links, work, mass)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def place_link(link, q, work, o):  # type: ignore[no-untyped-def]
    """Fill `work` from `o` on with the link's rotation (9) and position (3) in its parent's frame."""
    abc, place, axis = link.abc, link.place, link.axis
    p0, p1, p2 = place[0], place[1], place[2]
    if link.prismatic:
        for k in range(9):
            work[o + k] = abc[0, k]
        e0, e1, e2 = axis[0] * q, axis[1] * q, axis[2] * q
        p0 += work[o] * e0 + work[o + 1] * e1 + work[o + 2] * e2
        p1 += work[o + 3] * e0 + work[o + 4] * e1 + work[o + 5] * e2
        p2 += work[o + 6] * e0 + work[o + 7] * e1 + work[o + 8] * e2
    else:
        cosine, sine = np.cos(q), np.sin(q)
        for k in range(9):
            work[o + k] = abc[0, k] + abc[1, k] * cosine + abc[2, k] * sine
    work[o + 9], work[o + 10], work[o + 11] = p0, p1, p2


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _outward(link, dq, work, o):  # type: ignore[no-untyped-def]
    """Velocity and acceleration of the link for ddq = 0; `sweep_kernel` gives the formulas."""
    axis, gravity = link.axis, link.gravity
    if link.parent < 0:
        w0 = w1 = w2 = d0 = d1 = d2 = 0.0
        a0, a1, a2 = -gravity[0], -gravity[1], -gravity[2]
    else:
        p = 40 * link.parent
        w0, w1, w2, d0, d1, d2 = work[p + 12], work[p + 13], work[p + 14], work[p + 15], work[p + 16], work[p + 17]
        p0, p1, p2 = work[o + 9], work[o + 10], work[o + 11]
        c0, c1, c2 = w1 * p2 - w2 * p1, w2 * p0 - w0 * p2, w0 * p1 - w1 * p0
        a0 = work[p + 18] + d1 * p2 - d2 * p1 + w1 * c2 - w2 * c1
        a1 = work[p + 19] + d2 * p0 - d0 * p2 + w2 * c0 - w0 * c2
        a2 = work[p + 20] + d0 * p1 - d1 * p0 + w0 * c1 - w1 * c0
    v0 = work[o] * w0 + work[o + 3] * w1 + work[o + 6] * w2
    v1 = work[o + 1] * w0 + work[o + 4] * w1 + work[o + 7] * w2
    v2 = work[o + 2] * w0 + work[o + 5] * w1 + work[o + 8] * w2
    e0, e1, e2 = axis[0] * dq, axis[1] * dq, axis[2] * dq
    g0, g1, g2 = v1 * e2 - v2 * e1, v2 * e0 - v0 * e2, v0 * e1 - v1 * e0
    work[o + 15] = work[o] * d0 + work[o + 3] * d1 + work[o + 6] * d2
    work[o + 16] = work[o + 1] * d0 + work[o + 4] * d1 + work[o + 7] * d2
    work[o + 17] = work[o + 2] * d0 + work[o + 5] * d1 + work[o + 8] * d2
    work[o + 18] = work[o] * a0 + work[o + 3] * a1 + work[o + 6] * a2
    work[o + 19] = work[o + 1] * a0 + work[o + 4] * a1 + work[o + 7] * a2
    work[o + 20] = work[o + 2] * a0 + work[o + 5] * a1 + work[o + 8] * a2
    if link.prismatic:
        work[o + 12], work[o + 13], work[o + 14] = v0, v1, v2
        work[o + 18] += 2.0 * g0
        work[o + 19] += 2.0 * g1
        work[o + 20] += 2.0 * g2
    else:
        work[o + 12], work[o + 13], work[o + 14] = v0 + e0, v1 + e1, v2 + e2
        work[o + 15] += g0
        work[o + 16] += g1
        work[o + 17] += g2


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _bodied(i, inertia, work, o):  # type: ignore[no-untyped-def]
    """Keep the link's body, and the force and moment it needs: `newton_euler_kernel` gives the formulas."""
    m, h0, h1, h2 = inertia[i, 0], inertia[i, 1], inertia[i, 2], inertia[i, 3]
    xx, xy, yy, xz, yz, zz = inertia[i, 4], inertia[i, 5], inertia[i, 6], inertia[i, 7], inertia[i, 8], inertia[i, 9]
    for k in range(10):
        work[o + 27 + k] = inertia[i, k]
    w0, w1, w2, d0, d1, d2 = work[o + 12], work[o + 13], work[o + 14], work[o + 15], work[o + 16], work[o + 17]
    a0, a1, a2 = work[o + 18], work[o + 19], work[o + 20]
    c0, c1, c2 = w1 * h2 - w2 * h1, w2 * h0 - w0 * h2, w0 * h1 - w1 * h0
    g0, g1, g2 = xx * w0 + xy * w1 + xz * w2, xy * w0 + yy * w1 + yz * w2, xz * w0 + yz * w1 + zz * w2
    work[o + 21] = m * a0 + d1 * h2 - d2 * h1 + w1 * c2 - w2 * c1
    work[o + 22] = m * a1 + d2 * h0 - d0 * h2 + w2 * c0 - w0 * c2
    work[o + 23] = m * a2 + d0 * h1 - d1 * h0 + w0 * c1 - w1 * c0
    work[o + 24] = xx * d0 + xy * d1 + xz * d2 + w1 * g2 - w2 * g1 + h1 * a2 - h2 * a1
    work[o + 25] = xy * d0 + yy * d1 + yz * d2 + w2 * g0 - w0 * g2 + h2 * a0 - h0 * a2
    work[o + 26] = xz * d0 + yz * d1 + zz * d2 + w0 * g1 - w1 * g0 + h0 * a1 - h1 * a0


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _hand_inward(work, o, p):  # type: ignore[no-untyped-def]
    F0 = work[o] * work[o + 21] + work[o + 1] * work[o + 22] + work[o + 2] * work[o + 23]
    F1 = work[o + 3] * work[o + 21] + work[o + 4] * work[o + 22] + work[o + 5] * work[o + 23]
    F2 = work[o + 6] * work[o + 21] + work[o + 7] * work[o + 22] + work[o + 8] * work[o + 23]
    work[p + 21] += F0
    work[p + 22] += F1
    work[p + 23] += F2
    work[p + 24] += (
        work[o] * work[o + 24]
        + work[o + 1] * work[o + 25]
        + work[o + 2] * work[o + 26]
        + work[o + 10] * F2
        - work[o + 11] * F1
    )
    work[p + 25] += (
        work[o + 3] * work[o + 24]
        + work[o + 4] * work[o + 25]
        + work[o + 5] * work[o + 26]
        + work[o + 11] * F0
        - work[o + 9] * F2
    )
    work[p + 26] += (
        work[o + 6] * work[o + 24]
        + work[o + 7] * work[o + 25]
        + work[o + 8] * work[o + 26]
        + work[o + 9] * F1
        - work[o + 10] * F0
    )


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _merge_inward(work, o, p):  # type: ignore[no-untyped-def]
    m, h0, h1, h2 = work[o + 27], work[o + 28], work[o + 29], work[o + 30]
    p0, p1, p2 = work[o + 9], work[o + 10], work[o + 11]
    H0 = work[o] * h0 + work[o + 1] * h1 + work[o + 2] * h2
    H1 = work[o + 3] * h0 + work[o + 4] * h1 + work[o + 5] * h2
    H2 = work[o + 6] * h0 + work[o + 7] * h1 + work[o + 8] * h2
    xx, xy, yy, xz, yz, zz = work[o + 31], work[o + 32], work[o + 33], work[o + 34], work[o + 35], work[o + 36]
    # rows of R I
    r00, r01, r02 = (
        work[o] * xx + work[o + 1] * xy + work[o + 2] * xz,
        work[o] * xy + work[o + 1] * yy + work[o + 2] * yz,
        work[o] * xz + work[o + 1] * yz + work[o + 2] * zz,
    )
    r10, r11, r12 = (
        work[o + 3] * xx + work[o + 4] * xy + work[o + 5] * xz,
        work[o + 3] * xy + work[o + 4] * yy + work[o + 5] * yz,
        work[o + 3] * xz + work[o + 4] * yz + work[o + 5] * zz,
    )
    r20, r21, r22 = (
        work[o + 6] * xx + work[o + 7] * xy + work[o + 8] * xz,
        work[o + 6] * xy + work[o + 7] * yy + work[o + 8] * yz,
        work[o + 6] * xz + work[o + 7] * yz + work[o + 8] * zz,
    )
    # h about the parent's origin is H + m P; the shift of I is that of H and of m P / 2, twice
    s0, s1, s2 = 2.0 * H0 + m * p0, 2.0 * H1 + m * p1, 2.0 * H2 + m * p2
    along = p0 * s0 + p1 * s1 + p2 * s2
    work[p + 27] += m
    work[p + 28] += H0 + m * p0
    work[p + 29] += H1 + m * p1
    work[p + 30] += H2 + m * p2
    work[p + 31] += r00 * work[o] + r01 * work[o + 1] + r02 * work[o + 2] + along - p0 * s0
    work[p + 32] += r00 * work[o + 3] + r01 * work[o + 4] + r02 * work[o + 5] - 0.5 * (p0 * s1 + p1 * s0)
    work[p + 33] += r10 * work[o + 3] + r11 * work[o + 4] + r12 * work[o + 5] + along - p1 * s1
    work[p + 34] += r00 * work[o + 6] + r01 * work[o + 7] + r02 * work[o + 8] - 0.5 * (p0 * s2 + p2 * s0)
    work[p + 35] += r10 * work[o + 6] + r11 * work[o + 7] + r12 * work[o + 8] - 0.5 * (p1 * s2 + p2 * s1)
    work[p + 36] += r20 * work[o + 6] + r21 * work[o + 7] + r22 * work[o + 8] + along - p2 * s2


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _column(i, links, work, mass):  # type: ignore[no-untyped-def]
    """Fill `mass[i, j]` and `mass[j, i]` for every joint j on the way from joint i to the base."""
    o = 40 * i
    axis = links[i].axis
    e0, e1, e2 = axis[0], axis[1], axis[2]
    m, h0, h1, h2 = work[o + 27], work[o + 28], work[o + 29], work[o + 30]
    if links[i].prismatic:
        f0, f1, f2 = m * e0, m * e1, m * e2
        n0, n1, n2 = h1 * e2 - h2 * e1, h2 * e0 - h0 * e2, h0 * e1 - h1 * e0
    else:
        f0, f1, f2 = e1 * h2 - e2 * h1, e2 * h0 - e0 * h2, e0 * h1 - e1 * h0
        n0 = work[o + 31] * e0 + work[o + 32] * e1 + work[o + 34] * e2
        n1 = work[o + 32] * e0 + work[o + 33] * e1 + work[o + 35] * e2
        n2 = work[o + 34] * e0 + work[o + 35] * e1 + work[o + 36] * e2
    j = i
    while True:
        link, axis = links[j], links[j].axis
        if link.prismatic:
            entry = axis[0] * f0 + axis[1] * f1 + axis[2] * f2
        else:
            entry = axis[0] * n0 + axis[1] * n1 + axis[2] * n2
        mass[i, j] = entry
        mass[j, i] = entry
        if link.parent < 0:
            return
        p = 40 * j
        F0 = work[p] * f0 + work[p + 1] * f1 + work[p + 2] * f2
        F1 = work[p + 3] * f0 + work[p + 4] * f1 + work[p + 5] * f2
        F2 = work[p + 6] * f0 + work[p + 7] * f1 + work[p + 8] * f2
        N0 = work[p] * n0 + work[p + 1] * n1 + work[p + 2] * n2 + work[p + 10] * F2 - work[p + 11] * F1
        N1 = work[p + 3] * n0 + work[p + 4] * n1 + work[p + 5] * n2 + work[p + 11] * F0 - work[p + 9] * F2
        N2 = work[p + 6] * n0 + work[p + 7] * n1 + work[p + 8] * n2 + work[p + 9] * F1 - work[p + 10] * F0
        f0, f1, f2, n0, n1, n2 = F0, F1, F2, N0, N1, N2
        j = link.parent


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def factorised(mass):  # type: ignore[no-untyped-def]
    """Overwrite the lower triangle of `mass` with its Cholesky factor; return the first joint that fails, or -1."""
    n = mass.shape[0]
    largest = 0.0
    for i in range(n):
        largest = max(largest, mass[i, i])
    least = SMALLEST_PIVOT * largest
    for i in range(n):
        for j in range(i):
            rest = mass[i, j]
            for k in range(j):
                rest -= mass[i, k] * mass[j, k]
            mass[i, j] = rest / mass[j, j]
        rest = mass[i, i]
        for k in range(i):
            rest -= mass[i, k] * mass[i, k]
        if not rest > least:
            return i
        mass[i, i] = np.sqrt(rest)
    return -1


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def solved(factor, x):  # type: ignore[no-untyped-def]
    """Overwrite `x` (n,) with the solution of `L L' y = x`."""
    n = x.size
    for i in range(n):
        rest = x[i]
        for k in range(i):
            rest -= factor[i, k] * x[k]
        x[i] = rest / factor[i, i]
    for i in range(n - 1, -1, -1):
        rest = x[i]
        for k in range(i + 1, n):
            rest -= factor[k, i] * x[k]
        x[i] = rest / factor[i, i]
