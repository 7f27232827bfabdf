"""From the truth to the log: every channel as its sensor shows it, row by row as the log has them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.simulation.sensors.clock import kept_rows, sampling_instants, time_stamps
from tauhat.simulation.sensors.joint_values import per_joint
from tauhat.simulation.sensors.sensor_errors import SensorErrors

_HOUR = 3600.0  # [s]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Signals:
    """The truth at the ticks of the log's clock.

    t : (n_t,) ticks, evenly spaced [s]
    q, dq : (n_t, n_v) position and velocity of the side where the encoders are [rad, rad/s] or [m, m/s]
    tau : (n_t, n_v) torque of the side where it is sensed [Nm or N]
    link, motor : (n_t, n_v) position of both sides on the joint side, where ripple comes from; q by default
    """

    t: FloatArray
    q: FloatArray
    dq: FloatArray
    tau: FloatArray
    link: FloatArray | None = None
    motor: FloatArray | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Measured:
    """The rows of a log, (n, n_v) each.

    t : (n,) time stamps, increasing [s]
    q : [rad or m]
    dq : [rad/s or m/s], where the log has it
    tau : [Nm or N]
    rows : (n,) tick that each row was taken at
    """

    t: FloatArray
    q: FloatArray
    dq: FloatArray | None
    tau: FloatArray
    rows: IntArray


def measure(errors: SensorErrors, signals: Signals, *, rng: np.random.Generator) -> Measured:
    """Return the true motion and torque as the sensors show them.

    Between ticks, the position is the cubic through positions and velocities, the torque a straight line; before the
    start of the run the torque is that of the start, where the robot is at rest.

    Raises
    ------
    SimulationError
        when an error has not one value a joint, or jitter lets samples overtake each other.
    """
    n_v = signals.q.shape[1]
    sensors = errors.drawn(n_v, rng)
    instants = sampling_instants(sensors, signals.t, rng)
    torque = _torque(sensors, signals, instants, rng=rng)
    position, speed = _motion(signals, instants)
    shown = quantised(position, per_joint("encoder_step", sensors.encoder_step, n_v))
    velocity = _velocity(sensors, shown, speed, step=float(signals.t[1] - signals.t[0]), rng=rng)
    stamps = time_stamps(sensors, signals.t, instants, rng=rng)
    rows = kept_rows(sensors, signals.t.size, rng)
    return Measured(
        t=stamps[rows],
        q=shown[rows],
        dq=None if velocity is None else velocity[rows],
        tau=torque[rows],
        rows=rows,
    )


def quantised(values: FloatArray, step: FloatArray) -> FloatArray:
    """Return values (n_t, n_v) rounded to multiples of step (n_v,); a step of zero leaves them as they are."""
    rounded = np.array(values)
    coarse = step > 0.0
    rounded[:, coarse] = step[coarse] * np.round(values[:, coarse] / step[coarse])
    return rounded


def _torque(errors: SensorErrors, signals: Signals, instants: FloatArray, *, rng: np.random.Generator) -> FloatArray:
    """Return the torque channel, (n_t, n_v)."""
    n_v, read = signals.q.shape[1], instants - errors.torque_delay
    true = _straight(signals.t, signals.tau, read)
    shown = per_joint("torque_factor", errors.torque_factor, n_v) * true
    for ripple in errors.ripples:
        side = signals.motor if ripple.turns == "motor" else signals.link
        shown = shown + ripple.torque(_straight(signals.t, signals.q if side is None else side, read))
    deviation = np.hypot(
        per_joint("torque_noise", errors.torque_noise, n_v),
        per_joint("relative_torque_noise", errors.relative_torque_noise, n_v)
        * np.sqrt(np.mean(signals.tau**2, axis=0)),
    )
    offset = per_joint("torque_offset", errors.torque_offset, n_v)
    shown = shown + offset + deviation * rng.standard_normal(shown.shape)
    return np.asarray(shown + _drift(errors, instants, n_v, rng=rng))


def _drift(errors: SensorErrors, instants: FloatArray, n_v: int, *, rng: np.random.Generator) -> FloatArray:
    """Return the error that grows with time, (n_t, n_v): a straight line and a random walk."""
    hours = (instants - instants[0]) / _HOUR
    drift = per_joint("torque_drift", errors.torque_drift, n_v) * hours[:, None]
    if not np.any(errors.torque_walk):
        return np.asarray(drift)
    steps = np.sqrt(np.maximum(np.diff(hours, prepend=hours[0]), 0.0))[:, None]
    walk = per_joint("torque_walk", errors.torque_walk, n_v) * steps * rng.standard_normal((hours.size, n_v))
    return np.asarray(drift + np.cumsum(walk, axis=0))


def _motion(signals: Signals, instants: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return position and velocity at the instants, (n_t, n_v) each."""
    if instants is signals.t:
        return signals.q, signals.dq
    from scipy.interpolate import CubicHermiteSpline

    course = CubicHermiteSpline(signals.t, signals.q, signals.dq)
    return np.asarray(course(instants)), np.asarray(course(instants, 1))


def _velocity(
    errors: SensorErrors, shown: FloatArray, speed: FloatArray, *, step: float, rng: np.random.Generator
) -> FloatArray | None:
    """Return the velocity channel, (n_t, n_v), or None where the log has none."""
    if errors.velocity == "differenced":
        return np.diff(shown, axis=0, prepend=shown[:1]) / step
    if errors.velocity_noise is None:
        return None
    noise = per_joint("velocity_noise", errors.velocity_noise, shown.shape[1])
    return np.asarray(speed + noise * rng.standard_normal(speed.shape))


def _straight(t: FloatArray, values: FloatArray, wanted: FloatArray) -> FloatArray:
    """Return values (n_t, n_v) at the times wanted (n,), on straight lines; at the ticks exactly as they are."""
    if wanted is t or np.array_equal(wanted, t):
        return values
    return np.column_stack([np.interp(wanted, t, column) for column in values.T])
