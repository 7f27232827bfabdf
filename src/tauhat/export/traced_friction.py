"""Friction on traced numbers: every law as the expression in a joint's speed that C evaluates."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TypeAlias

from tauhat.arrays import FloatArray
from tauhat.export.friction import FrictionLaw
from tauhat.export.tracing import Scalar, Trace

Torque: TypeAlias = Callable[[Trace, Scalar, FloatArray, float], Scalar]

# Width of the smooth sign beside a Stribeck curve, in parts of its speed, as the terms have it.
_SHARPNESS = 0.1


def traced_friction(trace: Trace, laws: Sequence[FrictionLaw], dq: Sequence[Scalar]) -> tuple[Scalar, ...]:
    """Return the friction torque of each joint, the sum of all laws.

    Parameters
    ----------
    dq : joint speeds of the C function
    """
    torques = []
    for index, speed in enumerate(dq):
        total = trace.scalar(0.0)
        for law in laws:
            coefficients = law.coefficients[:, index]
            if coefficients.any():
                shape = float(law.shape[index]) if law.shape.size else 0.0
                total = total + _TORQUES[law.key](trace, speed, coefficients, shape)
        torques.append(total)
    return tuple(torques)


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
    "offset": _offset,
    "cube-root": _cube_root,
    "viscous-asymmetry": _viscous_asymmetry,
    "asymmetric": _asymmetric,
    "stribeck": _stribeck,
    "polynomial": _polynomial,
}
