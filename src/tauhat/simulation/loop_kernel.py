"""A plant under a tracking law, all of it in one kernel: encoders, control, delay, steps of the plant, log.

    command = clip(feedforward + kp (q_ref - q) + kd (dq_ref - dq) + ki integral)
    tau(k) = command(k - delay)

q is the encoder's position, on the link or on the motor, to the nearest multiple of its step; dq the true speed of the
same shaft or the difference of two positions over the period. The integral stops while the torque is at its limit and
the error would drive it further.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from tauhat.simulation.step_kernel import pass_step

FINE = -1


@njit(cache=True, nogil=True, error_model="numpy")
def pass_period(machine, state, tau, steps, record):  # type: ignore[no-untyped-def]
    """Pass some steps under one torque; fill record (n_channels, n_v) with the begin of the first."""
    for j in range(tau.size):
        record[10, j] = state.temperature[j]
    for step in range(steps):
        pass_step(machine, state, tau)
        if step == 0:
            _note(state, tau, record)


@njit(cache=True, nogil=True, error_model="numpy")
def run_loop(machine, state, steering, course, log):  # type: ignore[no-untyped-def]
    """Follow the reference; fill log (n_samples, n_channels, n_v) and return the step that ran away, or FINE.

    The first `course.settle` periods hold the reference's first row, and are not logged.
    """
    engine, n_v = machine.engine, state.q.size
    tau, command, record = np.empty(n_v), np.empty(n_v), np.empty((log.shape[1], n_v))
    for step in range(course.settle + course.q.shape[0]):
        if _ran_away(engine, course.fastest):
            return step
        row = step - course.settle
        _observe(engine, state, steering, step)
        _command(steering, course, row, command)
        _delay(steering, step, command, tau)
        pass_period(machine, state, tau, steering.substeps, record)
        if row >= 0 and row % course.stride == 0:
            _copy(record, log[row // course.stride])
    return FINE


@njit(cache=True, nogil=True, error_model="numpy")
def _ran_away(engine, fastest):  # type: ignore[no-untyped-def]
    total = 0.0
    for j in range(engine.dof.size):
        total += engine.qvel[engine.dof[j]] ** 2
    return not total < fastest**2  # also where it is not a number


@njit(cache=True, nogil=True, error_model="numpy")
def _observe(engine, state, steering, step):  # type: ignore[no-untyped-def]
    """Read the encoders: positions to `seen[0]`, speeds to `seen[1]`."""
    seen = steering.seen
    for j in range(engine.dof.size):
        i = engine.dof[j]
        q = state.shaft[j] if steering.on_motor else engine.qpos[i]
        dq = state.shaft_dq[j] if steering.on_motor else engine.qvel[i]
        if steering.encoder_step[j] > 0.0:
            q = steering.encoder_step[j] * np.rint(q / steering.encoder_step[j])
        if steering.differenced:
            dq = (q - seen[0, j]) / steering.period if step > 0 else 0.0
        seen[0, j], seen[1, j] = q, dq


@njit(cache=True, nogil=True, error_model="numpy")
def _command(steering, course, row, command):  # type: ignore[no-untyped-def]
    """Find the controller's torque, and carry its integral."""
    seen, integral = steering.seen, steering.integral
    for j in range(command.size):
        error = course.q[max(row, 0), j] - seen[0, j]
        rate = (course.dq[row, j] if row >= 0 else 0.0) - seen[1, j]
        wanted = course.feedforward[max(row, 0), j] + steering.kp[j] * error + steering.kd[j] * rate
        wanted += steering.ki[j] * integral[j]
        limit = steering.limit[j]
        command[j] = max(min(wanted, limit), -limit)
        if not (abs(wanted) >= limit and command[j] * error >= 0.0):
            integral[j] += steering.period * error


@njit(cache=True, nogil=True, error_model="numpy")
def _delay(steering, step, command, tau):  # type: ignore[no-untyped-def]
    """Put the command at the end of the queue and take out the one that is due."""
    n = steering.queue.shape[0]
    for j in range(tau.size):
        tau[j] = command[j] if n == 0 else steering.queue[step % n, j]
        if n > 0:
            steering.queue[step % n, j] = command[j]


@njit(cache=True, nogil=True, error_model="numpy")
def _copy(values, out):  # type: ignore[no-untyped-def]
    # Element by element, here and elsewhere: Numba takes seconds to compile the assignment of a slice.
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            out[i, j] = values[i, j]


@njit(cache=True, nogil=True, error_model="numpy")
def _note(state, tau, record):  # type: ignore[no-untyped-def]
    """Write down the begin of a step, in the order of `running.CHANNELS`; the temperature is there already."""
    for j in range(tau.size):
        record[0, j], record[1, j], record[2, j], record[3, j] = state.q[j], state.dq[j], state.ddq[j], tau[j]
        record[4, j], record[5, j], record[6, j] = state.dry[j], state.law[j], state.motor[j]
        record[7, j], record[8, j], record[9, j] = state.motor_dq[j], state.motor_ddq[j], state.gear[j]
        record[11, j] = state.external[j]
