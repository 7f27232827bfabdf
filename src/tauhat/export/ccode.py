"""One C99 header with a robot's dynamics for a controller: no allocation, no loops, nothing but math.h."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ExportError
from tauhat.export.exported import ExportedText
from tauhat.export.friction import LAWS
from tauhat.export.parameters import StandardParameters, check_parameters
from tauhat.export.traced_dynamics import Speeds, traced_inverse_dynamics, traced_joints, traced_mass_matrix
from tauhat.export.traced_friction import traced_friction
from tauhat.export.tracing import Scalar, Trace
from tauhat.robots.joint import central_inertia
from tauhat.robots.robot import Robot

_LONGEST_PREFIX = 60
_PREFIX = re.compile(r"[a-z][a-z0-9_]*")
_SIGN = re.compile(r"\bsign\(")


@dataclass(frozen=True, slots=True, kw_only=True)
class CFunction:
    """A C function and what it calculates.

    name : behind the prefix
    says : first line of its comment
    inputs : arguments of n_v numbers each
    output : its declaration
    results : what is assigned -> value
    """

    name: str
    says: str
    inputs: tuple[str, ...]
    output: str
    trace: Trace
    results: Mapping[str, Scalar]


def ccode(robot: Robot, parameters: StandardParameters, *, prefix: str = "", fingerprint: str = "") -> ExportedText:
    """Return a header-only C99 file: inverse dynamics, bias, gravity, mass matrix, friction, and the whole torque.

    All numbers of the robot are written into straight-line code, in which what is zero or one is gone. Arrays are of
    fixed size, results may be written over arguments, and every function can be called from any thread.

    Parameters
    ----------
    prefix : of all names, lower case; made from the robot's name by default
    fingerprint : of the model, for the head of the file; the robot's own by default

    Raises
    ------
    ExportError
        when a link is no body, naming it, the parameters are of another robot, or the prefix is no C name.
    """
    check_parameters(robot, parameters)
    prefix = prefix or c_prefix(robot.name)
    if not _PREFIX.fullmatch(prefix) or len(prefix) > _LONGEST_PREFIX:
        expected = f"lower-case letters, digits and _, at most {_LONGEST_PREFIX}"
        raise ExportError("the prefix is no C name", expected=expected, got=prefix[:80])
    guard = f"TAUHAT_{prefix.upper()}_H"
    parts = [
        _head(robot, parameters, prefix, fingerprint or robot.fingerprint),
        f"#ifndef {guard}\n#define {guard}\n\n#include <math.h>\n\n#define {prefix.upper()}_JOINTS {robot.n_v}\n",
        *(_written(function, prefix, robot.n_v) for function in c_functions(robot, parameters)),
        f"#endif /* {guard} */\n",
    ]
    return ExportedText(text="\n".join(parts))


def c_prefix(name: str) -> str:
    """Return a robot's name as the beginning of C names: lower case, `robot_` before a digit."""
    words = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")[: _LONGEST_PREFIX - 6]
    return words if words[:1].isalpha() else f"robot_{words}".rstrip("_")


def c_functions(robot: Robot, parameters: StandardParameters) -> tuple[CFunction, ...]:
    """Return the functions of the header, in order."""
    full = ("q", "dq", "ddq")
    return (
        _torque_function(
            robot, parameters, "inverse_dynamics", ("Torque of links and rotors in motion, without friction.", full)
        ),
        _torque_function(robot, parameters, "bias", ("Torque of the links at constant joint speeds.", ("q", "dq"))),
        _torque_function(robot, parameters, "gravity", ("Torque that holds the links still.", ("q",))),
        _mass_function(robot, parameters),
        _friction_function(robot, parameters),
        _whole_function(robot, parameters),
    )


def _torque_function(
    robot: Robot, parameters: StandardParameters, name: str, about: tuple[str, tuple[str, ...]]
) -> CFunction:
    says, inputs = about
    trace = Trace()
    torque = _rigid_torque(trace, robot, parameters, inputs)
    return CFunction(name=name, says=says, inputs=inputs, output="tau", trace=trace, results=_assigned(torque))


def _mass_function(robot: Robot, parameters: StandardParameters) -> CFunction:
    trace = Trace()
    matrix = traced_mass_matrix(trace, traced_joints(trace, robot, parameters), parameters.rotor)
    results = {f"mass[{i}][{k}]": value for i, entries in enumerate(matrix) for k, value in enumerate(entries)}
    says = "Mass matrix of links and rotors, symmetric."
    return CFunction(name="mass_matrix", says=says, inputs=("q",), output="mass", trace=trace, results=results)


def _friction_function(robot: Robot, parameters: StandardParameters) -> CFunction:
    trace = Trace()
    torque = traced_friction(trace, parameters.friction, _variables(trace, "dq", robot.n_v))
    says = "Friction and offset of the joints."
    return CFunction(name="friction", says=says, inputs=("dq",), output="tau", trace=trace, results=_assigned(torque))


def _whole_function(robot: Robot, parameters: StandardParameters) -> CFunction:
    trace, inputs = Trace(), ("q", "dq", "ddq")
    rigid = _rigid_torque(trace, robot, parameters, inputs)
    friction = traced_friction(trace, parameters.friction, _variables(trace, "dq", robot.n_v))
    torque = [part + other for part, other in zip(rigid, friction, strict=True)]
    says = "What the motors deliver: inverse dynamics and friction."
    return CFunction(name="torque", says=says, inputs=inputs, output="tau", trace=trace, results=_assigned(torque))


def _rigid_torque(
    trace: Trace, robot: Robot, parameters: StandardParameters, inputs: Sequence[str]
) -> tuple[Scalar, ...]:
    rest = [trace.scalar(0.0)] * robot.n_v
    dq, ddq = (_variables(trace, name, robot.n_v) if name in inputs else rest for name in ("dq", "ddq"))
    return traced_inverse_dynamics(
        trace,
        traced_joints(trace, robot, parameters),
        gravity=robot.gravity,
        speeds=Speeds(dq, ddq),
        rotor=parameters.rotor,
    )


def _variables(trace: Trace, name: str, n_v: int) -> list[Scalar]:
    return [trace.variable(f"{name}[{index}]") for index in range(n_v)]


def _assigned(torque: Sequence[Scalar]) -> dict[str, Scalar]:
    return {f"tau[{index}]": value for index, value in enumerate(torque)}


def _written(function: CFunction, prefix: str, n_v: int) -> str:
    lines = function.trace.statements(function.results)
    body = "\n".join(lines)
    size = f"[{n_v}][{n_v}]" if function.output == "mass" else f"[{n_v}]"
    arguments = [*(f"const double {name}[{n_v}]" for name in function.inputs), f"double {function.output}{size}"]
    unused = "".join(f"    (void){name};\n" for name in function.inputs if not re.search(rf"\b{name}\[", body))
    indented = "".join(f"    {re.sub(_SIGN, f'{prefix}_sign(', line)}\n" for line in lines)
    sign = _sign_function(prefix) if function.name == "friction" and re.search(_SIGN, body) else ""
    declared = f"static inline void {prefix}_{function.name}({', '.join(arguments)})"
    return f"{sign}/* {function.says} */\n{declared}\n{{\n{unused}{indented}}}\n"


def _sign_function(prefix: str) -> str:
    body = "return (double)((value > 0.0) - (value < 0.0));"
    return f"/* -1, 0 or 1. */\nstatic inline double {prefix}_sign(double value)\n{{\n    {body}\n}}\n\n"


def _head(robot: Robot, parameters: StandardParameters, prefix: str, fingerprint: str) -> str:
    lines = [
        f"{prefix}: dynamics of {robot.name}, written by tauhat.",
        "",
        "Units: SI on the joint side of the gear: rad, rad/s, rad/s^2, Nm, kg m^2 (prismatic: m, m/s, m/s^2, N, kg).",
        "tau is what the motor delivers, positive along q:",
        "    mass_matrix(q) ddq + bias(q, dq) + friction(dq) = torque(q, dq, ddq),  bias(q, 0) = gravity(q)",
        "inverse_dynamics is torque without friction; rotor inertia is in it and in the mass matrix.",
        "Arrays have one entry a joint. Results may be written over arguments. No state, no allocation, no loops.",
        "",
        f"Gravity in the base frame [m/s^2]: {_row(robot.gravity)}",
        f"Model: {fingerprint}",
        *(
            [f"Terms of the model that are not in here: {', '.join(parameters.left_out)}"]
            if parameters.left_out
            else []
        ),
        "",
        "Joints, and the links that they move (centre and inertia about it, in the axes of the joint frame):",
    ]
    for index, joint in enumerate(robot.joints):
        lines += _joint_lines(index, robot, parameters)
        lines += [f"      {text}" for text in _friction_texts(index, parameters)]
        if joint.parent != index - 1:
            lines.append(f"      carried by joint {joint.parent}" if joint.parent >= 0 else "      on the base")
    return "/*\n" + "".join(f" * {_harmless(line)}".rstrip() + "\n" for line in lines) + " */"


def _joint_lines(index: int, robot: Robot, parameters: StandardParameters) -> list[str]:
    joint = robot.joints[index]
    mass, com, central = central_inertia(parameters.inertia[index])
    moments = central[np.triu_indices(3)]
    lines = [
        f"  [{index}] {joint.name}, {joint.kind} [{joint.unit}]",
        f"      mass {mass!r} kg, centre {_row(com)} m",
        f"      Ixx Ixy Ixz Iyy Iyz Izz {_row(moments)} kg m^2",
    ]
    rotor = float(parameters.rotor[index])
    unit = "kg m^2" if joint.kind == "revolute" else "kg"
    return [*lines, f"      rotor {rotor!r} {unit}"] if rotor else lines


def _friction_texts(index: int, parameters: StandardParameters) -> list[str]:
    texts = []
    for law in parameters.friction:
        values = zip(LAWS[law.key].symbols, law.coefficients[:, index], strict=True)
        shape = f", {LAWS[law.key].shape_field} {float(law.shape[index])!r}" if law.shape.size else ""
        texts.append(f"{law.key}: " + ", ".join(f"{symbol} {float(value)!r}" for symbol, value in values) + shape)
    return texts


def _row(values: FloatArray) -> str:
    return " ".join(repr(float(value)) for value in values)


def _harmless(line: str) -> str:
    """Return text that cannot end a comment, start a trigraph or continue a line, whatever a robot is called."""
    plain = "".join(letter if letter.isprintable() and letter.isascii() else "?" for letter in line)
    return plain.replace("*/", "* /").replace("/*", "/ *").replace("??", "? ?").rstrip("\\")
