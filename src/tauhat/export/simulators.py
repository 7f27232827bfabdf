"""What is told to simulators, which have words for masses, rotors, damping and dry friction, none of them negative."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import TauhatWarning
from tauhat.export.friction import FrictionLaw
from tauhat.export.parameters import StandardParameters, check_parameters
from tauhat.export.plain_friction import PlainFriction
from tauhat.robots.robot import Robot

_ROUGH = 0.2  # largest deviation of damping and dry friction from the model's, in parts of it, without a warning
# What damping and dry friction stand for, once they are fitted; the others have no word in any case.
_FITTED = {"cube-root", "stribeck", "polynomial", "dahl", "load-coulomb", "load-dahl"}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ToldParameters:
    """What a simulator is told of a model, and what not.

    inertia, rotor : (n_v, 10), (n_v,), the latter not negative
    friction : neither number negative
    left_out : what there is no word for, with the largest coefficient
    set_to_zero : what came out negative and cannot be, by name, with its value
    """

    inertia: FloatArray
    rotor: FloatArray
    friction: PlainFriction
    left_out: Mapping[str, float]
    set_to_zero: Mapping[str, float]


def told_parameters(robot: Robot, parameters: StandardParameters) -> ToldParameters:
    """Return what can be told to a simulator.

    Raises
    ------
    ExportError
        when a link is no body, naming it, or the parameters are of another robot.

    Warns
    -----
    TauhatWarning
        when something is negative and is set to zero, and when damping and dry friction are far from the model's.
    """
    check_parameters(robot, parameters)
    plain = parameters.plain_friction
    given = {"rotor": parameters.rotor, "damping": plain.damping, "dry friction": plain.dry_friction}
    negative = {
        f"{what} of {robot.joints[joint].name}": float(values[joint])
        for what, values in given.items()
        if values is not None
        for joint in np.flatnonzero(values < 0.0)
    }
    _warn(negative, plain)
    friction = replace(plain, damping=_lifted(plain.damping), dry_friction=_lifted(plain.dry_friction))
    return ToldParameters(
        inertia=parameters.inertia,
        rotor=np.maximum(parameters.rotor, 0.0),
        friction=friction,
        left_out=_untold(parameters),
        set_to_zero=negative,
    )


def _lifted(values: FloatArray | None) -> FloatArray | None:
    return None if values is None else np.maximum(values, 0.0)


def _untold(parameters: StandardParameters) -> dict[str, float]:
    """Return what simulators have no word for -> largest coefficient."""
    is_fitted = bool(parameters.plain_friction.approximations)
    untold = {law.key: _untold_size(law, is_fitted) for law in parameters.friction}
    untold["spring"] = float(np.abs(parameters.springs).max(initial=0.0))
    untold["gas-spring"] = abs(parameters.gas_spring.energy) if parameters.gas_spring else 0.0
    if parameters.motors is not None:
        untold[parameters.motors.key] = parameters.motors.largest
    return {key: size for key, size in untold.items() if size > 0.0}


def _untold_size(law: FrictionLaw, is_fitted: bool) -> float:
    if law.key in {"viscous", "coulomb"} or (is_fitted and law.key in _FITTED):
        return 0.0
    if is_fitted and law.key == "asymmetric":  # the mean of both directions is told
        return float(0.5 * np.abs(law.coefficients[::2] - law.coefficients[1::2]).max())
    return law.largest


def _warn(negative: Mapping[str, float], plain: PlainFriction) -> None:
    if negative:
        values = ", ".join(f"{name} ({value:.3g})" for name, value in negative.items())
        warnings.warn(f"negative, which simulators refuse, and set to zero: {values}", TauhatWarning, stacklevel=4)
    rough = [one for one in plain.approximations if one.share > _ROUGH]
    if rough:
        parts = (f"{one.joint} ({100.0 * one.share:.0f} % at {one.worst_speed:.2g} {one.speed_unit})" for one in rough)
        warnings.warn(
            f"damping and dry friction are far from the identified friction: {', '.join(parts)}; the C code has all "
            "of it",
            TauhatWarning,
            stacklevel=4,
        )
