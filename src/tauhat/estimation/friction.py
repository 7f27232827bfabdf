"""What an identified model says about friction, whatever its terms: torque against steady motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray
from tauhat.dynamics.base import BaseParameters
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.motion import Motion

_RUN = 0.5  # [rad or m] of steady motion: every pre-sliding is over
_SAMPLES = 200


class SteadyFriction(NamedTuple):
    """Friction torque against a steady speed and its standard error, (n_v,) each [Nm or N]; positive: it brakes."""

    torque: FloatArray
    standard_errors: FloatArray


def steady_friction(
    model: TorqueModel, base: BaseParameters, values: FloatArray, covariance: FloatArray, speeds: FloatArray
) -> SteadyFriction:
    """Return the friction of each joint when it alone moves one way for long: half the difference of both directions.

    Parameters
    ----------
    values, covariance : of the base parameters, (n_b,), (n_b, n_b)
    speeds : (n_v,) of the joints, positive [rad/s or m/s]

    Only terms that dissipate count; the load of load-dependent friction is that of the pose in which all joints are at
    zero. The others stand still: a motor that turns with two joints would brake each with the other's speed.
    """
    rows = np.zeros((model.robot.n_v, base.n_b))
    for joint in range(model.robot.n_v):
        alone = np.where(np.arange(model.robot.n_v) == joint, speeds, 0.0)
        rows[joint] = 0.5 * (_columns_at(model, base, alone) - _columns_at(model, base, -alone))[joint]
    rows *= braking_parameters(model)[base.independent]
    return SteadyFriction(rows @ values, np.sqrt(np.einsum("jk,kl,jl->j", rows, covariance, rows)))


def braking_parameters(model: TorqueModel) -> NDArray[np.bool_]:
    """Return which standard parameters belong to terms that dissipate, (n_p,)."""
    return np.array([term.dissipates for term in model.terms for _ in term.parameters(model.robot)])


def _columns_at(model: TorqueModel, base: BaseParameters, speeds: FloatArray) -> FloatArray:
    """Return the regressor at the end of a steady run towards zero, (n_v, n_b)."""
    way = np.sign(speeds)[:, None] * np.linspace(-_RUN, 0.0, _SAMPLES)
    motion = Motion(q=way, dq=np.tile(speeds[:, None], (1, _SAMPLES)), ddq=np.zeros_like(way))
    layout = model.layout(base.independent)
    columns, _ = model.columns(motion, layout)
    place = np.full(len(base.names), -1)
    place[base.independent] = np.arange(base.n_b)
    rows = np.zeros((model.robot.n_v, base.n_b))
    for joint in range(model.robot.n_v):
        part = layout.of_joint(joint)
        rows[joint, place[layout.parameters[part]]] = columns[part, -1]
    return rows
