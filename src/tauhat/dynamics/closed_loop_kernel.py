"""A robot under a tracking law, step by step: rigid links, passive elements, `tau = clip(ff + kp e + kd de + ki int e)`.

Two integrators of the same equations `M(q) ddq = tau - bias(q, dq) - passive(q, dq)`:

`leapfrog_kernel` keeps the speed between the steps, u = dq(t - h/2). With the prediction `v = u + h/2 ddq_previous` it
solves for the change of speed d, implicitly in what is stiff; second order where the forces are smooth:
    (M + h/2 (kd + c) + h^2/4 (kp + k)) d = h (tau(q, v) - bias(q, v) - passive(q, v) + (kd + c) (v - u))
    dq = u + d/2     ddq = d/h     u+ = u + d     q+ = q + h u+
c and k are the secant damping and the bristles' stiffness of `passive_kernel`, matrices where a motor turns with two
joints: however sharp friction is, it neither overshoots nor diverges. A joint whose torque is held or at its limit takes no part of kp and kd.
Where a held torque changes, the step around that time takes the mean of both.

`runge_kutta_kernel` is the classical method of fourth order, explicit: for smooth friction, and to check the other.

Arguments in tuples:
    arm    links of `KernelTree`, inertia (n_v, 10), rotor (n_v, n_v), elements of `passive_kernel`
    task   law: kp, kd, ki, limit (n_v,); reference: q, dq, ff (n_t, n_v), on cubics between the samples; times: the
           step between samples, the steps of the integrator in it, and for how many of these the controller holds a
           torque, as sampled controllers do (0: it acts all the time), and how many of its periods a torque is late
`start` is q, dq (2, n_v). Filled: `out` (4, n_v, n_t) with q, dq, ddq, tau at every sample. Returned: (code, sample, joint).
The integral stops while the torque is at its limit and the error would drive it further.

Source: Hairer, Lubich, Wanner, "Geometric numerical integration", 2006 (leapfrog); Newmark 1959 (the h^2/4 term).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from tauhat.dynamics.forward_kernel import bias_and_mass, factorised, solved, sweep_outward
from tauhat.dynamics.passive_kernel import DAHL, LOAD_DAHL, bent_by, coupled_by, passive_kernel, turned_by

FINE, NO_BODY, RAN_AWAY = 0, 1, 2
_LATE = 16  # row of memory from which on torques stand that have been asked for and not come through yet
RUNAWAY = 1e3  # [rad/s or m/s] no robot moves this fast


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def leapfrog_kernel(arm, task, start, out):  # type: ignore[no-untyped-def]
    """Simulate by leapfrog steps; see the head of this file."""
    elements, times = arm[3], task[2]
    _, n_v, n_t = out.shape
    rows, bent = np.zeros((_LATE + times[3], n_v)), np.zeros(elements.size)
    rows[0], rows[1] = start[0], start[1]
    memory = (rows, bent, np.empty(40 * n_v), np.empty((2, n_v, n_v)))
    code, joint = _leap(-1, 0, arm, task, memory)
    if code != FINE:
        return code, 0, joint
    _begin(start, rows)
    for k in range(n_t):
        for s in range(times[1]):
            code, joint = _leap(k, s, arm, task, memory)
            if code != FINE:
                return code, k, joint
            if s == 0:
                _record((rows, memory[3][0]), task, k, out)
            failed = _move(elements, times, rows, bent)
            if failed >= 0:
                return RAN_AWAY, k, failed
    return FINE, -1, -1


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _leap(turn, s, arm, task, memory):  # type: ignore[no-untyped-def]
    """Find the change of speed of one step; return (code, joint).

    `memory` are rows, bent, work, and two mass matrices. `rows` are 16 quantities, (n_v,) each: q, u, v, a, d, tau,
    keep, load, free, integral, held torque, moved, bias, taken, damping, stiffness; then torques that are still late.
    """
    law, _, times = task
    rows, bent, _, masses = memory
    q, u, v, a, d, tau, keep, load = rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6], rows[7]
    free, bias, taken, damping, stiffness = rows[8], rows[12], rows[13], rows[14], rows[15]
    h, mass = times[0] / times[1], masses[0]
    for j in range(q.size):
        v[j] = u[j] + 0.5 * h * a[j]
    _mass_and_load(arm, (q, v, a), memory[2], (bias, load), mass)
    if s == 0:  # once a sample: what is added to the diagonal would hide a body of negative mass
        masses[1] = mass
        failed = factorised(masses[1])
        if failed >= 0:
            return NO_BODY, failed
    passive_kernel(arm[3], q, v, load, bent, rows[13:])
    _steer(turn, s, task, rows)
    for j in range(q.size):
        keep[j] = free[j] * law[1][j] + damping[j]
        mass[j, j] += 0.5 * h * keep[j] + 0.25 * h * h * (free[j] * law[0][j] + stiffness[j])
        d[j] = h * (tau[j] - bias[j] - taken[j] + keep[j] * (v[j] - u[j]))
    _couple(arm[3], h, rows, bent, mass)
    failed = factorised(mass)
    if failed >= 0:
        return NO_BODY, failed
    solved(mass, d)
    for j in range(q.size):
        a[j] = d[j] / h
    return FINE, -1


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _couple(elements, h, rows, bent, mass):  # type: ignore[no-untyped-def]
    """Add what is implicit between the two joints of a shared motor to the mass matrix and the right-hand side."""
    u, v, d = rows[1], rows[2], rows[4]
    for k in range(elements.size):
        if elements[k].ratio == 0.0:
            continue
        i, j = elements[k].joint, elements[k].other
        damping, stiffness = coupled_by(elements[k], v, bent[k])
        for row, column in ((i, j), (j, i)):
            mass[row, column] += 0.5 * h * damping + 0.25 * h * h * stiffness
            d[row] += h * damping * (v[column] - u[column])


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _steer(turn, s, task, rows):  # type: ignore[no-untyped-def]
    """Fill the law's torque at the predicted state, and which joints may take kp and kd implicitly."""
    q, v, tau, free, integral, held = rows[0], rows[2], rows[5], rows[8], rows[9], rows[10]
    (kp, kd, ki, limit), (q_ref, dq_ref, ff), (step, substeps, hold, delay) = task
    k, h, part = max(turn, 0), step / substeps, s / substeps
    if hold > 0 and (k * substeps + s) % hold != 0:
        tau[:] = held
        return
    for j in range(q.size):
        e, de = _between(q_ref, k, j, part) - q[j], _between(dq_ref, k, j, part) - v[j]
        ahead = _between(ff, k, j, part)
        summed = integral[j] + (0.5 * h * e if hold == 0 else 0.0)  # of the trapezoidal rule
        asked, free[j] = _driven(ahead + kp[j] * e + kd[j] * de + ki[j] * summed, limit[j])
        if turn >= 0 and (free[j] > 0.0 or asked * e < 0.0):
            integral[j] += h * max(hold, 1) * e
        if delay > 0:
            asked = _came_through(asked, rows[_LATE:, j], turn < 0)
        tau[j] = asked if hold == 0 or k + s == 0 else 0.5 * (held[j] + asked)
        free[j] = free[j] if hold == 0 else 0.0
        held[j] = asked


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _begin(start, rows):  # type: ignore[no-untyped-def]
    """Place the speed half a step before the start, now that the acceleration there is known."""
    for j in range(start.shape[1]):
        rows[1, j] = start[1, j] - 0.5 * rows[4, j]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _record(found, task, k, out):  # type: ignore[no-untyped-def]
    """Log a sample; a torque that is held jumps there, and the log shows what the motor begins to deliver.

    `found` are rows and the factor of the mass matrix that the step was solved with.
    """
    (rows, factor), (law, _, times) = found, task
    q, u, v, a, d, tau, free = rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[8]
    if times[2] > 0:
        jump = rows[10] - tau
        solved(factor, jump)
        for j in range(q.size):
            out[0, j, k], out[1, j, k], out[2, j, k] = q[j], u[j] + 0.5 * d[j], a[j] + jump[j]
            out[3, j, k] = rows[10, j]
        return
    for j in range(q.size):
        speed = u[j] + 0.5 * d[j]
        out[0, j, k], out[1, j, k], out[2, j, k] = q[j], speed, a[j]
        out[3, j, k] = tau[j] - free[j] * law[1][j] * (speed - v[j])


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _move(elements, times, rows, bent):  # type: ignore[no-untyped-def]
    """Pass a step; return the first joint that runs away, or -1."""
    q, u, d, moved = rows[0], rows[1], rows[4], rows[11]
    h = times[0] / times[1]
    for j in range(q.size):
        u[j] += d[j]
        moved[j] = h * u[j]
        q[j] += moved[j]
        if not abs(u[j]) < RUNAWAY:
            return j
    _bend(elements, moved, bent)
    return -1


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def runge_kutta_kernel(arm, task, start, out):  # type: ignore[no-untyped-def]
    """Simulate by Runge-Kutta steps; see the head of this file."""
    elements, times = arm[3], task[2]
    _, n_v, n_t = out.shape
    h = times[0] / times[1]
    state, rows = np.zeros((3, n_v)), np.zeros((_LATE + times[3], n_v))  # state: q, dq, integral
    state[0], state[1] = start[0], start[1]
    rates = np.zeros((5, 3, n_v))  # of the four stages, behind a row of zeros
    bent = np.zeros(elements.size)
    memory = (state, bent, rates, rows, np.empty(40 * n_v), np.empty((n_v, n_v)))
    for k in range(n_t):
        for s in range(times[1]):
            failed = _stages(k, s, arm, task, memory)
            if failed >= 0:
                return NO_BODY, k, failed
            if s == 0:
                out[0, :, k], out[1, :, k], out[2, :, k], out[3, :, k] = state[0], state[1], rates[1, 1], rows[7]
            rates[1] = (rates[1] + 2.0 * rates[2] + 2.0 * rates[3] + rates[4]) / 6.0
            state += h * rates[1]
            rows[5], rows[6] = rates[1, 1], h * rates[1, 0]
            _bend(elements, rows[6], bent)
            if not np.abs(state[1]).max() < RUNAWAY:
                return RAN_AWAY, k, int(np.argmax(np.abs(state[1])))
    return FINE, -1, -1


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _stages(k, s, arm, task, memory):  # type: ignore[no-untyped-def]
    """Fill the rates of the four stages; return the first joint without inertia, or -1."""
    elements, times = arm[3], task[2]
    state, bent, rates, rows, work, mass = memory
    h = times[0] / times[1]
    for place in range(4):
        ahead = 0.5 * ((place + 1) // 2)
        stage = state + ahead * h * rates[place]
        bending = bent.copy()
        rows[6] = stage[0] - state[0]
        _bend(elements, rows[6], bending)
        failed = _rate((k, s, ahead), arm, task, (stage, bending), (rows, work, mass), rates[place + 1])
        if failed >= 0:
            return failed
    return -1


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _rate(moment, arm, task, stage, scratch, rate):  # type: ignore[no-untyped-def]
    """Fill the rate of a stage; return the first joint without inertia, or -1.

    `moment` is sample, step of the integrator in it, and part of that step; `stage` the state and the bristles in it.
    """
    k, s, ahead = moment
    times = task[2]
    state, bending = stage
    rows, work, mass = scratch
    bias, taken, load, tau = rows[0], rows[1], rows[4], rows[9]
    substeps, hold = times[1], times[2]
    _mass_and_load(arm, (state[0], state[1], rows[5]), work, (bias, load), mass)
    passive_kernel(arm[3], state[0], state[1], load, bending, rows[1:4])  # damping and stiffness go unread
    rate[2] = rows[8]
    if hold == 0 or (ahead == 0.0 and (k * substeps + s) % hold == 0):
        _law_torque(task, k, (s + ahead) / substeps, state, tau, rate)
        rows[8] = rate[2]
        for j in range(tau.size if times[3] > 0 else 0):
            tau[j] = _came_through(tau[j], rows[_LATE:, j], k + s == 0)
    if s == 0 and ahead == 0.0:
        rows[7] = tau
    for j in range(tau.size):
        rate[0, j] = state[1, j]
        rate[1, j] = tau[j] - bias[j] - taken[j]
    failed = factorised(mass)
    if failed < 0:
        solved(mass, rate[1])
    return failed


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _law_torque(task, k, part, state, tau, rate):  # type: ignore[no-untyped-def]
    """Fill `tau` and the rate of the integral, a `part` of the way from sample k to the next."""
    (kp, kd, ki, limit), (q_ref, dq_ref, ff), _ = task
    for j in range(tau.size):
        e, de = _between(q_ref, k, j, part) - state[0, j], _between(dq_ref, k, j, part) - state[1, j]
        ahead = _between(ff, k, j, part)
        tau[j], free = _driven(ahead + kp[j] * e + kd[j] * de + ki[j] * state[2, j], limit[j])
        rate[2, j] = e if free > 0.0 or tau[j] * e < 0.0 else 0.0


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _between(signal, k, j, part):  # type: ignore[no-untyped-def]
    """Return a signal (n_t, n_v) a part of the way from sample k to the next, on the cubic of Catmull and Rom.

    A straight line lies beside a curve by `step^2 / 8` of its bend, and a stiff law turns that into torque.
    """
    last = signal.shape[0] - 1
    if part == 0.0 or k == last:
        return signal[k, j]
    b, c = signal[k, j], signal[k + 1, j]
    a = signal[k - 1, j] if k > 0 else 2.0 * b - c
    d = signal[k + 2, j] if k + 2 <= last else 3.0 * (c - b) + a
    if k == 0 and last > 1:
        a = 3.0 * (b - c) + d
    cubic = 3.0 * (b - c) + d - a
    return b + 0.5 * part * (c - a + part * (2.0 * a - 5.0 * b + 4.0 * c - d + part * cubic))


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _came_through(asked, queue, beginning):  # type: ignore[no-untyped-def]
    """Return the torque that comes through as another is asked for; at the beginning none other is on its way."""
    if beginning:
        queue[:] = asked
    first = queue[0]
    for place in range(queue.size - 1):
        queue[place] = queue[place + 1]
    queue[-1] = asked
    return first


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _driven(wanted, limit):  # type: ignore[no-untyped-def]
    """Return the torque within its limit, and whether it is free."""
    if abs(wanted) < limit:
        return wanted, 1.0
    return (limit if wanted > 0.0 else -limit), 0.0


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _mass_and_load(arm, motion, work, torques, mass):  # type: ignore[no-untyped-def]
    """Fill the mass matrix with rotors, and the `torques`: bias, and |M a + bias| that load friction sees.

    `motion` is q, dq and the acceleration a to take, (n_v,) each.
    """
    links, inertia, rotor, _ = arm
    q, v, a = motion
    bias, load = torques
    sweep_outward(links, inertia, q, v, work)
    bias_and_mass(links, work, bias, mass)
    for i in range(q.size):
        torque = bias[i]
        for j in range(q.size):
            torque += mass[i, j] * a[j]
        load[i] = abs(torque)
    for i in range(q.size):
        for j in range(q.size):
            mass[i, j] += rotor[i, j]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _bend(elements, moved, bent):  # type: ignore[no-untyped-def]
    for k in range(elements.size):
        if elements[k].kind == DAHL or elements[k].kind == LOAD_DAHL:
            bent[k] = bent_by(turned_by(elements[k], moved), elements[k].shape, bent[k])
