"""Rigid-body dynamics on traced numbers: what the C functions calculate, joint by joint.

With `U = [dw]x + [w]x [w]x` of a link, the acceleration of a point r is `a + U r`, so that, with the second moments of
mass `S = tr(I)/2 E - I` and `h = m c` about the link's origin,
    f = m a + U h          n = vee(U S - S U') + h x a          (vee: x of the cross product matrix [x]x)
Source: Luh, Walker, Paul 1980 (inverse dynamics); Walker, Orin 1982 (mass matrix by composite bodies); the form with U:
Khalil, Kleinfinger, "Minimum operations and minimum parameters of the dynamic models of tree structure robots", 1987.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.tree import kernel_tree
from tauhat.export.parameters import second_moments
from tauhat.export.tracing import Scalar, Trace
from tauhat.robots.robot import Robot

Vector: TypeAlias = tuple[Scalar, Scalar, Scalar]
Matrix: TypeAlias = tuple[Vector, Vector, Vector]

_ROUNDING = 1e-15  # entries of rotations this near to 0 or +-1 are: a quarter turn in floating point


class TracedJoint(NamedTuple):
    """A joint of the C function: its pose and axis, and its link's m, h = m c, S about the origin."""

    parent: int
    prismatic: bool
    rotation: Matrix
    place: Vector
    axis: Vector
    mass: Scalar
    first: Vector
    second: Matrix


class Speeds(NamedTuple):
    """Joint speeds and accelerations of the C function."""

    dq: Sequence[Scalar]
    ddq: Sequence[Scalar]


def traced_joints(trace: Trace, robot: Robot, inertia: FloatArray) -> tuple[TracedJoint, ...]:
    """Return the joints at the positions `q[0]`, `q[1]`, ... of the C function.

    Parameters
    ----------
    inertia : (n_v, 10) inertial parameters of the links
    """
    tree = kernel_tree(robot)
    joints = []
    for index, joint in enumerate(robot.joints):
        q = trace.variable(f"q[{index}]")
        constant, cosine, sine = (_snapped(part).reshape(3, 3) for part in tree.links["abc"][index])
        rotation, place = _matrix(trace, constant), _vector(trace, joint.translation)
        axis = _vector(trace, _snapped(joint.axis))
        if joint.kind == "revolute":
            c = trace.named(trace.call("cos", q), f"c{index + 1}")
            s = trace.named(trace.call("sin", q), f"s{index + 1}")
            rotation = _plus(rotation, _plus(_scaled(_matrix(trace, cosine), c), _scaled(_matrix(trace, sine), s)))
        else:
            place = add(place, scale(times(rotation, axis), q))
        mass, *first = inertia[index, :4]
        xx, xy, yy, xz, yz, zz = inertia[index, 4:]
        second = second_moments(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
        joints.append(
            TracedJoint(
                joint.parent, joint.kind == "prismatic", _named(trace, rotation, f"r{index + 1}"), place, axis,
                trace.scalar(mass), _vector(trace, np.array(first)), _matrix(trace, second),
            )
        )  # fmt: skip
    return tuple(joints)


def traced_inverse_dynamics(
    trace: Trace, joints: Sequence[TracedJoint], *, gravity: FloatArray, speeds: Speeds, mark: str = ""
) -> tuple[Scalar, ...]:
    """Return the joint torques of the links by recursive Newton-Euler.

    Parameters
    ----------
    mark : before the names of forces and moments; another one for other inertias in the same function
    """
    zero = trace.scalar(0.0)
    still: Vector = (zero, zero, zero)
    turns: dict[int, Vector] = {-1: still}  # w
    spins: dict[int, Vector] = {-1: still}  # dw
    pulls: dict[int, Vector] = {-1: _vector(trace, -gravity)}  # a, gravity in it
    spreads: dict[int, Matrix] = {-1: (still, still, still)}  # U
    forces: list[Vector] = []
    moments: list[Vector] = []
    for index, joint in enumerate(joints):
        name = index + 1
        carried = turned_back(joint.rotation, turns[joint.parent])
        w, dw = carried, turned_back(joint.rotation, spins[joint.parent])
        a = turned_back(joint.rotation, add(pulls[joint.parent], times(spreads[joint.parent], joint.place)))
        along, driven = scale(joint.axis, speeds.dq[index]), scale(joint.axis, speeds.ddq[index])
        if joint.prismatic:
            a = add(a, add(driven, scale(cross(carried, along), trace.scalar(2.0))))
        else:
            w, dw = add(carried, along), add(dw, add(driven, cross(carried, along)))
        turns[index] = named(trace, w, f"w{name}")
        spins[index] = named(trace, dw, f"dw{name}")
        pulls[index] = named(trace, a, f"a{name}")
        spreads[index] = _named(trace, _spread(turns[index], spins[index]), f"u{name}")
        forces.append(named(trace, add(scale(a, joint.mass), times(spreads[index], joint.first)), f"{mark}f{name}"))
        turning = add(_moment_of_spread(spreads[index], joint.second), cross(joint.first, a))
        moments.append(named(trace, turning, f"{mark}n{name}"))
    return _gathered(trace, joints, (forces, moments), mark)


def _gathered(
    trace: Trace, joints: Sequence[TracedJoint], wrenches: tuple[list[Vector], list[Vector]], mark: str
) -> tuple[Scalar, ...]:
    """Return what each joint carries of the wrenches of all links beyond it."""
    (forces, moments), torques = wrenches, [trace.scalar(0.0)] * len(joints)
    for index in range(len(joints) - 1, -1, -1):
        joint = joints[index]
        torques[index] = dot(joint.axis, forces[index] if joint.prismatic else moments[index])
        if joint.parent >= 0:
            force, moment = _handed_inward(joint, forces[index], moments[index])
            name = joint.parent + 1
            forces[joint.parent] = named(trace, add(forces[joint.parent], force), f"{mark}f{name}_{index + 1}")
            moments[joint.parent] = named(trace, add(moments[joint.parent], moment), f"{mark}n{name}_{index + 1}")
    return tuple(torques)


def traced_mass_matrix(trace: Trace, joints: Sequence[TracedJoint], rotor: FloatArray) -> list[list[Scalar]]:
    """Return the mass matrix, rotors on its diagonal, by composite rigid bodies."""
    n_v, zero = len(joints), trace.scalar(0.0)
    masses = [joint.mass for joint in joints]
    firsts, seconds = [joint.first for joint in joints], [joint.second for joint in joints]
    matrix = [[zero] * n_v for _ in range(n_v)]
    for index in range(n_v - 1, -1, -1):
        joint = joints[index]
        if joint.prismatic:
            force, moment = scale(joint.axis, masses[index]), cross(firsts[index], joint.axis)
        else:
            still = (zero, zero, zero)
            spread = _spread(still, joint.axis)
            force, moment = times(spread, firsts[index]), _moment_of_spread(spread, seconds[index])
        matrix[index][index] = dot(joint.axis, force if joint.prismatic else moment) + float(rotor[index])
        _fill_column(matrix, joints, index, (force, moment))
        if joint.parent >= 0:
            parent, name = joint.parent, f"{joint.parent + 1}_{index + 1}"
            first, second = _carried(joint, masses[index], firsts[index], seconds[index])
            masses[parent] = masses[parent] + masses[index]
            firsts[parent] = named(trace, add(firsts[parent], first), f"h{name}")
            seconds[parent] = _named(trace, _plus(seconds[parent], second), f"m{name}")
    return matrix


def _fill_column(
    matrix: list[list[Scalar]], joints: Sequence[TracedJoint], index: int, wrench: tuple[Vector, Vector]
) -> None:
    """Note what a unit acceleration of one joint asks of those that carry it."""
    (force, moment), at = wrench, index
    while joints[at].parent >= 0:
        force, moment = _handed_inward(joints[at], force, moment)
        at = joints[at].parent
        asked = dot(joints[at].axis, force if joints[at].prismatic else moment)
        matrix[at][index] = matrix[index][at] = asked


def _carried(joint: TracedJoint, mass: Scalar, first: Vector, second: Matrix) -> tuple[Vector, Matrix]:
    """Return first and second moments of mass as seen from the parent's frame."""
    turned, place = times(joint.rotation, first), joint.place
    spread = _sandwiched(joint.rotation, second)
    offset = [[mass * (place[i] * place[k]) for k in range(3)] for i in range(3)]
    entries = [
        [_shifted(spread, turned, place, (min(i, k), max(i, k))) + offset[i][k] for k in range(3)] for i in range(3)
    ]
    return add(turned, scale(place, mass)), (_triple(entries[0]), _triple(entries[1]), _triple(entries[2]))


def _shifted(spread: Matrix, turned: Vector, place: Vector, entry: tuple[int, int]) -> Scalar:
    i, k = entry
    return spread[i][k] + turned[i] * place[k] + place[i] * turned[k]


def _sandwiched(rotation: Matrix, second: Matrix) -> Matrix:
    """Return `R S R'`; the lower half is the upper one."""
    half = [times(second, row) for row in rotation]  # rows of R S, S being symmetric
    entries = [[dot(half[min(i, k)], rotation[max(i, k)]) for k in range(3)] for i in range(3)]
    return _triple(entries[0]), _triple(entries[1]), _triple(entries[2])


def _handed_inward(joint: TracedJoint, force: Vector, moment: Vector) -> tuple[Vector, Vector]:
    turned = times(joint.rotation, force)
    return turned, add(times(joint.rotation, moment), cross(joint.place, turned))


def _spread(w: Vector, dw: Vector) -> Matrix:
    """Return `U = [dw]x + [w]x [w]x`."""
    xx, yy, zz = w[0] * w[0], w[1] * w[1], w[2] * w[2]
    xy, xz, yz = w[0] * w[1], w[0] * w[2], w[1] * w[2]
    return (
        (-(yy + zz), xy - dw[2], xz + dw[1]),
        (xy + dw[2], -(xx + zz), yz - dw[0]),
        (xz - dw[1], yz + dw[0], -(xx + yy)),
    )


def _moment_of_spread(u: Matrix, s: Matrix) -> Vector:
    """Return the integral of `r x U r dm`."""
    return (
        dot(u[2], s[1]) - dot(u[1], s[2]),
        dot(u[0], s[2]) - dot(u[2], s[0]),
        dot(u[1], s[0]) - dot(u[0], s[1]),
    )


def add(a: Vector, b: Vector) -> Vector:
    """Return the sum of two vectors."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def scale(a: Vector, factor: Scalar) -> Vector:
    """Return a vector times a number."""
    return a[0] * factor, a[1] * factor, a[2] * factor


def dot(a: Vector, b: Vector) -> Scalar:
    """Return the inner product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Return the cross product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def times(m: Matrix, v: Vector) -> Vector:
    """Return matrix times vector."""
    return dot(m[0], v), dot(m[1], v), dot(m[2], v)


def turned_back(m: Matrix, v: Vector) -> Vector:
    """Return the transposed matrix times vector."""
    return times(((m[0][0], m[1][0], m[2][0]), (m[0][1], m[1][1], m[2][1]), (m[0][2], m[1][2], m[2][2])), v)


def named(trace: Trace, vector: Vector, name: str) -> Vector:
    """Return the vector, its entries named x, y, z."""
    for entry, letter in zip(vector, "xyz", strict=True):
        trace.named(entry, f"{name}{letter}")
    return vector


def _named(trace: Trace, matrix: Matrix, name: str) -> Matrix:
    for row, letter in zip(matrix, "xyz", strict=True):
        named(trace, row, f"{name}{letter}")
    return matrix


def _plus(a: Matrix, b: Matrix) -> Matrix:
    return add(a[0], b[0]), add(a[1], b[1]), add(a[2], b[2])


def _scaled(a: Matrix, factor: Scalar) -> Matrix:
    return scale(a[0], factor), scale(a[1], factor), scale(a[2], factor)


def _vector(trace: Trace, values: FloatArray) -> Vector:
    return trace.scalar(values[0]), trace.scalar(values[1]), trace.scalar(values[2])


def _matrix(trace: Trace, values: FloatArray) -> Matrix:
    return _vector(trace, values[0]), _vector(trace, values[1]), _vector(trace, values[2])


def _triple(values: Sequence[Scalar]) -> Vector:
    return values[0], values[1], values[2]


def _snapped(values: FloatArray) -> FloatArray:
    near = np.round(values)
    return np.where(np.abs(values - near) < _ROUNDING, near, values)
