"""Friction on traced numbers: every law as the expression that C evaluates."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TypeAlias

from tauhat.arrays import FloatArray
from tauhat.export.drives import CoupledMotors
from tauhat.export.friction import LAWS, FrictionLaw
from tauhat.export.parameters import StandardParameters
from tauhat.export.traced_memory import DryStates, along
from tauhat.export.tracing import Scalar, Trace

Torque: TypeAlias = Callable[[Trace, Scalar, FloatArray, float], Scalar]
Loads: TypeAlias = Callable[[FloatArray], Sequence[Scalar]]

# Width of the smooth sign beside a Stribeck curve, in parts of its speed, as the terms have it.
_SHARPNESS = 0.1


def traced_friction(
    trace: Trace, parameters: StandardParameters, dq: Sequence[Scalar], *, dry: DryStates, loads: Loads
) -> tuple[Scalar, ...]:
    """Return the friction torque of each joint, the sum of all laws and of the coupled motors.

    Parameters
    ----------
    dq : joint speeds of the C function
    dry : where the states of laws with a memory come from
    loads : inertial parameters (n_v, 10) -> rigid torque of each joint
    """
    torques = [trace.scalar(0.0)] * len(dq)
    for law in parameters.friction:
        load = loads(law.load) if LAWS[law.key].of_load and law.largest > 0.0 else ()
        for joint, speed in enumerate(dq):
            if law.coefficients[:, joint].any():
                torque = _own(trace, law, joint, speed) if not law.has_memory else _dahl(trace, law, joint, dry)
                factor = trace.call("fabs", load[joint]) if load else trace.scalar(1.0)
                torques[joint] = torques[joint] + factor * torque
    if parameters.motors is not None:
        _add_motors(trace, parameters.motors, torques, dq=dq, dry=dry)
    return tuple(torques)


def _own(trace: Trace, law: FrictionLaw, joint: int, speed: Scalar) -> Scalar:
    shape = float(law.shape[joint]) if law.shape.size else 0.0
    return _TORQUES[law.key](trace, speed, law.coefficients[:, joint], shape)


def _dahl(trace: Trace, law: FrictionLaw, joint: int, dry: DryStates) -> Scalar:
    total = trace.scalar(0.0)
    for coefficient, length in zip(law.coefficients[:, joint], law.lengths(joint), strict=True):
        if coefficient:
            total = total + float(coefficient) * dry.state({joint: 1.0}, length)
    return total


def _add_motors(
    trace: Trace, coupled: CoupledMotors, torques: list[Scalar], *, dq: Sequence[Scalar], dry: DryStates
) -> None:
    for index, (own, other, ratio) in enumerate(coupled.motors):
        viscous = float(ratio * coupled.viscous[index])
        turning = _motor_friction(trace, coupled, index, dq=dq, dry=dry)
        torques[own] = torques[own] + viscous * dq[other] + turning
        torques[other] = torques[other] + viscous * dq[own] + float(ratio) * turning


def _motor_friction(
    trace: Trace, coupled: CoupledMotors, index: int, *, dq: Sequence[Scalar], dry: DryStates
) -> Scalar:
    motor, coefficients = coupled.motors[index], coupled.dry[index]
    way = {motor.own: 1.0, motor.other: motor.ratio}
    if coefficients.size == 1:
        width = coupled.widths[index] if coupled.widths else 0.0
        return float(coefficients[0]) * _sign(trace, along(trace, way, dq), width)
    total = trace.scalar(0.0)
    for coefficient, length in zip(coefficients, coupled.lengths(index), strict=True):
        if coefficient:
            total = total + float(coefficient) * dry.state(way, length)
    return total


def _viscous(_: Trace, dq: Scalar, coefficients: FloatArray, __: float) -> Scalar:
    return float(coefficients[0]) * dq


def _coulomb(trace: Trace, dq: Scalar, coefficients: FloatArray, width: float) -> Scalar:
    return float(coefficients[0]) * _sign(trace, dq, width)


def _offset(trace: Trace, _: Scalar, coefficients: FloatArray, __: float) -> Scalar:
    return trace.scalar(coefficients[0])


def _cube_root(trace: Trace, dq: Scalar, coefficients: FloatArray, _: float) -> Scalar:
    return float(coefficients[0]) * trace.call("cbrt", dq)


def _viscous_asymmetry(trace: Trace, dq: Scalar, coefficients: FloatArray, _: float) -> Scalar:
    return float(coefficients[0]) * trace.call("fabs", dq)


def _asymmetric(trace: Trace, dq: Scalar, coefficients: FloatArray, width: float) -> Scalar:
    sign = _sign(trace, dq, width)
    parts = [trace.call(side, part, 0.0) for part in (dq, sign) for side in ("fmax", "fmin")]
    return _weighted(trace, coefficients, parts)


def _stribeck(trace: Trace, dq: Scalar, coefficients: FloatArray, speed: float) -> Scalar:
    ratio = dq * (1.0 / speed)
    return float(coefficients[0]) * (trace.call("exp", -(ratio * ratio)) * _sign(trace, dq, _SHARPNESS * speed))


def _polynomial(trace: Trace, dq: Scalar, coefficients: FloatArray, speed: float) -> Scalar:
    sign, size = _sign(trace, dq, _SHARPNESS * speed), trace.call("fabs", dq)
    bump = trace.call("exp", size * (-1.0 / speed)) * sign
    return _weighted(trace, coefficients, [sign, dq, size * dq, dq * dq * dq, bump])


def _sign(trace: Trace, dq: Scalar, width: float) -> Scalar:
    if width > 0.0:
        return trace.call("tanh", dq * (1.0 / width))
    return trace.call("sign", dq)


def _weighted(trace: Trace, coefficients: FloatArray, parts: Sequence[Scalar]) -> Scalar:
    total = trace.scalar(0.0)
    for coefficient, part in zip(coefficients, parts, strict=True):
        total = total + float(coefficient) * part
    return total


_TORQUES: Mapping[str, Torque] = {
    "viscous": _viscous,
    "coulomb": _coulomb,
    "load-coulomb": _coulomb,
    "offset": _offset,
    "cube-root": _cube_root,
    "viscous-asymmetry": _viscous_asymmetry,
    "asymmetric": _asymmetric,
    "stribeck": _stribeck,
    "polynomial": _polynomial,
}
