"""One law of a program after the other: its torque and slope added, its memory carried along.

A program's rows are the fields of each law in their order; see `PassiveLaw.rows`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from tauhat.simulation import rows as r
from tauhat.simulation.laws.bristle_kernel import add_bent, bend
from tauhat.simulation.laws.speed_kernel import (
    add_by_direction,
    add_cube_root,
    add_polynomial,
    add_smooth_sign,
    add_stribeck,
)

SMOOTH_COULOMB, CUBE_ROOT, DIRECTIONAL_VISCOUS, DIRECTIONAL, STRIBECK, POLYNOMIAL = 0, 1, 2, 3, 4, 5
BRISTLES, LOADED_COULOMB, LOADED_BRISTLES, SHARED_SMOOTH, SHARED_BRISTLES = 6, 7, 8, 9, 10
SPRING, GAS_CYLINDER = 11, 12


@njit(cache=True, nogil=True, error_model="numpy")
def on_the_link(kind):  # type: ignore[no-untyped-def]
    """Return whether a law acts on the link of an elastic joint: springs do, friction does not."""
    return kind >= SPRING


@njit(cache=True, nogil=True, error_model="numpy")
def add_law(program, i, memory, x):  # type: ignore[no-untyped-def]
    """Add law i to the rows PART and PART_SLOPE of the state x, at the joints that the rows SEEN describe."""
    kind = program.kinds[i]
    v = program.values[program.first[i] : program.first[i + 1]]
    z = memory[program.remembered[i] : program.remembered[i + 1]]
    if kind == SPRING:
        for j in range(x.shape[1]):
            x[r.PART, j] += v[0, j] * x[r.SEEN, j]
    if kind == GAS_CYLINDER:
        _add_cylinder(v, x)
    if kind in (SHARED_SMOOTH, SHARED_BRISTLES):
        _add_shared(kind, v, z, x)
    if kind == BRISTLES:
        add_bent(v[0:2], z, x[r.PART])
    if kind in (LOADED_COULOMB, LOADED_BRISTLES):
        _add_loaded(kind, v, z, x)
    if kind <= POLYNOMIAL:
        _add_by_speed(kind, v, x[r.SEEN_DQ], x[r.PART], x[r.PART_SLOPE])


@njit(cache=True, nogil=True, error_model="numpy")
def advance_law(program, i, memory, x):  # type: ignore[no-untyped-def]
    """Carry the memory of law i along the displacements in the row MOVED of the state."""
    kind = program.kinds[i]
    v = program.values[program.first[i] : program.first[i + 1]]
    z = memory[program.remembered[i] : program.remembered[i + 1]]
    moved = x[r.MOVED]
    if kind == BRISTLES:
        bend(moved, v[2:4], z)
    if kind == LOADED_BRISTLES:
        bend(moved, v[1:2], z)
    if kind == SHARED_BRISTLES:
        x[r.SINGLE, 0] = moved[int(v[0, 0])] + v[2, 0] * moved[int(v[1, 0])]
        bend(x[r.SINGLE, 0:1], v[6:8], z)


@njit(cache=True, nogil=True, error_model="numpy")
def _add_by_speed(kind, v, dq, torque, damping):  # type: ignore[no-untyped-def]
    if kind == SMOOTH_COULOMB:
        add_smooth_sign(dq, v[0], v[1], torque, damping)
    if kind == CUBE_ROOT:
        add_cube_root(dq, v[0], torque, damping)
    if kind == DIRECTIONAL_VISCOUS:
        for j in range(dq.size):
            torque[j] += v[0, j] * abs(dq[j])
    if kind == DIRECTIONAL:
        add_by_direction(dq, v[0:3:2], v[1:4:2], v[4], torque, damping)
    if kind == STRIBECK:
        add_stribeck(dq, v[0], v[1], v[2], torque, damping)
    if kind == POLYNOMIAL:
        add_polynomial(dq, v[0:5], v[5], v[6], torque, damping)


@njit(cache=True, nogil=True, error_model="numpy")
def _add_loaded(kind, v, z, x):  # type: ignore[no-untyped-def]
    for j in range(x.shape[1]):
        peak = v[0, j] * x[r.SEEN_LOAD, j]
        if kind == LOADED_COULOMB:
            s = np.tanh(x[r.SEEN_DQ, j] / v[1, j])
            x[r.PART, j] += peak * s
            x[r.PART_SLOPE, j] += peak / v[1, j] * (1.0 - s * s)
        else:
            x[r.PART, j] += peak * z[0, j]


@njit(cache=True, nogil=True, error_model="numpy")
def _add_shared(kind, v, z, x):  # type: ignore[no-untyped-def]
    """Add the friction of a motor that turns with two joints, `q_m = q[own] + ratio q[other]`."""
    own, other, ratio, viscous = int(v[0, 0]), int(v[1, 0]), v[2, 0], v[3, 0]
    dq, torque, damping = x[r.SINGLE + 1, 0:1], x[r.SINGLE + 3, 0:1], x[r.SINGLE + 4, 0:1]
    dq[0] = x[r.SEEN_DQ, own] + ratio * x[r.SEEN_DQ, other]
    torque[0], damping[0] = viscous * dq[0], viscous
    if kind == SHARED_SMOOTH:
        add_smooth_sign(dq, v[4], v[5], torque, damping)
    else:
        for i in range(z.shape[0]):
            torque[0] += v[4 + i, 0] * z[i, 0]
    x[r.PART, own] += torque[0]
    x[r.PART, other] += ratio * torque[0]
    arm = abs(ratio)
    x[r.PART_SLOPE, own] += (1.0 + arm) * damping[0]
    x[r.PART_SLOPE, other] += (arm + arm**2) * damping[0]


@njit(cache=True, nogil=True, error_model="numpy")
def _add_cylinder(v, x):  # type: ignore[no-untyped-def]
    """Add the torque of a gas cylinder, the derivative of `-energy ln(V)` by the joint's position."""
    j, energy, distance, lever = int(v[0, 0]), v[1, 0], v[2, 0], v[3, 0]
    turned, area, volume = x[r.SEEN, j] + v[4, 0], v[5, 0], v[6, 0]
    length = math.hypot(distance - lever * math.cos(turned), lever * math.sin(turned))
    arm = distance * lever * math.sin(turned) / length
    left = volume - area * (length - distance + lever)
    x[r.PART, j] += energy / left * area * arm
