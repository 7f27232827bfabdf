"""One stamped sample through the whole force sensor: clock, delay, observer, doubt behind a start, wrench.

A sample is the vector (t, q, tau), 1 + 2 n_v. `stamp_kernel` decides when it was taken. Counted, it is one period
behind the last one, or several where samples were lost; those are put back on straight lines. Believed, position and
torque alike are read at the ticks of an even clock, on the straight line between two samples: there may be none, one or
more between them, and what is told at a sample is that of the last tick, less than one period old. When the time passed
exceeds `longest`, everything starts again but the warmth, which is less sure by then. Positions that jump by whole
turns are unwound.

`memory` is one flat vector, so that copying it is one copy: clock (CLOCK), last sample (2, n_v), `rows` and `bent` of
the observer, ring (m, n_v), `judged` and `before` of `stamp_kernel`, `lagged` (2, n_v), `told` (OUT, n_v): what the
last period said. The ring delays one of the two channels: torque where `delay` (in periods) is positive, else
position, read linearly.

The observer is late by T behind the filter, the wrench has to be solved where the arm was then:
    y_T+ = k y_T + (1 - k) y,   tau_T+ = k tau_T + (1 - k) tau_ext,   k = exp(-h / T)
    J at y_T; variance of the torque, for the wrench alone, plus (tau_ext - tau_T)^2, each joint's own
For a constant wrench LP(J'w) = LP(J)'w, so J at y_T is right to first order of the way in T. The other term is what the
torque changed by in T: a wrench that changes is late by that much.

Behind a start nobody knows the velocity, and the filter takes it for zero. The standard error begins at the joint's
largest torque F and falls as observer and filter forget,
    variance += (F (1 + l age) exp(-l age))^2,    l the slower of their rates.

`machine` is body and plan as `observe` has them, the task (links, place, directions, spread, turned, correlation) of a
WrenchSolver, and limits: numbers (h, l, delay, longest, way of `stamp_kernel`, k) and F (n_v,). `out` is (OUT, n_v):
the observer's five rows, position y_T in place of y, and tau_ext - tau_T; and (7, 6), wrench and covariance.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from tauhat.sensing.observer_kernel import ROWS, SCRATCH, THERMAL, observe
from tauhat.sensing.stamp_kernel import (
    AGE,
    BELIEVED,
    CLOCK,
    JUDGED,
    NO_BODY,
    NOT_FINITE,
    RESTARTED,
    RING,
    STEPS,
    clocked,
    judge_stamps,
    ticks_until,
)
from tauhat.sensing.thermal_kernel import outlast
from tauhat.sensing.wrench import turn_directions
from tauhat.sensing.wrench_kernel import jacobian_kernel, wrench_kernel

OUT = 6
SETTLED = 0.01  # of the largest torque: a doubt behind a start that counts no more
_LARGEST, _LARGEST_TIME = 1e9, 1e19  # as recordings have them
_TURN = 2.0 * np.pi


def size_of(n_v: int, n_bent: int, n_ring: int) -> int:
    """Return how many numbers a memory holds."""
    return CLOCK + STEPS + (2 + ROWS + JUDGED + 2 + OUT + n_ring) * n_v + 3 * n_bent


@njit(cache=True, nogil=True, error_model="numpy")
def split(state, n_v, n_bent):  # type: ignore[no-untyped-def]
    """Return the parts of a flat memory as views: clock, last sample, rows, bent, ring, then two pairs."""
    a = CLOCK + STEPS
    b = a + 2 * n_v
    c = b + ROWS * n_v
    d = c + 3 * n_bent
    e = d + JUDGED * n_v
    f = e + 2 * n_v
    g = f + OUT * n_v
    stamps = state[d:e].reshape(JUDGED, n_v), state[CLOCK:a].reshape(2, 2)
    said = state[e:f].reshape(2, n_v), state[f:g].reshape(OUT, n_v)
    return (
        state[:CLOCK], state[a:b].reshape(2, n_v), state[b:c].reshape(ROWS, n_v), state[c:d].reshape(3, n_bent),
        state[g:].reshape((state.size - g) // n_v, n_v), stamps, said,
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def scratch(n_v, k):  # type: ignore[no-untyped-def]
    """Return what a step writes on: of the observer, of the wrench in k directions, and one sample."""
    observing = np.empty((SCRATCH, n_v)), np.empty(40 * n_v), np.empty((n_v, n_v))
    solving = (
        np.empty(40 * (n_v + 1)),
        np.empty((6, n_v)),
        np.empty((6, k)),
        (np.empty((k, k)), np.empty((k + 1, n_v)), np.empty((n_v, n_v))),
        np.empty((1 + k, k)),
        np.empty((3, n_v)),
    )
    return observing, solving, np.empty((2, n_v))


@njit(cache=True, nogil=True, error_model="numpy")
def take(machine, stamped, memory, work, out):  # type: ignore[no-untyped-def]
    """Take one stamped sample; return TAKEN, RESTARTED, or why it was not taken, and then nothing else has changed."""
    clock, last, rows, (judged, before) = memory[0], memory[1], memory[2], memory[5]
    numbers = machine[3][0]
    if not _usable(stamped):
        return NOT_FINITE
    code, passed, periods = clocked(stamped[0], numbers, clock)
    if code > RESTARTED:
        return code
    if code == RESTARTED:
        rows[0, 0] = np.nan
        if machine[1][3][0] == THERMAL:
            outlast(machine[1][4], passed, rows)
        _remember(stamped, last)
    _unwind(stamped, last)
    ticks, parts, early = periods, periods + 0.0, 0.0
    if code != RESTARTED and clock[BELIEVED] > 0.0:
        parts = passed / numbers[0]
        ticks, early = ticks_until(passed, numbers[0], clock)
    for tick in range(1, ticks + 1):
        _between(stamped, last, min(1.0, (tick - early) / parts), work[2])
        if not _period(machine, memory, work):
            return NO_BODY
    judge_stamps(numbers[4], (passed, periods + 0.0), stamped[1 : 1 + last.shape[1]], (clock, judged, before))
    _remember(stamped, last)
    out[0][:] = memory[6][1]
    _wrench(machine[2], out, work[1])
    return code


@njit(cache=True, nogil=True, error_model="numpy")
def _unwind(stamped, last):  # type: ignore[no-untyped-def]
    """Take whole turns off positions: no joint moves half a turn between two samples."""
    for j in range(last.shape[1]):
        moved = stamped[1 + j] - last[0, j]
        if abs(moved) > np.pi:
            stamped[1 + j] -= _TURN * np.floor(moved / _TURN + 0.5)


@njit(cache=True, nogil=True, error_model="numpy")
def _between(stamped, last, share, sample):  # type: ignore[no-untyped-def]
    """Fill `sample` with what lies between the last sample and this one; at a share of 1 exactly this one."""
    n_v = last.shape[1]
    for j in range(n_v):
        sample[0, j] = stamped[1 + j] + (1.0 - share) * (last[0, j] - stamped[1 + j])
        sample[1, j] = stamped[1 + n_v + j] + (1.0 - share) * (last[1, j] - stamped[1 + n_v + j])


@njit(cache=True, nogil=True, error_model="numpy")
def _remember(stamped, last):  # type: ignore[no-untyped-def]
    n_v = last.shape[1]
    for j in range(n_v):
        last[0, j], last[1, j] = stamped[1 + j], stamped[1 + n_v + j]


@njit(cache=True, nogil=True, error_model="numpy")
def _usable(stamped):  # type: ignore[no-untyped-def]
    if not abs(stamped[0]) <= _LARGEST_TIME:
        return False
    return np.abs(stamped[1:]).max() <= _LARGEST  # false for nan too: max keeps it


@njit(cache=True, nogil=True, error_model="numpy")
def _period(machine, memory, work):  # type: ignore[no-untyped-def]
    """Let one period pass: delay, observer, doubt behind the start."""
    body, plan, _, (numbers, largest) = machine
    clock, _, rows, bent, ring, _, (lagged, told) = memory
    _delay(numbers[2], clock, ring, work[2])
    starts = np.isnan(rows[0, 0])
    done = observe(body, plan, work[2], (rows, bent, *work[0]), told[:5])
    doubt = behind_start(numbers[1] * clock[AGE])
    for j in range(largest.size):
        told[1, j] += (doubt * largest[j]) ** 2
        kept = 0.0 if starts else numbers[5]
        lagged[0, j] = kept * lagged[0, j] + (1.0 - kept) * told[2, j]
        lagged[1, j] = kept * lagged[1, j] + (1.0 - kept) * told[0, j]
        told[2, j], told[5, j] = lagged[0, j], told[0, j] - lagged[1, j]
    clock[AGE] += numbers[0]
    return done


@njit(cache=True, nogil=True, error_model="numpy")
def behind_start(forgotten):  # type: ignore[no-untyped-def]
    """Return what is left of the doubt of a start, 1 to 0."""
    return (1.0 + forgotten) * np.exp(-forgotten)


@njit(cache=True, nogil=True, error_model="numpy")
def _delay(delay, clock, ring, sample):  # type: ignore[no-untyped-def]
    """Put one channel of the sample back by `delay` periods."""
    if delay == 0.0:
        return
    channel, m = (1 if delay > 0.0 else 0), ring.shape[0]
    whole = int(abs(delay))
    part = abs(delay) - whole
    if clock[RING] < 0.0:
        ring[:] = sample[channel]
        clock[RING] = 0.0
    place = (int(clock[RING]) + 1) % m
    clock[RING] = place
    for j in range(sample.shape[1]):
        ring[place, j] = sample[channel, j]
        sample[channel, j] = (1.0 - part) * ring[(place - whole) % m, j] + part * ring[(place - whole - 1) % m, j]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _wrench(task, out, work):  # type: ignore[no-untyped-def]
    """Fill the wrench and its covariance from the external torque, at the position to which it belongs."""
    links, place, directions, spread, turned, correlation = task
    links_work, jacobian, along, solving, solved, torque = work
    n_v = jacobian.shape[1]
    jacobian_kernel(links, place, out[0][2], links_work, jacobian)
    if turned:
        turn_directions(directions, links_work[40 * n_v :], along)
    else:
        along[:] = directions
    for j in range(n_v):
        torque[0, j], torque[1, j], torque[2, j] = out[0][0, j], out[0][1, j], out[0][5, j] * out[0][5, j]
    wrench_kernel(jacobian, (along, spread, correlation), torque, solving, solved)
    _six(directions, solved, along, out[1])


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _six(directions, solved, half, out):  # type: ignore[no-untyped-def]
    """Fill `out` (7, 6) with D x and D C D' from x and C, (1 + k, k); `half` (6, k) is scratch."""
    k_all = directions.shape[1]
    for r in range(6):
        out[0, r] = 0.0
        for a in range(k_all):
            out[0, r] += directions[r, a] * solved[0, a]
            half[r, a] = 0.0
            for b in range(k_all):
                half[r, a] += directions[r, b] * solved[1 + b, a]
    for r in range(6):
        for c in range(6):
            out[1 + r, c] = 0.0
            for a in range(k_all):
                out[1 + r, c] += half[r, a] * directions[c, a]


@njit(cache=True, nogil=True, error_model="numpy")
def take_one(machine, stamped, state, out):  # type: ignore[no-untyped-def]
    """Take one stamped sample into a flat memory, which changes; return as `take`."""
    n_v = out[0].shape[1]
    memory = split(state, n_v, machine[0][4].size)
    return take(machine, stamped, memory, scratch(n_v, machine[2][3].size), out)


@njit(cache=True, nogil=True, error_model="numpy")
def take_all(machine, samples, state, results, codes):  # type: ignore[no-untyped-def]
    """Take samples, t (n_t,), q and tau (n_t, n_v), one by one; fill `codes`, and a row of results for each one taken.

    `results` are position, velocity, external torque and its standard error, raw external torque (n_v wide each),
    wrench and its standard errors (6), whether the start is forgotten, what the torque changed by within the lag (n_v),
    covariances fx fy, fx fz, fy fz of the force (3), and whether stamps were believed. Return the number of rows
    filled, or -1 where the mass matrix is that of no body.
    """
    n_v = samples[1].shape[1]
    q, dq, tau, tau_std, raw, wrench, wrench_std, settled, lag, shared, believed = results
    memory = split(state, n_v, machine[0][4].size)
    work, out = scratch(n_v, machine[2][3].size), (np.empty((OUT, n_v)), np.empty((7, 6)))
    stamped, filled = np.empty(1 + 2 * n_v), 0
    for k in range(samples[0].size):
        stamped[0] = samples[0][k]
        stamped[1 : 1 + n_v] = samples[1][k]
        stamped[1 + n_v :] = samples[2][k]
        codes[k] = take(machine, stamped, memory, work, out)
        if codes[k] == NO_BODY:
            return -1
        if codes[k] > RESTARTED:
            continue
        for j in range(n_v):
            q[filled, j], dq[filled, j], raw[filled, j] = out[0][2, j], out[0][3, j], out[0][4, j]
            tau[filled, j], tau_std[filled, j] = out[0][0, j], np.sqrt(out[0][1, j])
            lag[filled, j] = out[0][5, j]
        for r in range(6):
            wrench[filled, r], wrench_std[filled, r] = out[1][0, r], np.sqrt(out[1][1 + r, r])
        shared[filled, 0], shared[filled, 1], shared[filled, 2] = out[1][1, 1], out[1][1, 2], out[1][2, 2]
        settled[filled] = behind_start(machine[3][0][1] * memory[0][AGE]) < SETTLED
        believed[filled] = memory[0][BELIEVED] > 0.0
        filled += 1
    return filled
