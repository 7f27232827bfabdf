"""What friction, springs and offsets take from a joint's torque, element by element, and how steeply it grows with speed.

An element is one parameter of a torque model: its kind, joint, shape and weight. With speed v, shape w and the smooth
sign `s(v, w) = tanh(v / w)` the torque per unit of weight is
    0 offset 1           1 spring q             2 viscous v             3 Coulomb s(v, w)       4 cube root of v
    5 |v|                6 max(v, 0)            7 min(v, 0)             8 max(s(v, w), 0)       9 min(s(v, w), 0)
    10 Stribeck exp(-(v / w)^2) s(v, w / 10)    11 polynomial's sign s(v, w / 10)
    12 |v| v            13 v^3                 14 exp(-|v| / w) s(v, w / 10)
    15 Dahl z           16 |load| s(v, w)      17 |load| z
    18 gas spring        19 viscous coupling
with the Dahl state z over the length w of `presliding`: `z+ = d + (z - d) exp(-|moved| / w)`, d the sign of the motion.

Gas spring, with `cylinder` D^2 + k^2, D k, volume / area + D - k, angle of the term `GasSpring`, in this order a, b, c, o:
    b sin(q + o) / (l (c - l)),  l = sqrt(a - 2 b cos(q + o))

A motor that turns with two joints, `ratio` r not zero, reads q, v and the displacement of `joint` and r times those of
`other`, and takes its torque f from `joint` and r f from `other`: power is preserved. The load is that of `joint`. A
viscous coupling takes `r v_other` from `joint` and `r v_joint` from `other`: the rest of that motor's is the joints' own.

`damping` gets f / v of every element that resists (its secant through rest): an integrator that treats this part
implicitly neither overshoots nor reverses a joint by friction, however sharp the sign. `stiffness` gets dz/dq. A shared
motor has both between its two joints too, `coupled_by`.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numba import njit
from numpy.typing import NDArray

OFFSET, SPRING, VISCOUS, SIGN, CUBE_ROOT, SIZE, FORWARDS, BACKWARDS, SIGN_FORWARDS, SIGN_BACKWARDS = range(10)
STRIBECK, NARROW_SIGN, SQUARE, CUBE, DECAY, DAHL, LOAD_SIGN, LOAD_DAHL, GAS, COUPLING = range(10, 20)
ELEMENT = np.dtype(
    [
        ("kind", np.int64), ("joint", np.int64), ("shape", np.float64), ("weight", np.float64),
        ("other", np.int64), ("ratio", np.float64), ("cylinder", np.float64, (4,)),
    ]
)  # fmt: skip
SLOWEST = 1e-9  # [rad/s or m/s] taken for a joint at rest where a secant is asked for


def joint_elements(rows: Iterable[tuple[int, int, float, float]]) -> NDArray[np.void]:
    """Return elements that act on one joint each, of rows with their kind, joint, shape and weight."""
    known = list(rows)
    made = np.zeros(len(known), dtype=ELEMENT)
    for name, column in zip(("kind", "joint", "shape", "weight"), zip(*known, strict=True), strict=False):
        made[name] = column
    return made


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


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def turned_by(element, x):  # type: ignore[no-untyped-def]
    """Return a quantity of the joints `x` (n_v,), a position or speed, as the motor of an element has it."""
    if element.ratio == 0.0:
        return x[element.joint]
    return x[element.joint] + element.ratio * x[element.other]


@njit(cache=True, nogil=True, error_model="numpy")
def _squeezed(cylinder, q):  # type: ignore[no-untyped-def]
    """Return a gas spring's torque per unit of pressure times volume."""
    turned = q + cylinder[3]
    length = np.sqrt(cylinder[0] - 2.0 * cylinder[1] * np.cos(turned))
    return cylinder[1] * np.sin(turned) / (length * (cylinder[2] - length))


@njit(cache=True, nogil=True, error_model="numpy")
def _damping(kind, w, weight, v, value):  # type: ignore[no-untyped-def]
    """Return f / v of an element that resists, f its `value` at v; zero of the others."""
    if kind < 2 or kind == 5:
        return 0.0
    if abs(v) < SLOWEST:
        return max(0.0, weight * _pointwise(kind, w, 0.0, SLOWEST) / SLOWEST)
    return max(0.0, value / v)


@njit(cache=True, nogil=True, error_model="numpy")
def _bristle_stiffness(element, weight, z, v):  # type: ignore[no-untyped-def]
    sign = 1.0 if v > 0.0 else -1.0
    return max(0.0, weight * (1.0 - sign * z) / element.shape)


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
        if elements[k].ratio != 0.0:
            _share(elements[k], v, bent, k, out)
            continue
        if kind == 18:
            torque[j] += weight * _squeezed(elements[k].cylinder, q[j])
            continue
        if kind >= 16:
            weight *= load[j]
        if kind == 15 or kind == 17:
            torque[j] += weight * bent[k]
            stiffness[j] += _bristle_stiffness(elements[k], weight, bent[k], v[j])
            continue
        value = weight * _pointwise(kind, w, q[j], v[j])
        torque[j] += value
        damping[j] += _damping(kind, w, weight, v[j], value)


@njit(cache=True, nogil=True, error_model="numpy")
def _share(element, v, bent, k, out):  # type: ignore[no-untyped-def]
    """Add element k, of a motor that turns with two joints, to both of them."""
    torque, damping, stiffness = out[0], out[1], out[2]
    j, other, ratio, weight = element.joint, element.other, element.ratio, element.weight
    if element.kind == 19:
        torque[j] += weight * ratio * v[other]
        torque[other] += weight * ratio * v[j]
        return
    speed = turned_by(element, v)
    slope = stiff = 0.0
    if element.kind == 15:
        value = weight * bent[k]
        stiff = _bristle_stiffness(element, weight, bent[k], speed)
    else:
        value = weight * _pointwise(element.kind, element.shape, 0.0, speed)
        slope = _damping(element.kind, element.shape, weight, speed, value)
    torque[j] += value
    torque[other] += ratio * value
    damping[j] += slope
    damping[other] += ratio * ratio * slope
    stiffness[j] += stiff
    stiffness[other] += ratio * ratio * stiff


@njit(cache=True, nogil=True, error_model="numpy")
def coupled_by(element, v, z):  # type: ignore[no-untyped-def]
    """Return damping and stiffness between both joints of an element's motor, whose bristle is in the state z."""
    weight, ratio = element.weight, element.ratio
    if element.kind == 19:
        return weight * ratio, 0.0
    speed = turned_by(element, v)
    if element.kind == 15:
        return 0.0, ratio * _bristle_stiffness(element, weight, z, speed)
    value = weight * _pointwise(element.kind, element.shape, 0.0, speed)
    return ratio * _damping(element.kind, element.shape, weight, speed, value), 0.0
