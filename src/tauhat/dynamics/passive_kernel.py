"""What friction, springs and offsets take from a joint's torque, element by element, and how steeply it grows with speed.

An element is one parameter of a torque model: its kind, joint, shape and weight. With speed v, shape w and the smooth
sign `s(v, w) = tanh(v / w)` the torque per unit of weight is
    0 offset 1           1 spring q             2 viscous v             3 Coulomb s(v, w)       4 cube root of v
    5 |v|                6 max(v, 0)            7 min(v, 0)             8 max(s(v, w), 0)       9 min(s(v, w), 0)
    10 Stribeck exp(-(v / w)^2) s(v, w / 10)    11 polynomial's sign s(v, w / 10)
    12 |v| v            13 v^3                 14 exp(-|v| / w) s(v, w / 10)
    15 Dahl z           16 |load| s(v, w)      17 |load| z
with the Dahl state z over the length w of `presliding`: `z+ = d + (z - d) exp(-|moved| / w)`, d the sign of the motion.

`damping` gets f / v of every element that resists (its secant through rest): an integrator that treats this part
implicitly neither overshoots nor reverses a joint by friction, however sharp the sign. `stiffness` gets dz/dq.
"""

from __future__ import annotations

import numpy as np
from numba import njit

OFFSET, SPRING, VISCOUS, SIGN, CUBE_ROOT, SIZE, FORWARDS, BACKWARDS, SIGN_FORWARDS, SIGN_BACKWARDS = range(10)
STRIBECK, NARROW_SIGN, SQUARE, CUBE, DECAY, DAHL, LOAD_SIGN, LOAD_DAHL = range(10, 18)
ELEMENT = np.dtype([("kind", np.int64), ("joint", np.int64), ("shape", np.float64), ("weight", np.float64)])
SLOWEST = 1e-9  # [rad/s or m/s] taken for a joint at rest where a secant is asked for


@njit(cache=True, nogil=True, error_model="numpy")
def _pointwise(kind, w, q, v):  # type: ignore[no-untyped-def]  # noqa: PLR0911
    size = abs(v)
    if kind == 0:
        return 1.0
    if kind == 1:
        return q
    if kind == 2:
        return v
    if kind == 3 or kind == 16:
        return np.tanh(v / w)
    if kind == 4:
        return np.cbrt(v)
    if kind == 5:
        return size
    if kind == 6:
        return max(v, 0.0)
    if kind == 7:
        return min(v, 0.0)
    if kind == 8:
        return max(np.tanh(v / w), 0.0)
    if kind == 9:
        return min(np.tanh(v / w), 0.0)
    if kind == 10:
        return np.exp(-((v / w) ** 2)) * np.tanh(10.0 * v / w)
    if kind == 11:
        return np.tanh(10.0 * v / w)
    if kind == 12:
        return size * v
    if kind == 13:
        return v * v * v
    return np.exp(-size / w) * np.tanh(10.0 * v / w)


@njit(cache=True, nogil=True, error_model="numpy")
def bent_by(moved, w, z):  # type: ignore[no-untyped-def]
    """Return the Dahl state z after a displacement."""
    if moved == 0.0:
        return z
    sign = 1.0 if moved > 0.0 else -1.0
    return sign + (z - sign) * np.exp(-abs(moved) / w)


@njit(cache=True, nogil=True, error_model="numpy")
def passive_kernel(elements, q, v, load, bent, out):  # type: ignore[no-untyped-def]
    """Fill `out` (3, n_v), torque, damping, stiffness, of the state `q`, `v`, `load` (n_v,) and `bent` (n_elements,)."""
    torque, damping, stiffness = out[0], out[1], out[2]
    for j in range(q.size):
        torque[j] = 0.0
        damping[j] = 0.0
        stiffness[j] = 0.0
    for k in range(elements.size):
        j, kind, weight, w = elements[k].joint, elements[k].kind, elements[k].weight, elements[k].shape
        if kind >= 16:
            weight *= load[j]
        if kind == 15 or kind == 17:
            z = bent[k]
            torque[j] += weight * z
            sign = 1.0 if v[j] > 0.0 else -1.0
            stiffness[j] += max(0.0, weight * (1.0 - sign * z) / w)
            continue
        value = weight * _pointwise(kind, w, q[j], v[j])
        torque[j] += value
        if kind >= 2 and kind != 5:
            speed = v[j]
            if abs(speed) < SLOWEST:
                speed = SLOWEST
                value = weight * _pointwise(kind, w, q[j], speed)
            damping[j] += max(0.0, value / speed)
