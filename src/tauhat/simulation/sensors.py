"""Sensor errors: what a log shows of the true motion and torque."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import SimulationError


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SensorErrors:
    """Errors of a robot's sensors, one number for all joints or (n_v,) each; zero means a perfect sensor.

    encoder_step : quantisation of the position [rad or m]
    velocity_noise : standard deviation of a measured velocity [rad/s or m/s]; None where the log has no velocity
    torque_noise : standard deviation of white torque noise [Nm or N]
    relative_torque_noise : the same as a fraction of each joint's RMS torque; both add up as variances
    torque_offset : constant error of the torque [Nm or N]
    """

    encoder_step: float | FloatArray = 0.0
    velocity_noise: float | FloatArray | None = None
    torque_noise: float | FloatArray = 0.0
    relative_torque_noise: float | FloatArray = 0.0
    torque_offset: float | FloatArray = 0.0

    def __post_init__(self) -> None:
        for name in ("encoder_step", "velocity_noise", "torque_noise", "relative_torque_noise", "torque_offset"):
            value = getattr(self, name)
            if value is None:
                continue
            values = np.array(value, dtype=np.float64)
            values.setflags(write=False)
            if values.ndim > 1 or not np.isfinite(values).all():
                raise SimulationError(f"sensor error {name}", expected="one finite number, or one a joint", got=value)
            if name != "torque_offset" and values.min() < 0.0:
                raise SimulationError(f"sensor error {name} is negative", got=value)
            object.__setattr__(self, name, values)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Measured:
    """What the sensors show, (n_t, n_v) each: q [rad or m], dq [rad/s or m/s] where measured, tau [Nm or N]."""

    q: FloatArray
    dq: FloatArray | None
    tau: FloatArray


def measure(
    errors: SensorErrors, q: FloatArray, dq: FloatArray, *, tau: FloatArray, rng: np.random.Generator
) -> Measured:
    """Return the true motion and torque as the sensors show them.

    Parameters
    ----------
    q, dq, tau : (n_t, n_v) true position, velocity and motor torque

    Raises
    ------
    SimulationError
        when an error has not one value a joint.
    """
    n_v = q.shape[1]
    step = _per_joint("encoder_step", errors.encoder_step, n_v)
    deviation = np.hypot(
        _per_joint("torque_noise", errors.torque_noise, n_v),
        _per_joint("relative_torque_noise", errors.relative_torque_noise, n_v) * np.sqrt(np.mean(tau**2, axis=0)),
    )
    offset = _per_joint("torque_offset", errors.torque_offset, n_v)
    torque = tau + offset + deviation * rng.standard_normal(tau.shape)
    velocity = None
    if errors.velocity_noise is not None:
        noise = _per_joint("velocity_noise", errors.velocity_noise, n_v)
        velocity = dq + noise * rng.standard_normal(dq.shape)
    return Measured(q=quantised(q, step), dq=velocity, tau=torque)


def quantised(values: FloatArray, step: FloatArray) -> FloatArray:
    """Return values (n_t, n_v) rounded to multiples of step (n_v,); a step of zero leaves them as they are."""
    rounded = np.array(values)
    coarse = step > 0.0
    rounded[:, coarse] = step[coarse] * np.round(values[:, coarse] / step[coarse])
    return rounded


def _per_joint(name: str, value: float | FloatArray, n_v: int) -> FloatArray:
    values = np.asarray(value, dtype=np.float64)
    if values.shape not in {(), (n_v,)}:
        raise SimulationError(
            f"sensor error {name} does not fit the robot", expected=f"1 or {n_v} values", got=values.size
        )
    return np.broadcast_to(values, (n_v,))
