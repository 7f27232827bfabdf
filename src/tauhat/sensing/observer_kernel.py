"""External torque sample by sample: what moves the arm beside its motors, friction and gravity.

A sample is the position and the motor torque as measured. Both pass the same filter (`CausalFilter`); friction that
remembers the displacement follows the position as measured and is taken off before the filter, all else behind it:
    u = tau - bristles(q)        y, y', y'' = filter(q)        T = filter(u)
    p, drift = momentum(y, y')   drive = T + drift - sliding(y, y')          dp/dt = drive + tau_ext
so the mean external torque over a step is `e = (p - p_last) / h - (drive + drive_last) / 2`, without any acceleration.
The observers smooth e, each exact for the sample time (tau_ext constant between samples):
    0 inverse dynamics     r+ = a r + (1 - a) (M y'' + b + sliding - T),  a = exp(-K h)
    1 momentum             r+ = a r + (1 - a) e
    2 momentum, 2nd order  r'' = K^2 (e - r) - 2 K r', both eigenvalues at -K
    3 sliding mode         super-twisting on p, implicit, so that it does not chatter; then as 1
    4 disturbance          tau' = X^-1 M^-1 (M y'' + b + sliding - T - tau), implicit, without y''
    5 Kalman               p+ = p + h (drive + d), d+ = d, corrected by the measured p with constant gains
    6 thermal, refresh     1, with friction that warms up or changes beside it (`thermal_kernel`)
The variance adds the model's error, `rms^2`, and what is not known of the bristles: `(weight load)^2 P`, with
`P+ = P exp(-2 |moved| / w) + P_slid (1 - exp(-2 |moved| / w))`, and no less than `P_turned` behind a reversal.
`stretch^2` times that is told; observers themselves go by it as it is.

`rows` is the memory, (ROWS, n_v): 0 position as measured (nan at the start), 1-2 y, y', 3-4 T, T', 5 u, 6 p, 7 drive,
8-10 the observer's own, 11 load, 12 the u of this sample, 13-20 warmth (6 alone). `bent` (3, n_bristles): states, their
variances, direction of the last displacement. `plan` is the filter's 10 numbers, the observer's gains (n_v, 4), the
model's error rms and stretch (2, n_v); kind, h, P_start, P_turned, P_slid; and `heat` of `thermal_kernel`, empty
but for 6.
Filled: `out` (5, n_v): tau_ext, its variance, y, y', e.

Sources: De Luca and Mattone 2003 (1); Mohammadi et al. 2013 (4); Garofalo et al. 2019 (3); Wahrburg et al. 2018 (5);
Brogliato et al. 2020 (implicit super-twisting).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from tauhat.dynamics.forward_kernel import bias_and_mass, factorised, solved, sweep_outward
from tauhat.dynamics.momentum_kernel import momentum_kernel
from tauhat.dynamics.passive_kernel import bent_by, passive_kernel, turned_by
from tauhat.sensing.thermal_kernel import add_warm_friction, feel_warmth, follow_warmth

INVERSE, FIRST, SECOND, SLIDING, DISTURBANCE, KALMAN, THERMAL = range(7)
ROWS, SCRATCH = 21, 9
_ACCELERATION, _BIAS, _RIGID, _FRICTION, _MOMENTUM, _DRIVE = 0, 1, 2, 3, 6, 8  # rows of scratch


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def observe(body, plan, sample, memory, out):  # type: ignore[no-untyped-def]
    """Take one `sample` (2, n_v), position and torque; see the head of this file. Return whether it could be taken.

    `memory` is rows, bent, work (SCRATCH, n_v), link work (40 n_v,), mass (n_v, n_v). Only the disturbance observer can
    fail, where the mass matrix is that of no body.
    """
    numbers, gains, errors, rest, heat = plan
    rows, bent, work, links_work, mass = memory
    if np.isnan(rows[0, 0]):
        _begin(sample, rest[2], rows, bent)
    if rest[0] == THERMAL:
        feel_warmth(heat, numbers, sample[0], rows)
    _bend(body[4], sample[0], rest, rows, bent)
    _filtered(body[4], numbers, sample, (rows, bent), work[_ACCELERATION])
    _modelled(body, rows, work, links_work, mass)
    if rest[0] == THERMAL:
        add_warm_friction(heat, rows, work[_FRICTION])
    _pushed(rest, rows, work, out[4])
    if rest[0] == INVERSE:
        _missed(body[2], rows, work, out[4])
    _uncertainty(body[4], errors[0], rows, bent, out)
    for i in range(rows.shape[1]):
        out[2, i], out[3, i] = rows[1, i], rows[2, i]
    done = True
    if rest[0] == DISTURBANCE:
        done = _disturbance(gains, (body[2], rest[1]), (mass, work), rows, out[0])
    else:
        for i in range(rows.shape[1]):
            out[0, i] = _smoothed(int(rest[0]), gains[i], rest[1], (out[4, i], work[_DRIVE, i]), rows[:, i])
    if rest[0] == THERMAL:
        follow_warmth(errors[0], heat, rows, out)
    for i in range(rows.shape[1]):
        out[1, i] *= errors[1, i] * errors[1, i]
    return done


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _modelled(body, rows, work, links_work, mass):  # type: ignore[no-untyped-def]
    """Leave what the model says of the filtered state in `work`: bias, rigid torque, friction, momentum, drift."""
    links, inertia, rotor, sliding, _ = body
    n_v = rows.shape[1]
    sweep_outward(links, inertia, rows[1], rows[2], links_work)
    bias_and_mass(links, links_work, work[_BIAS], mass)
    for i in range(n_v):
        rigid = work[_BIAS, i]
        for j in range(n_v):
            rigid += mass[i, j] * work[_ACCELERATION, j]
        work[_RIGID, i] = rigid
        rows[11, i] = abs(rigid)
    passive_kernel(sliding, rows[1], rows[2], rows[11], rows[0], work[_FRICTION : _FRICTION + 3])
    momentum_kernel((links, inertia, rotor), rows[1], rows[2], links_work, work[_MOMENTUM : _MOMENTUM + 2])


@njit(cache=True, nogil=True, error_model="numpy")
def _pushed(rest, rows, work, e):  # type: ignore[no-untyped-def]
    """Fill `e` with the mean external torque since the last sample, and leave the mean drive in `work`."""
    for i in range(e.size):
        p, drive = work[_MOMENTUM, i], rows[3, i] + work[_MOMENTUM + 1, i] - work[_FRICTION, i]
        if np.isnan(rows[6, i]):
            rows[6, i], rows[7, i] = p, drive
            rows[8, i] = p if rest[0] in (SLIDING, KALMAN) else 0.0
        work[_DRIVE, i] = 0.5 * (drive + rows[7, i])
        e[i] = (p - rows[6, i]) / rest[1] - work[_DRIVE, i]
        rows[6, i], rows[7, i] = p, drive


@njit(cache=True, nogil=True, error_model="numpy")
def _missed(rotor, rows, work, e):  # type: ignore[no-untyped-def]
    """Fill `e` with what the model needs by inverse dynamics and the filtered torque does not give."""
    for i in range(e.size):
        e[i] = work[_RIGID, i] + work[_FRICTION, i] - rows[3, i]
        for j in range(e.size):
            e[i] += rotor[i, j] * work[_ACCELERATION, j]


@njit(cache=True, nogil=True, error_model="numpy")
def _begin(sample, start, rows, bent):  # type: ignore[no-untyped-def]
    for i in range(rows.shape[1]):
        rows[0, i] = rows[1, i] = sample[0, i]
        rows[3, i] = rows[5, i] = sample[1, i]
        rows[2, i] = rows[4, i] = rows[11, i] = rows[12, i] = 0.0
        rows[8, i] = rows[9, i] = rows[10, i] = 0.0
        rows[6, i] = np.nan
    for k in range(bent.shape[1]):
        bent[0, k], bent[1, k], bent[2, k] = 0.0, start, 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _bend(bristles, q, rest, rows, bent):  # type: ignore[no-untyped-def]
    """Bend the bristles by the displacement since the last sample, and what is not known of them with it."""
    for k in range(bristles.size):
        w = bristles[k].shape
        moved = turned_by(bristles[k], q) - turned_by(bristles[k], rows[0])
        bent[0, k] = bent_by(moved, w, bent[0, k])
        kept = np.exp(-2.0 * abs(moved) / w)
        bent[1, k] = bent[1, k] * kept + rest[4] * (1.0 - kept)
        if moved * bent[2, k] < 0.0:
            bent[1, k] = max(bent[1, k], rest[3])
        if moved != 0.0:
            bent[2, k] = 1.0 if moved > 0.0 else -1.0


@njit(cache=True, nogil=True, error_model="numpy")
def _filtered(bristles, numbers, sample, states, acceleration):  # type: ignore[no-untyped-def]
    """Pass position and torque through the filter, and fill `acceleration` with y''."""
    rows, bent = states
    n_v = rows.shape[1]
    f00, f01, f10, f11 = numbers[0], numbers[1], numbers[2], numbers[3]
    a0, a1, b0, b1 = numbers[4], numbers[5], numbers[6], numbers[7]
    _without_bristles(bristles, sample[1], rows, bent)
    for j in range(n_v):
        q, last = sample[0, j], rows[0, j]
        y, slope = rows[1, j], rows[2, j]
        rows[1, j] = f00 * y + f01 * slope + a0 * last + b0 * q
        rows[2, j] = f10 * y + f11 * slope + a1 * last + b1 * q
        rows[0, j] = q
        acceleration[j] = numbers[8] * (q - rows[1, j]) - numbers[9] * rows[2, j]
        u, T, slope = rows[12, j], rows[3, j], rows[4, j]
        rows[3, j] = f00 * T + f01 * slope + a0 * rows[5, j] + b0 * u
        rows[4, j] = f10 * T + f11 * slope + a1 * rows[5, j] + b1 * u
        rows[5, j] = u


@njit(cache=True, nogil=True, error_model="numpy")
def _without_bristles(bristles, tau, rows, bent):  # type: ignore[no-untyped-def]
    """Leave in `rows` what of the torque `tau` (n_v,) bristles do not take; a shared motor's are on both its joints."""
    for j in range(tau.size):
        rows[12, j] = tau[j]
    for k in range(bristles.size):
        j = bristles[k].joint
        taken = bristles[k].weight * (rows[11, j] if bristles[k].kind == 17 else 1.0) * bent[0, k]
        rows[12, j] -= taken
        if bristles[k].ratio != 0.0:
            rows[12, bristles[k].other] -= bristles[k].ratio * taken


@njit(cache=True, nogil=True, error_model="numpy")
def _smoothed(kind, gain, h, pushed, row):  # type: ignore[no-untyped-def]
    """Return the external torque of one joint by an observer that sees each joint alone; `pushed` is e, mean drive."""
    e, drive = pushed
    if kind in (INVERSE, FIRST, THERMAL):
        row[8] = gain[0] * row[8] + (1.0 - gain[0]) * e
        return row[8]
    if kind == SECOND:
        r, slope = row[8] - e, row[9]
        row[8] = e + gain[0] * r + gain[1] * slope
        row[9] = gain[2] * r + gain[3] * slope
        return row[8]
    p = row[6]
    off = p - (row[8] + h * (drive + row[9]))
    if kind == KALMAN:
        row[8] = p - off + gain[0] * off
        row[9] += gain[1] * off
        return row[9]
    k1, k2 = gain[0], gain[1]
    least = h * h * k2
    if abs(off) <= least:
        row[9] += off / h
        row[8] = p
    else:
        sign = 1.0 if off > 0.0 else -1.0
        root = 0.5 * (np.sqrt(h * h * k1 * k1 + 4.0 * (abs(off) - least)) - h * k1)
        row[9] += h * k2 * sign
        row[8] = p - sign * root * root
    row[10] = gain[2] * row[10] + (1.0 - gain[2]) * row[9]
    return row[10]


@njit(cache=True, nogil=True, error_model="numpy")
def _disturbance(gains, body, model, rows, torque):  # type: ignore[no-untyped-def]
    """Solve `(M + h X^-1) y = M (X z + dq) + h (b + sliding - T)`, y = X tau_ext; z = tau_ext - X^-1 dq is kept."""
    rotor, h = body
    mass, work = model
    n_v, y = rows.shape[1], work[_RIGID]
    for i in range(n_v):
        for j in range(n_v):
            mass[i, j] += rotor[i, j]
    for i in range(n_v):
        y[i] = h * (work[_BIAS, i] + work[_FRICTION, i] - rows[3, i])
        for j in range(n_v):
            y[i] += mass[i, j] * (rows[8, j] / gains[j, 0] + rows[2, j])
    for i in range(n_v):
        mass[i, i] += h * gains[i, 0]
    if factorised(mass) >= 0:
        return False
    solved(mass, y)
    for i in range(n_v):
        torque[i] = y[i] * gains[i, 0]
        rows[8, i] = torque[i] - gains[i, 0] * rows[2, i]
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _uncertainty(bristles, rms, rows, bent, out):  # type: ignore[no-untyped-def]
    for j in range(rms.size):
        out[1, j] = rms[j] * rms[j]
    for k in range(bristles.size):
        j = bristles[k].joint
        size = bristles[k].weight * (rows[11, j] if bristles[k].kind == 17 else 1.0)
        out[1, j] += size * size * bent[1, k]
        if bristles[k].ratio != 0.0:
            out[1, bristles[k].other] += (bristles[k].ratio * size) ** 2 * bent[1, k]
