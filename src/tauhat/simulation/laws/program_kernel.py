"""One law of a program after the other: its torque and slope added, its memory carried along.

A program's rows are the fields of each law in their order; see `PassiveLaw.rows`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

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
def add_law(program, i, memory, joints, single):  # type: ignore[no-untyped-def]
    """Add law i at the state `joints`; `single` is a state of one joint, to work in."""
    kind = program.kinds[i]
    v = program.values[program.first[i] : program.first[i + 1]]
    z = memory[program.remembered[i] : program.remembered[i + 1]]
    if kind == SPRING:
        _add_spring(v, joints)
    if kind == GAS_CYLINDER:
        _add_cylinder(v, joints)
    if kind in (SHARED_SMOOTH, SHARED_BRISTLES):
        _add_shared(kind, v, z, joints, single)
    if kind in (BRISTLES, LOADED_COULOMB, LOADED_BRISTLES):
        _add_bent_or_loaded(kind, v, z, joints)
    if kind <= POLYNOMIAL:
        _add_by_speed(kind, v, joints)


@njit(cache=True, nogil=True, error_model="numpy")
def advance_law(program, i, memory, moved, single):  # type: ignore[no-untyped-def]
    """Carry the memory of law i along the displacements moved (n_v,)."""
    kind = program.kinds[i]
    v = program.values[program.first[i] : program.first[i + 1]]
    z = memory[program.remembered[i] : program.remembered[i + 1]]
    if kind == BRISTLES:
        bend(moved, v[2:4], z)
    elif kind == LOADED_BRISTLES:
        bend(moved, v[1:2], z)
    elif kind == SHARED_BRISTLES:
        single.q[0] = moved[int(v[0, 0])] + v[2, 0] * moved[int(v[1, 0])]
        bend(single.q, v[6:8], z)


@njit(cache=True, nogil=True, error_model="numpy")
def _add_by_speed(kind, v, joints):  # type: ignore[no-untyped-def]
    dq, torque, damping = joints.dq, joints.torque, joints.damping
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
def _add_bent_or_loaded(kind, v, z, joints):  # type: ignore[no-untyped-def]
    if kind == BRISTLES:
        add_bent(v[0:2], z, joints.torque)
    elif kind == LOADED_COULOMB:
        for j in range(joints.dq.size):
            s = np.tanh(joints.dq[j] / v[1, j])
            peak = v[0, j] * joints.load[j]
            joints.torque[j] += peak * s
            joints.damping[j] += peak / v[1, j] * (1.0 - s * s)
    else:
        for j in range(joints.dq.size):
            joints.torque[j] += v[0, j] * joints.load[j] * z[0, j]


@njit(cache=True, nogil=True, error_model="numpy")
def _add_shared(kind, v, z, joints, single):  # type: ignore[no-untyped-def]
    """Add the friction of a motor that turns with two joints, `q_m = q[own] + ratio q[other]`."""
    own, other, ratio, viscous = int(v[0, 0]), int(v[1, 0]), v[2, 0], v[3, 0]
    single.dq[0] = joints.dq[own] + ratio * joints.dq[other]
    single.torque[0] = viscous * single.dq[0]
    single.damping[0] = viscous
    if kind == SHARED_SMOOTH:
        add_smooth_sign(single.dq, v[4], v[5], single.torque, single.damping)
    else:
        for i in range(z.shape[0]):
            single.torque[0] += v[4 + i, 0] * z[i, 0]
    joints.torque[own] += single.torque[0]
    joints.torque[other] += ratio * single.torque[0]
    arm = abs(ratio)
    joints.damping[own] += (1.0 + arm) * single.damping[0]
    joints.damping[other] += (arm + arm**2) * single.damping[0]


@njit(cache=True, nogil=True, error_model="numpy")
def _add_spring(v, joints):  # type: ignore[no-untyped-def]
    for j in range(joints.q.size):
        joints.torque[j] += v[0, j] * joints.q[j]


@njit(cache=True, nogil=True, error_model="numpy")
def _add_cylinder(v, joints):  # type: ignore[no-untyped-def]
    """Add the torque of a gas cylinder, the derivative of `-energy ln(V)` by the joint's position."""
    j, energy, distance, lever = int(v[0, 0]), v[1, 0], v[2, 0], v[3, 0]
    turned, area, volume = joints.q[j] + v[4, 0], v[5, 0], v[6, 0]
    length = math.hypot(distance - lever * math.cos(turned), lever * math.sin(turned))
    arm = distance * lever * math.sin(turned) / length
    left = volume - area * (length - distance + lever)
    joints.torque[j] += energy / left * area * arm
