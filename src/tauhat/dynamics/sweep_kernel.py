"""Outward sweep over one block of samples: velocities and accelerations of every link, in its own frame.

For link i with parent p, `R` from link to parent, `P` the link's origin in the parent frame, `e` the joint axis:
    revolute   w  = R'w_p + e dq                  dw = R'dw_p + e ddq + R'w_p x e dq
               a  = R'(a_p + dw_p x P + w_p x (w_p x P))
    prismatic  w  = R'w_p    dw = R'dw_p          a gains e ddq + 2 R'w_p x e dq,   P gains R0 e q
    base       w = dw = 0,   a = -gravity
`R(q) = A + B cos q + C sin q` for any axis (Rodrigues), so one joint costs 18 multiply-adds per sample.

`links` are those of `KernelTree`. Layout: samples are the last, contiguous axis, in blocks of 64. All scratch of a block is one flat array indexed by literal
offsets `x[64 * slot + s]`: only then does the compiler know that nothing overlaps, and vectorises across samples.
Slots: 0-8 R, 9-11 P, 12-20 w_p dw_p a_p of the parent, 21-29 w dw a of the link, 30-32 R'w_p; 33 and up are the callers'.
`state` keeps slots 21-29 of every link: `state[576 * i + 64 * k + s]`.
"""

from __future__ import annotations

from numba import njit

BLOCK = 64
SLOTS = 56
STATE = 9 * BLOCK


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def sweep_link(i, links, motion, x, state):  # type: ignore[no-untyped-def]
    """Fill slots 0-32 of `x` and the link's `state` for one block; `motion` is (5, n_v, 64): cos, sin, q, dq, ddq."""
    _pose(i, links, motion, x)
    link = links[i]
    parent, gravity, axis = link.parent, link.gravity, link.axis
    if parent < 0:
        for s in range(64):
            for k in range(12, 18):
                x[64 * k + s] = 0.0
            x[64 * 18 + s] = -gravity[0]
            x[64 * 19 + s] = -gravity[1]
            x[64 * 20 + s] = -gravity[2]
    else:
        carried = state[576 * parent : 576 * parent + 576]
        for k in range(576):
            x[64 * 12 + k] = carried[k]
    _rotate_motion(x)
    e0, e1, e2 = axis[0], axis[1], axis[2]
    if link.prismatic:
        _add_prismatic(i, e0, e1, e2, motion, x)
    else:
        _add_revolute(i, e0, e1, e2, motion, x)
    kept = state[576 * i : 576 * i + 576]
    for k in range(576):
        kept[k] = x[64 * 21 + k]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _pose(i, links, motion, x):  # type: ignore[no-untyped-def]
    link = links[i]
    abc, place, axis = link.abc, link.place, link.axis
    p0, p1, p2 = place[0], place[1], place[2]
    if link.prismatic:
        d0 = abc[0, 0] * axis[0] + abc[0, 1] * axis[1] + abc[0, 2] * axis[2]
        d1 = abc[0, 3] * axis[0] + abc[0, 4] * axis[1] + abc[0, 5] * axis[2]
        d2 = abc[0, 6] * axis[0] + abc[0, 7] * axis[1] + abc[0, 8] * axis[2]
        for k in range(9):
            r = abc[0, k]
            for s in range(64):
                x[64 * k + s] = r
        position = motion[2, i]
        for s in range(64):
            q = position[s]
            x[64 * 9 + s] = p0 + d0 * q
            x[64 * 10 + s] = p1 + d1 * q
            x[64 * 11 + s] = p2 + d2 * q
        return
    cosine, sine = motion[0, i], motion[1, i]
    for k in range(9):
        r0, rc, rs = abc[0, k], abc[1, k], abc[2, k]
        for s in range(64):
            x[64 * k + s] = r0 + rc * cosine[s] + rs * sine[s]
    for s in range(64):
        x[64 * 9 + s] = p0
        x[64 * 10 + s] = p1
        x[64 * 11 + s] = p2


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _rotate_motion(x):  # type: ignore[no-untyped-def]
    for s in range(64):
        p0, p1, p2 = x[64 * 9 + s], x[64 * 10 + s], x[64 * 11 + s]
        w0, w1, w2 = x[64 * 12 + s], x[64 * 13 + s], x[64 * 14 + s]
        d0, d1, d2 = x[64 * 15 + s], x[64 * 16 + s], x[64 * 17 + s]
        c0, c1, c2 = w1 * p2 - w2 * p1, w2 * p0 - w0 * p2, w0 * p1 - w1 * p0
        a0 = x[64 * 18 + s] + d1 * p2 - d2 * p1 + w1 * c2 - w2 * c1
        a1 = x[64 * 19 + s] + d2 * p0 - d0 * p2 + w2 * c0 - w0 * c2
        a2 = x[64 * 20 + s] + d0 * p1 - d1 * p0 + w0 * c1 - w1 * c0
        x[64 * 30 + s] = x[s] * w0 + x[64 * 3 + s] * w1 + x[64 * 6 + s] * w2
        x[64 * 31 + s] = x[64 + s] * w0 + x[64 * 4 + s] * w1 + x[64 * 7 + s] * w2
        x[64 * 32 + s] = x[64 * 2 + s] * w0 + x[64 * 5 + s] * w1 + x[64 * 8 + s] * w2
        x[64 * 24 + s] = x[s] * d0 + x[64 * 3 + s] * d1 + x[64 * 6 + s] * d2
        x[64 * 25 + s] = x[64 + s] * d0 + x[64 * 4 + s] * d1 + x[64 * 7 + s] * d2
        x[64 * 26 + s] = x[64 * 2 + s] * d0 + x[64 * 5 + s] * d1 + x[64 * 8 + s] * d2
        x[64 * 27 + s] = x[s] * a0 + x[64 * 3 + s] * a1 + x[64 * 6 + s] * a2
        x[64 * 28 + s] = x[64 + s] * a0 + x[64 * 4 + s] * a1 + x[64 * 7 + s] * a2
        x[64 * 29 + s] = x[64 * 2 + s] * a0 + x[64 * 5 + s] * a1 + x[64 * 8 + s] * a2


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _add_revolute(i, e0, e1, e2, motion, x):  # type: ignore[no-untyped-def]
    speed, acceleration = motion[3, i], motion[4, i]
    for s in range(64):
        dq, ddq = speed[s], acceleration[s]
        v0, v1, v2 = x[64 * 30 + s], x[64 * 31 + s], x[64 * 32 + s]
        x[64 * 21 + s] = v0 + e0 * dq
        x[64 * 22 + s] = v1 + e1 * dq
        x[64 * 23 + s] = v2 + e2 * dq
        x[64 * 24 + s] += e0 * ddq + (v1 * e2 - v2 * e1) * dq
        x[64 * 25 + s] += e1 * ddq + (v2 * e0 - v0 * e2) * dq
        x[64 * 26 + s] += e2 * ddq + (v0 * e1 - v1 * e0) * dq


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _add_prismatic(i, e0, e1, e2, motion, x):  # type: ignore[no-untyped-def]
    speed, acceleration = motion[3, i], motion[4, i]
    for s in range(64):
        dq, ddq = speed[s], acceleration[s]
        v0, v1, v2 = x[64 * 30 + s], x[64 * 31 + s], x[64 * 32 + s]
        x[64 * 21 + s] = v0
        x[64 * 22 + s] = v1
        x[64 * 23 + s] = v2
        x[64 * 27 + s] += e0 * ddq + 2.0 * (v1 * e2 - v2 * e1) * dq
        x[64 * 28 + s] += e1 * ddq + 2.0 * (v2 * e0 - v0 * e2) * dq
        x[64 * 29 + s] += e2 * ddq + 2.0 * (v0 * e1 - v1 * e0) * dq
