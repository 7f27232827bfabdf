"""The comment at the head of the C file: units, signs, how to call it, and all numbers that are in it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.export.cfunctions import steady_widths
from tauhat.export.comments import plain_letters
from tauhat.export.friction import LAWS
from tauhat.export.parameters import StandardParameters
from tauhat.robots.joint import central_inertia
from tauhat.robots.robot import Robot


def header_comment(robot: Robot, parameters: StandardParameters, prefix: str, fingerprint: str) -> str:
    """Return the comment, whatever robot and joints are called.

    Parameters
    ----------
    prefix : of all names in the file
    fingerprint : of the model
    """
    lines = [
        f"{prefix}: dynamics of {robot.name}, written by tauhat.",
        "",
        "Units: SI on the joint side of the gear: rad, rad/s, rad/s^2, Nm, kg m^2 (prismatic: m, m/s, m/s^2, N, kg).",
        "tau is what the motor delivers, positive along q:",
        "    mass_matrix(q) ddq + bias(q, dq) + friction(q, dq, ddq) = torque(q, dq, ddq),  bias(q, 0) = gravity(q)",
        "inverse_dynamics is torque without friction; rotor inertia is in it and in the mass matrix.",
        "Arrays have one entry a joint. Results may be written over arguments. No allocation, no loops.",
        "",
        *_memory_lines(robot, parameters, prefix),
        f"Gravity in the base frame [m/s^2]: {_row(robot.gravity)}",
        f"Model: {fingerprint}",
        *_warnings(robot, parameters),
        "",
        "Joints, and the links that they move (centre and inertia about it, in the axes of the joint frame):",
    ]
    for index in range(robot.n_v):
        lines += _joint_lines(index, robot, parameters)
    lines += _motor_lines(parameters)
    return "/*\n" + "".join(f" * {_harmless(line)}".rstrip() + "\n" for line in lines) + " */"


def _memory_lines(robot: Robot, parameters: StandardParameters, prefix: str) -> Iterator[str]:
    if not parameters.with_memory:
        return
    yield f"Friction with a memory ({', '.join(parameters.with_memory)}) is here twice:"
    yield "  friction and torque have no state; the gear counts as bent to its end, tanh(dq / width), with the widths"
    yield f"    {_row(steady_widths(robot))} rad/s (prismatic: m/s)"
    yield "  friction_step and torque_step are exact, with what the caller keeps:"
    yield f"    {prefix}_friction_state state;"
    yield f"    {prefix}_friction_start(&state, q);                 at standstill, before the first sample"
    yield f"    {prefix}_friction_step(&state, q, dq, ddq, tau);    every sample, in order"
    yield "  Each call is a sample: call one of the two, with measured positions."
    yield ""


def _warnings(robot: Robot, parameters: StandardParameters) -> Iterator[str]:
    if parameters.left_out:
        yield f"Terms of the model that are not in here: {', '.join(parameters.left_out)}"
    negative = [robot.joints[index].name for index in np.flatnonzero(parameters.rotor < 0.0)]
    if negative:
        yield f"Rotor inertia was identified as negative: {', '.join(negative)}. The torque is the identified one; the"
        yield "mass matrix may not be positive definite, so do not invert it."


def _joint_lines(index: int, robot: Robot, parameters: StandardParameters) -> Iterator[str]:
    joint = robot.joints[index]
    mass, com, central = central_inertia(parameters.inertia[index])
    yield f"  [{index}] {joint.name}, {joint.kind} [{joint.unit}]"
    yield f"      mass {mass!r} kg, centre {_row(com)} m"
    yield f"      Ixx Ixy Ixz Iyy Iyz Izz {_row(central[np.triu_indices(3)])} kg m^2"
    if parameters.rotor[index]:
        yield f"      rotor {float(parameters.rotor[index])!r} {'kg m^2' if joint.kind == 'revolute' else 'kg'}"
    if parameters.springs[index]:
        yield f"      spring: Ks {float(parameters.springs[index])!r} {joint.effort_unit}/{joint.unit}"
    gas = parameters.gas_spring
    if gas is not None and gas.spring.joint == index:
        spring = gas.spring
        yield f"      gas-spring: Gs {gas.energy!r} J, distance {spring.distance!r} m, lever {spring.lever!r} m,"
        yield f"          angle {spring.angle!r} rad, area {spring.area!r} m^2, volume {spring.volume!r} m^3"
    yield from (f"      {text}" for text in _friction_texts(index, parameters))
    if joint.parent != index - 1:
        yield f"      carried by joint {joint.parent}" if joint.parent >= 0 else "      on the base"


def _friction_texts(index: int, parameters: StandardParameters) -> Iterator[str]:
    for law in parameters.friction:
        values = zip(LAWS[law.key].symbols, law.coefficients[:, index], strict=True)
        shape = f", {LAWS[law.key].shape_field} {float(law.shape[index])!r}" if law.shape.size else ""
        yield f"{law.key}: " + ", ".join(f"{symbol} {float(value)!r}" for symbol, value in values) + shape


def _motor_lines(parameters: StandardParameters) -> Iterator[str]:
    coupled = parameters.motors
    if coupled is None:
        return
    yield "Motors that turn with two joints:"
    for index, (own, other, ratio) in enumerate(coupled.motors):
        yield f"  q[{own}] + {ratio!r} q[{other}]: inertia {float(coupled.inertia[index])!r},"
        scale = f", scales {coupled.scales[index]!r}" if coupled.scales else ""
        yield f"      viscous {float(coupled.viscous[index])!r}, dry {_row(coupled.dry[index])}{scale}"


def _row(values: FloatArray) -> str:
    return " ".join(repr(float(value)) for value in values)


def _harmless(line: str) -> str:
    """Return text that cannot end a comment, start a trigraph or continue a line, whatever a robot is called."""
    plain = plain_letters(line)
    return plain.replace("*/", "* /").replace("/*", "/ *").replace("??", "? ?").rstrip("\\")
