"""A robot under a tracking law, step by step: rigid links, passive elements, `tau = clip(ff + kp e + kd de + ki int e)`.

Two integrators of the same equations `M(q) ddq = tau - bias(q, dq) - passive(q, dq)`:

`leapfrog_kernel` keeps the speed between the steps, u = dq(t - h/2). With the prediction `v = u + h/2 ddq_previous` it
solves for the change of speed d, implicitly in what is stiff; second order where the forces are smooth:
    (M + h/2 (kd + c) + h^2/4 (kp + k)) d = h (tau(q, v) - bias(q, v) - passive(q, v) + (kd + c) (v - u))
    dq = u + d/2     ddq = d/h     u+ = u + d     q+ = q + h u+
c and k are the secant damping and the bristles' stiffness of `passive_kernel`: however sharp friction is, it neither
overshoots nor diverges. A joint whose torque is held or at its limit takes no part of kp and kd.
Where a held torque changes, the step around that time takes the mean of both.

`runge_kutta_kernel` is the classical method of fourth order, explicit: for smooth friction, and to check the other.

Arguments in tuples: `body` geometry, inertia (n_v, 10), rotor (n_v,); `passive` kinds, joints, shapes, weights of the
elements; `law` kp, kd, ki, limit (n_v,); `reference` q, dq, ff (n_t, n_v), on straight lines between the samples;
`start` q, dq (2, n_v); `times` the step between samples, the steps of the integrator in it, and for how many of
these the controller holds a torque, as sampled controllers do (0: it acts all the time). Filled: `out` (4, n_v, n_t) with q, dq, ddq, tau at every sample. Returned: (code, sample, joint).
The integral stops while the torque is at its limit and the error would drive it further.

Source: Hairer, Lubich, Wanner, "Geometric numerical integration", 2006 (leapfrog); Newmark 1959 (the h^2/4 term).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from tauhat.dynamics.forward_kernel import bias_and_mass, factorised, solved
from tauhat.dynamics.passive_kernel import DAHL, LOAD_DAHL, bent_by, passive_kernel

FINE, NO_BODY, RAN_AWAY = 0, 1, 2
RUNAWAY = 1e3  # [rad/s or m/s] no robot moves this fast


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def leapfrog_kernel(body, passive, law, reference, start, times, out):  # type: ignore[no-untyped-def]
    """Simulate by leapfrog steps; see the head of this file."""
    step, substeps, hold = times
    kp, kd, ki, limit = law
    q_ref, dq_ref, ff = reference
    n_t, n_v = q_ref.shape
    h = step / substeps
    q, u = start[0].copy(), start[1].copy()
    v, a, d, tau, keep, integral, moved, load = np.zeros((8, n_v))
    held, before = np.zeros((2, n_v))
    bias, taken, damping, stiffness = np.zeros((4, n_v))
    free = np.ones(n_v)
    bent = np.zeros(passive[0].size)
    work, mass, checked = np.empty(40 * n_v), np.empty((n_v, n_v)), np.empty((n_v, n_v))
    for turn in range(-1, n_t):  # the first turn only finds the acceleration at the start
        k = max(turn, 0)
        after = min(k + 1, n_t - 1)
        for s in range(substeps if turn >= 0 else 1):
            part = s / substeps
            for j in range(n_v):
                v[j] = u[j] + 0.5 * h * a[j]
            _mass_and_load(body, q, v, a, work, bias, mass, load)
            if s == 0:
                checked[:] = mass
                failed = factorised(checked)
                if failed >= 0:
                    return NO_BODY, k, failed
            passive_kernel(*passive, q, v, load, bent, taken, damping, stiffness)
            steers = hold == 0 or (k * substeps + s) % hold == 0
            for j in range(n_v):
                if steers:
                    e = q_ref[k, j] + part * (q_ref[after, j] - q_ref[k, j]) - q[j]
                    de = dq_ref[k, j] + part * (dq_ref[after, j] - dq_ref[k, j]) - v[j]
                    ahead = ff[k, j] + part * (ff[after, j] - ff[k, j])
                    summed = integral[j] + (0.5 * h * e if hold == 0 else 0.0)  # of the trapezoidal rule
                    tau[j], free[j] = _driven(ahead + kp[j] * e + kd[j] * de + ki[j] * summed, limit[j])
                    if free[j] > 0.0 or tau[j] * e < 0.0:
                        integral[j] += h * max(hold, 1) * e
                    if hold > 0:
                        free[j], held[j], before[j] = 0.0, tau[j], held[j]
                        tau[j] = 0.5 * (before[j] + held[j]) if turn > 0 or s > 0 else held[j]
                elif hold > 0:
                    tau[j] = held[j]
                keep[j] = free[j] * kd[j] + damping[j]
                mass[j, j] += 0.5 * h * keep[j] + 0.25 * h * h * (free[j] * kp[j] + stiffness[j])
                d[j] = h * (tau[j] - bias[j] - taken[j] + keep[j] * (v[j] - u[j]))
            if factorised(mass) >= 0:
                return NO_BODY, k, 0
            solved(mass, d)
            for j in range(n_v):
                a[j] = d[j] / h
                if turn < 0:
                    u[j], integral[j] = start[1, j] - 0.5 * d[j], 0.0
                    continue
                if s == 0:
                    out[0, j, k], out[1, j, k], out[2, j, k] = q[j], u[j] + 0.5 * d[j], a[j]
                    out[3, j, k] = tau[j] - free[j] * kd[j] * (u[j] + 0.5 * d[j] - v[j])
                u[j] += d[j]
                moved[j] = h * u[j]
                q[j] += moved[j]
                if not abs(u[j]) < RUNAWAY:
                    return RAN_AWAY, k, j
            if turn >= 0:
                _bend(passive, moved, bent)
    return FINE, -1, -1


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def runge_kutta_kernel(body, passive, law, reference, start, times, out):  # type: ignore[no-untyped-def]
    """Simulate by Runge-Kutta steps; see the head of this file."""
    step, substeps, hold = times
    n_t, n_v = reference[0].shape
    h = step / substeps
    state, stage = np.zeros((3, n_v)), np.zeros((3, n_v))  # q, dq, integral
    state[0], state[1] = start[0], start[1]
    rate, total = np.zeros((3, n_v)), np.zeros((3, n_v))
    a, tau, moved = np.zeros((3, n_v))
    bent, bending = np.zeros(passive[0].size), np.zeros(passive[0].size)
    rows, load = np.zeros((4, n_v)), np.zeros(n_v)
    work, mass = np.empty(40 * n_v), np.empty((n_v, n_v))
    for k in range(n_t):
        for s in range(substeps):
            for place in range(4):
                ahead = 0.0 if place == 0 else (0.5 if place < 3 else 1.0)
                for i in range(3):
                    for j in range(n_v):
                        stage[i, j] = state[i, j] + ahead * h * rate[i, j]
                        total[i, j] = 0.0 if place == 0 else total[i, j]
                bending[:] = bent
                for j in range(n_v):
                    moved[j] = stage[0, j] - state[0, j]
                _bend(passive, moved, bending)
                _mass_and_load(body, stage[0], stage[1], a, work, rows[0], mass, load)
                passive_kernel(*passive, stage[0], stage[1], load, bending, rows[1], rows[2], rows[3])
                if hold == 0 or (place == 0 and (k * substeps + s) % hold == 0):
                    _law_torque(law, reference, k, (s + ahead) / substeps, stage, tau, rate)
                for j in range(n_v):
                    rate[0, j] = stage[1, j]
                    rate[1, j] = tau[j] - rows[0, j] - rows[1, j]
                failed = factorised(mass)
                if failed >= 0:
                    return NO_BODY, k, failed
                solved(mass, rate[1])
                if s == 0 and place == 0:
                    for j in range(n_v):
                        out[0, j, k], out[1, j, k] = stage[0, j], stage[1, j]
                        out[2, j, k], out[3, j, k] = rate[1, j], tau[j]
                share = (1.0 if place in (0, 3) else 2.0) / 6.0
                for i in range(3):
                    for j in range(n_v):
                        total[i, j] += share * rate[i, j]
            for j in range(n_v):
                moved[j] = h * total[0, j]
                a[j] = total[1, j]
                for i in range(3):
                    state[i, j] += h * total[i, j]
                if not abs(state[1, j]) < RUNAWAY:
                    return RAN_AWAY, k, j
            _bend(passive, moved, bent)
    return FINE, -1, -1


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _law_torque(law, reference, k, part, stage, tau, rate):  # type: ignore[no-untyped-def]
    """Fill `tau` and the rate of the integral, a `part` of the way from sample k to the next."""
    kp, kd, ki, limit = law
    q_ref, dq_ref, ff = reference
    after = min(k + 1, q_ref.shape[0] - 1)
    for j in range(tau.size):
        e = q_ref[k, j] + part * (q_ref[after, j] - q_ref[k, j]) - stage[0, j]
        de = dq_ref[k, j] + part * (dq_ref[after, j] - dq_ref[k, j]) - stage[1, j]
        ahead = ff[k, j] + part * (ff[after, j] - ff[k, j])
        tau[j], free = _driven(ahead + kp[j] * e + kd[j] * de + ki[j] * stage[2, j], limit[j])
        rate[2, j] = e if free > 0.0 or tau[j] * e < 0.0 else 0.0


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _driven(wanted, limit):  # type: ignore[no-untyped-def]
    """Return the torque within its limit, and whether it is free."""
    if abs(wanted) < limit:
        return wanted, 1.0
    return (limit if wanted > 0.0 else -limit), 0.0


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _mass_and_load(body, q, v, a, work, bias, mass, load):  # type: ignore[no-untyped-def]
    """Fill bias, mass matrix with rotors, and the rigid-body torque |M a + bias| that load friction sees."""
    parents, prismatic, abc, place, axis, gravity, inertia, rotor = body
    bias_and_mass(parents, prismatic, abc, place, axis, gravity, inertia, q, v, work, bias, mass)
    for i in range(q.size):
        torque = bias[i]
        for j in range(q.size):
            torque += mass[i, j] * a[j]
        load[i] = abs(torque)
    for i in range(q.size):
        mass[i, i] += rotor[i]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _bend(passive, moved, bent):  # type: ignore[no-untyped-def]
    kinds, joints, shapes, _ = passive
    for k in range(kinds.size):
        if kinds[k] == DAHL or kinds[k] == LOAD_DAHL:
            bent[k] = bent_by(moved[joints[k]], shapes[k], bent[k])
