"""What a state filter needs of a recording: a coarser clock, noise of every kind, a first state."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ModelError
from tauhat.estimation.filters.acceleration import PointAccelerations
from tauhat.recordings.processing import interpolated, uniform_clock, unwrapped, white_noise
from tauhat.recordings.recording import Recording

_COUNT = 12.0**-0.5  # deviation of rounding to whole encoder counts
_RUN_UP = 0.05  # [s] over which the first velocity is taken
_LEAST = 1e-9  # [rad, m and per second] noise of a recording without any


@dataclass(frozen=True, slots=True, kw_only=True)
class StateNoise:
    """Standard deviations of white noise; empty where they are to be taken from the recordings.

    torque : (n_v,) of the mean between two measurements [Nm or N]
    position, velocity : (n_v,) [rad or m, and per second]
    """

    torque: tuple[float, ...] = ()
    position: tuple[float, ...] = ()
    velocity: tuple[float, ...] = ()

    def chosen(self, name: str, found: FloatArray) -> FloatArray:
        """Return the given deviations, else those found."""
        given: tuple[float, ...] = getattr(self, name)
        if not given:
            return found
        if len(given) != found.size or not all(0.0 < value < np.inf for value in given):
            raise ModelError(f"noise of the {name}", expected=f"{found.size} positive values", got=given)
        return np.array(given)


class FoundNoise(NamedTuple):
    """Deviations (n_v,) of torque, position, velocity.

    averaged : whether the torque's is that of the mean between measurements, else of rows low-passed at `cutoff` [Hz]
    """

    torque: FloatArray
    averaged: bool
    cutoff: float
    position: FloatArray
    velocity: FloatArray | None


class StateSample(NamedTuple):
    """From one measurement to the next: time of the latter [s], torque of every step (n, n_v), measurement (n_y,)."""

    t: float
    tau: FloatArray
    measured: FloatArray


class StateSystem(NamedTuple):
    """What a step needs beside belief and sample.

    accelerations : of the model
    step : of the integration [s]
    torque_noise : (n_v,) deviations of the mean torque between two measurements
    noise : (n_y, n_y) root of the measurement's covariance
    """

    accelerations: PointAccelerations
    step: float
    torque_noise: FloatArray
    noise: FloatArray


class StatePlan(NamedTuple):
    """How one recording is filtered: system, first state and its deviations (2 n_v,), samples."""

    system: StateSystem
    state: FloatArray
    deviation: FloatArray
    samples: Iterator[StateSample]


class ClockedRecording(NamedTuple):
    """A recording on a coarser clock.

    time, step : between measurements, and of the integration [s]
    t, q, dq : (n,), (n, n_v) each, at the measurements
    tau : (n - 1, n_steps, n_v) means over each step between them
    """

    time: float
    step: float
    t: FloatArray
    q: FloatArray
    dq: FloatArray | None
    tau: FloatArray


def clocked_recording(recording: Recording, delay: float, *, rate: float, longest_step: float) -> ClockedRecording:
    """Return the recording with measurements at most at `rate` [Hz] and its torque in steps of at most `longest_step`.

    Where the recording's own steps are longer, they are cut into equal ones, the torque on straight lines between.

    Raises
    ------
    ModelError
        when there is no torque, or too little of the recording for a first velocity.
    """
    if recording.tau is None:
        raise ModelError("no torque in the log", where=recording.name)
    clock = uniform_clock(recording, delay)
    ticks_a_step = max(1, int(longest_step / clock.step + 1e-9))
    parts = max(1, int(np.ceil(clock.step / longest_step - 1e-9)))  # of a tick, where it is too long for one step
    n_steps = max(1, round(1.0 / (rate * clock.step * ticks_a_step)))
    every = n_steps * ticks_a_step
    count = (clock.n_t - 1) // every
    time = every * clock.step
    if count < 2 * max(1, round(_RUN_UP / time)):
        raise ModelError("too short to filter", where=recording.name, got=f"{count} measurements at {1.0 / time:g} Hz")
    part = clock.step / parts
    middles = np.asarray(clock.start + part * (np.arange(count * every * parts) + 0.5), dtype=np.float64)
    torque = interpolated(recording.t, recording.tau, middles)
    mean = torque.reshape(recording.n_v, count, n_steps * parts, ticks_a_step).mean(axis=3).transpose(1, 2, 0)
    coarse = clock.ticks(0, count * every + 1)[::every]
    q = interpolated(recording.t, unwrapped(recording.q), coarse + delay).T
    dq = None if recording.dq is None else interpolated(recording.t, recording.dq, coarse + delay).T
    return ClockedRecording(time, ticks_a_step * part, coarse, q, dq, mean)


def measurement_noise(signal: FloatArray) -> FloatArray:
    """Return the deviation of each column of a measured signal: white noise, and rounding to its smallest step."""
    jumps = np.abs(np.diff(signal, axis=0))
    count = np.min(jumps, axis=0, where=jumps > 0, initial=np.inf)
    coarse = np.array([np.unique(column).size < column.size // 2 for column in signal.T])
    rounding = np.where(coarse & np.isfinite(count), _COUNT * count, 0.0)
    return np.maximum(np.maximum(white_noise(signal), rounding), _LEAST)


def noise_accelerations(
    accelerations: PointAccelerations, mean: FloatArray, tau: FloatArray, noise: FloatArray
) -> FloatArray:
    """Return `M^-1 diag(noise)` at the state and parameters of a mean (2 n_v + n_b,), (n_v, n_v)."""
    n_v = tau.size
    drives = np.vstack([tau, tau + np.diag(noise)])
    points = np.broadcast_to(mean, (n_v + 1, mean.size))
    found = accelerations.at(points[:, :n_v], points[:, n_v : 2 * n_v], drives, points[:, 2 * n_v :])
    return np.asarray((found[1:] - found[0]).T)


def state_plan(
    clocked: ClockedRecording, accelerations: PointAccelerations, values: FloatArray, *, noise: FoundNoise, band: float
) -> StatePlan:
    """Return how a recording is filtered that begins with the parameters `values` (n_b,).

    Raises
    ------
    numpy.linalg.LinAlgError
        when these make no robot.
    """
    time = clocked.time
    torque = noise.torque if noise.averaged else noise.torque / np.sqrt(2.0 * time * min(noise.cutoff, 0.5 / time))
    speed, unsure = _first_speed(clocked, noise)
    state = np.concatenate([clocked.q[0], speed])
    moved = noise_accelerations(accelerations, np.concatenate([state, values]), clocked.tau[0, 0], torque)
    felt, edge = np.linalg.norm(moved, axis=1), 2.0 * np.pi * band
    measured, deviation = clocked.q, np.maximum(noise.position, felt / edge**2)
    if noise.velocity is not None and clocked.dq is not None:
        measured = np.hstack([clocked.q, clocked.dq])
        deviation = np.concatenate([deviation, np.maximum(noise.velocity, felt / edge)])
    system = StateSystem(accelerations, clocked.step, torque, np.diag(deviation))
    first = np.concatenate([2.0 * noise.position, unsure])
    return StatePlan(system, state, first, _samples(clocked, measured))


def _first_speed(clocked: ClockedRecording, noise: FoundNoise) -> tuple[FloatArray, FloatArray]:
    """Return the first velocity and how unsure it is, (n_v,) each."""
    if noise.velocity is not None and clocked.dq is not None:
        return clocked.dq[0], 2.0 * noise.velocity
    rise = max(1, round(_RUN_UP / clocked.time))
    run_up = rise * clocked.time
    change = np.abs(clocked.q[2 * rise] - 2.0 * clocked.q[rise] + clocked.q[0]) / run_up
    return (clocked.q[rise] - clocked.q[0]) / run_up, 2.0 * noise.position / run_up + change + _LEAST


def _samples(clocked: ClockedRecording, measured: FloatArray) -> Iterator[StateSample]:
    for k, tau in enumerate(clocked.tau):
        yield StateSample(float(clocked.t[k + 1]), tau, measured[k + 1])
