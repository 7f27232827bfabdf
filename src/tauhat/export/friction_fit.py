"""Damping and dry friction that come nearest to an identified model's friction, for programs that know nothing else.

The model's friction in steady motion is compared at speeds up to the recorded top speed, each weighed with its own
standard error. Neither number may become negative. The load of load-dependent friction is the mean of gravity over the
poses inside the limits: the zero pose of many arms is the stretched one, whose load is the largest of all.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.base import random_motion
from tauhat.dynamics.rigid_body import gravity_torque
from tauhat.estimation.estimate import Estimate
from tauhat.export.friction import LAWS, FrictionLaw
from tauhat.export.parameters import StandardParameters
from tauhat.export.plain_friction import Approximation, PlainFriction, textbook_friction
from tauhat.robots.robot import Robot
from tauhat.simulation.typical import top_speeds

_PARTS = np.linspace(0.05, 1.0, 20)  # of the top speed, at which friction is compared
_SUREST = 1e-3  # smallest error that a speed is weighed with, in parts of the joint's friction: none is infinite
_TEXTBOOK = {"viscous", "coulomb", "viscous-asymmetry", "offset"}  # the last two cancel over both directions
_POSES = 1000
_SEED = 20240411


def fitted_friction(estimate: Estimate, parameters: StandardParameters, *, standard: FloatArray) -> PlainFriction:
    """Return damping and dry friction of the laws in `parameters`, exact where they are viscous and Coulomb friction.

    Otherwise both minimise `sum_k ((damping v_k + dry - f(v_k)) / error_k)^2`, neither negative, over 5 to 100 % of the
    joint's top speed in the fitted recordings (an old estimate does not know it: of its limit, or 1 rad/s or m/s).

    Parameters
    ----------
    parameters : of the estimate, some terms of which may be left out
    standard : (n_p,) of the estimate

    Source: Lawson, Hanson, "Solving least squares problems", 1974 (non-negative least squares).
    """
    own = textbook_friction(parameters.friction)
    coefficients = [law.coefficients for law in parameters.friction if law.key in {"viscous", "coulomb"}]
    is_textbook = {law.key for law in parameters.friction} <= _TEXTBOOK and parameters.motors is None
    if is_textbook and min((part.min() for part in coefficients), default=0.0) >= 0.0:
        return own
    speeds = _PARTS[:, None] * _fastest(estimate)
    unloaded = _without_load(estimate, parameters, standard)
    steady = [unloaded.friction(row) for row in speeds]
    torque = np.array([one.torque for one in steady]) + _of_mean_load(estimate.robot, parameters, speeds)
    errors = np.array([one.standard_errors for one in steady])
    fits = [_fitted(*columns) for columns in zip(speeds.T, torque.T, errors.T, strict=True)]
    approximations = [
        _approximation(estimate.robot, joint, fit, (speeds[:, joint], torque[:, joint]))
        for joint, fit in enumerate(fits)
    ]
    damping, dry = np.array(fits).T
    return PlainFriction(damping=damping, dry_friction=dry, approximations=tuple(approximations))


def _without_load(estimate: Estimate, parameters: StandardParameters, standard: FloatArray) -> Estimate:
    """Return the estimate with zeros for the terms that are left out or of the load."""
    absent = {key for key, form in LAWS.items() if form.of_load} | set(parameters.left_out)
    terms = [term for term in estimate.model.terms for _ in term.parameters(estimate.robot)]
    kept = np.where([term.key in absent for term in terms], 0.0, standard)
    return replace(estimate, values=estimate.base.projection @ kept, standard=kept)


def _fastest(estimate: Estimate) -> FloatArray:
    """Return the top speed of each joint in the fitted recordings, its limit where none is known."""
    limits = top_speeds(estimate.robot)
    if estimate.top_speeds is None:
        return limits
    return np.where(estimate.top_speeds > 0.0, estimate.top_speeds, limits)


def _of_mean_load(robot: Robot, parameters: StandardParameters, speeds: FloatArray) -> FloatArray:
    poses = random_motion(robot, _POSES, np.random.default_rng(_SEED)).q.T
    total = np.zeros_like(speeds)
    for law in parameters.friction:
        if LAWS[law.key].of_load:
            load = np.abs(gravity_torque(robot, poses, inertia=law.load)).mean(axis=0)
            total += law.coefficients[0] * load * _sign(law, speeds)
    return total


def _sign(law: FrictionLaw, speeds: FloatArray) -> FloatArray:
    return np.tanh(speeds / law.shape) if law.shape.size else np.ones_like(speeds)


def _fitted(speeds: FloatArray, torque: FloatArray, errors: FloatArray) -> FloatArray:
    """Return damping and dry friction of one joint, (2,)."""
    from scipy.optimize import nnls

    if not torque.any():
        return np.zeros(2)
    weights = 1.0 / np.maximum(errors, _SUREST * float(np.abs(torque).max()))
    top = speeds[-1]
    values, _ = nnls(np.column_stack([speeds / top, np.ones_like(speeds)]) * weights[:, None], torque * weights)
    return np.asarray(values / (top, 1.0))


def _approximation(robot: Robot, joint: int, fit: FloatArray, compared: tuple[FloatArray, FloatArray]) -> Approximation:
    speeds, torque = compared
    apart = np.abs(fit[0] * speeds + fit[1] - torque)
    known = np.divide(apart, np.abs(torque), out=np.full_like(apart, np.inf), where=torque != 0.0)
    parts = np.where(apart == 0.0, 0.0, known)
    return Approximation(
        joint=robot.joints[joint].name,
        unit=robot.joints[joint].effort_unit,
        speed_unit=f"{robot.joints[joint].unit}/s",
        damping=float(fit[0]),
        dry_friction=float(fit[1]),
        deviation=float(apart.max()),
        share=float(parts.max()),
        worst_speed=float(speeds[parts.argmax()]),
        slowest=float(speeds[0]),
        fastest=float(speeds[-1]),
    )
