"""Wrench from external torque: generalised least squares through the Jacobian, also near singularities.

    tau_ext = J' D x + error,   error ~ (0, V),   x ~ (0, S)        w = D x
    A = D'J V^-1 J'D + S^-1     x = A^-1 D'J V^-1 tau     cov x = A^-1
D holds the directions that are asked for, (6, k) in base axes; S is what is taken as the largest conceivable wrench.
Where the joints tell x it has no say; where they cannot, x stays small, with the variance of S. Errors of the joints
belong together as the correlation R says; beside them each joint may have an error of its own:
    V = diag(std) R diag(std) + diag(own)        V = L L',  L^-1 J'D and L^-1 tau have errors that are alike and apart

`place` is the frame: joint, rotation (3, 3) and translation (3,) in that joint's frame. Rows of J are the velocity of
the frame's origin, then its angular velocity, in base axes. `work` is scratch, 40 numbers a joint: 0-8 R, 9-11 P as
`forward_kernel` has them; 12-20 R, 21-23 P in base axes.

Source: Aitken, "On least squares and linear combination of observations", 1935.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from tauhat.dynamics.forward_kernel import place_link, solved


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def jacobian_kernel(links, place, q, work, jacobian):  # type: ignore[no-untyped-def]
    """Fill `jacobian` (6, n_v) of a frame's origin, base axes; behind the joints, `work` gets the frame's R and P."""
    joint, rotation, translation = place
    n_v = q.size
    for j in range(n_v):
        for k in range(6):
            jacobian[k, j] = 0.0
    for i in range(n_v):
        o = 40 * i
        place_link(links[i], q[i], work, o)
        _in_base(links[i].parent, work, o)
    o, end = 40 * joint, 40 * n_v
    for r in range(3):
        work[end + 9 + r] = work[o + 21 + r]
        for c in range(3):
            work[end + 9 + r] += work[o + 12 + 3 * r + c] * translation[c]
            entry = 0.0
            for k in range(3):
                entry += work[o + 12 + 3 * r + k] * rotation[k, c]
            work[end + 3 * r + c] = entry
    i = joint
    while i >= 0:
        _column(links[i], work, 40 * i, end, jacobian[:, i])
        i = links[i].parent


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _in_base(parent, work, o):  # type: ignore[no-untyped-def]
    if parent < 0:
        for k in range(12):
            work[o + 12 + k] = work[o + k]
        return
    p = 40 * parent
    for r in range(3):
        work[o + 21 + r] = work[p + 21 + r]
        for c in range(3):
            work[o + 21 + r] += work[p + 12 + 3 * r + c] * work[o + 9 + c]
            entry = 0.0
            for k in range(3):
                entry += work[p + 12 + 3 * r + k] * work[o + 3 * k + c]
            work[o + 12 + 3 * r + c] = entry


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _column(link, work, o, end, column):  # type: ignore[no-untyped-def]
    axis = link.axis
    e0 = work[o + 12] * axis[0] + work[o + 13] * axis[1] + work[o + 14] * axis[2]
    e1 = work[o + 15] * axis[0] + work[o + 16] * axis[1] + work[o + 17] * axis[2]
    e2 = work[o + 18] * axis[0] + work[o + 19] * axis[1] + work[o + 20] * axis[2]
    if link.prismatic:
        column[0], column[1], column[2] = e0, e1, e2
        return
    a0, a1, a2 = work[end + 9] - work[o + 21], work[end + 10] - work[o + 22], work[end + 11] - work[o + 23]
    column[0], column[1], column[2] = e1 * a2 - e2 * a1, e2 * a0 - e0 * a2, e0 * a1 - e1 * a0
    column[3], column[4], column[5] = e0, e1, e2


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def wrench_kernel(jacobian, wanted, torque, work, out):  # type: ignore[no-untyped-def]
    """Fill `out` (1 + k, k) with x and its covariance; `torque` (3, n_v) is tau, its variance, and each joint's own.

    `wanted` are D (6, k) in base axes, the standard deviations of S (k,), and R (n_v, n_v); scratch is `work`: (k, k),
    (k + 1, n_v), (n_v, n_v).
    """
    directions, spread, correlation = wanted
    normal, seen, joint = work
    k_all, n_v = spread.size, jacobian.shape[1]
    _joint_covariance(correlation, torque, joint)
    _factor(joint)
    _seen_alike(jacobian, directions, torque[0], joint, seen)
    for a in range(k_all):
        out[0, a] = 0.0
        for j in range(n_v):
            out[0, a] += seen[a, j] * seen[k_all, j]
        for b in range(a + 1):
            entry = 0.0
            for j in range(n_v):
                entry += seen[a, j] * seen[b, j]
            normal[a, b] = normal[b, a] = entry
        normal[a, a] += 1.0 / (spread[a] * spread[a])
    _factor(normal)
    solved(normal, out[0])
    for a in range(k_all):
        column = out[1 + a]
        for b in range(k_all):
            column[b] = 1.0 if a == b else 0.0
        solved(normal, column)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _seen_alike(jacobian, directions, tau, lower, seen):  # type: ignore[no-untyped-def]
    """Fill `seen` (k + 1, n_v) with the rows of L^-1 J'D, and L^-1 tau behind them."""
    k_all, n_v = directions.shape[1], tau.size
    for a in range(k_all):
        for j in range(n_v):
            seen[a, j] = 0.0
            for r in range(6):
                seen[a, j] += directions[r, a] * jacobian[r, j]
    for j in range(n_v):
        seen[k_all, j] = tau[j]
    for a in range(k_all + 1):
        _solved_lower(lower, seen[a])


@njit(cache=True, nogil=True, error_model="numpy")
def _joint_covariance(correlation, torque, out):  # type: ignore[no-untyped-def]
    """Fill the lower triangle of `out` with V."""
    for i in range(out.shape[0]):
        for j in range(i):
            out[i, j] = 0.0
            if correlation[i, j] != 0.0:
                out[i, j] = correlation[i, j] * np.sqrt(torque[1, i] * torque[1, j])
        out[i, i] = torque[1, i] + torque[2, i]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _solved_lower(lower, values):  # type: ignore[no-untyped-def]
    """Overwrite `values` with what a lower triangle makes them of."""
    for i in range(values.size):
        rest = values[i]
        for j in range(i):
            rest -= lower[i, j] * values[j]
        values[i] = rest / lower[i, i]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _factor(matrix):  # type: ignore[no-untyped-def]
    """Overwrite the lower triangle of a positive definite matrix with its Cholesky factor."""
    n = matrix.shape[0]
    for i in range(n):
        for j in range(i):
            rest = matrix[i, j]
            for k in range(j):
                rest -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = rest / matrix[j, j]
        rest = matrix[i, i]
        for k in range(i):
            rest -= matrix[i, k] * matrix[i, k]
        matrix[i, i] = np.sqrt(rest)
