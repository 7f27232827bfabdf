"""A plant under a tracking law, all of it in one kernel: encoders, control, delay, steps of the plant, log.

    command = clip(feedforward + kp (q_ref - q) + kd (dq_ref - dq) + ki integral)
    tau(k) = command(k - delay)

q is the encoder's position, on the link or on the motor, to the nearest multiple of its step; dq the true speed of the
same shaft or the difference of two positions over the period. The integral stops while the torque is at its limit and
the error would drive it further.

x are the rows of the plant's state, c those of the controller: see `rows`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from tauhat.simulation import rows as r
from tauhat.simulation.step_kernel import pass_step

FINE = -1


@njit(cache=True, nogil=True, error_model="numpy")
def pass_period(machine, x, memory, steps, record):  # type: ignore[no-untyped-def]
    """Pass some steps under the torque x[TAU]; fill record (n_channels, n_v) with the begin of the first."""
    for step in range(steps):
        pass_step(machine, x, memory)
        if step == 0:
            _note(x, record)


@njit(cache=True, nogil=True, error_model="numpy")
def _note(x, record):  # type: ignore[no-untyped-def]
    # Element by element: Numba takes seconds to compile the assignment of a slice.
    for channel in range(r.CHANNEL_COUNT):
        for j in range(x.shape[1]):
            record[channel, j] = x[channel, j]


@njit(cache=True, nogil=True, error_model="numpy")
def run_loop(machine, x, memory, steering, course, log):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Follow the reference; fill log (n_samples, n_channels, n_v) and return the step that ran away, or FINE.

    The first `course.settle` periods hold the reference's first row, and are not logged.
    """
    engine = machine.engine
    for step in range(course.settle + course.q.shape[0]):
        if _ran_away(engine, course.fastest):
            return step
        row = step - course.settle
        observe(engine, x, steering, step)
        _command(steering, course, step, x)
        logged = row // course.stride if row >= 0 else 0
        if row >= 0 and row % course.stride == 0:
            pass_period(machine, x, memory, steering.substeps, log[logged])
        else:
            pass_period(machine, x, memory, steering.substeps, steering.unlogged)
    return FINE


@njit(cache=True, nogil=True, error_model="numpy")
def _ran_away(engine, fastest):  # type: ignore[no-untyped-def]
    total = 0.0
    for j in range(engine.dof.size):
        total += engine.qvel[engine.dof[j]] ** 2
    return not total < fastest**2  # also where it is not a number


@njit(cache=True, nogil=True, error_model="numpy")
def observe(engine, x, steering, step):  # type: ignore[no-untyped-def]
    """Read the encoders."""
    c = steering.rows
    for j in range(x.shape[1]):
        i = engine.dof[j]
        q = x[r.SHAFT, j] if steering.on_motor else engine.qpos[i]
        dq = x[r.SHAFT_DQ, j] if steering.on_motor else engine.qvel[i]
        if c[r.ENCODER_STEP, j] > 0.0:
            q = c[r.ENCODER_STEP, j] * np.rint(q / c[r.ENCODER_STEP, j])
        if steering.differenced:
            dq = (q - c[r.READ, j]) / steering.period if step > 0 else 0.0
        c[r.READ, j], c[r.READ_DQ, j] = q, dq


@njit(cache=True, nogil=True, error_model="numpy")
def _command(steering, course, step, x):  # type: ignore[no-untyped-def]
    """Find the controller's torque, carry its integral, and give the plant the torque whose time has come."""
    c, row, n = steering.rows, step - course.settle, steering.queue.shape[0]
    for j in range(x.shape[1]):
        error = course.q[max(row, 0), j] - c[r.READ, j]
        rate = (course.dq[row, j] if row >= 0 else 0.0) - c[r.READ_DQ, j]
        wanted = course.feedforward[max(row, 0), j] + c[r.KP, j] * error + c[r.KD, j] * rate
        wanted += c[r.KI, j] * c[r.INTEGRAL, j]
        limit = c[r.LIMIT, j]
        command = max(min(wanted, limit), -limit)
        if not (abs(wanted) >= limit and command * error >= 0.0):
            c[r.INTEGRAL, j] += steering.period * error
        x[r.TAU, j] = command
        if n > 0:
            x[r.TAU, j] = steering.queue[step % n, j]
            steering.queue[step % n, j] = command
