"""One stamped sample through the whole force sensor: clock, delay, observer, doubt behind a start, wrench.

A sample is the vector (t, q, tau), 1 + 2 n_v. Time stamps say how many periods h lie between two samples, not when each
was taken: `phase+ = 0.8 phase + passed / h` is rounded to a number of periods, at least one, and keeps what is left. So
stamps that jitter by a quarter of a period, or come in pairs, count as one period each, and lost samples are put back
on straight lines. When `passed` exceeds `longest`, everything starts again. Positions that jump by whole turns are
unwound.

`memory` is one flat vector, so that copying it is one copy: clock (CLOCK: last time, phase, time since the start, row
of the ring last written, late samples in a row), last sample (2, n_v), `rows` and `bent` of the observer, ring (m,
n_v). The ring delays one of the two channels: torque where `delay` (in periods) is positive, else position, read
linearly.

Behind a start nobody knows the velocity, and the filter takes it for zero. The standard error begins at the joint's
largest torque F and falls as observer and filter forget,
    variance += (F (1 + l age) exp(-l age))^2,    l the slower of their rates.

`machine` is body and plan as `observe` has them, the task (links, place, directions, spread, turned) of a WrenchSolver,
and limits: numbers (h, l, delay, longest) and F (n_v,). `out` is (5, n_v) of the observer and (7, 6), wrench and
covariance.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from tauhat.sensing.observer_kernel import ROWS, SCRATCH, observe
from tauhat.sensing.wrench import turn_directions
from tauhat.sensing.wrench_kernel import jacobian_kernel, wrench_kernel

TAKEN, RESTARTED, LATE, REPEATED, NOT_FINITE, NO_BODY = range(6)
CLOCK = 5
SETTLED = 0.01  # of the largest torque: a doubt behind a start that counts no more
_KEPT = 0.8  # of the phase: stamps that are a little off the rate never add up to a period
_SET_BACK = 50  # late samples in a row mean that the clock was set back
_LARGEST, _LARGEST_TIME = 1e9, 1e19  # as recordings have them
_TURN = 2.0 * np.pi


@njit(cache=True, nogil=True, error_model="numpy")
def split(state, n_v, n_bent):  # type: ignore[no-untyped-def]
    """Return the parts of a flat memory as views: clock, last sample, rows, bent, ring."""
    a, b = CLOCK, CLOCK + 2 * n_v
    c = b + ROWS * n_v
    d = c + 2 * n_bent
    return (
        state[:a], state[a:b].reshape(2, n_v), state[b:c].reshape(ROWS, n_v), state[c:d].reshape(2, n_bent),
        state[d:].reshape((state.size - d) // n_v, n_v),
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def scratch(n_v, k):  # type: ignore[no-untyped-def]
    """Return what a step writes on: of the observer, of the wrench in k directions, and one sample."""
    observing = np.empty((SCRATCH, n_v)), np.empty(40 * n_v), np.empty((n_v, n_v))
    solving = (
        np.empty(40 * (n_v + 1)),
        np.empty((6, n_v)),
        np.empty((6, k)),
        np.empty((k, k + n_v)),
        np.empty((1 + k, k)),
    )
    return observing, solving, np.empty((2, n_v))


@njit(cache=True, nogil=True, error_model="numpy")
def take(machine, stamped, memory, work, out):  # type: ignore[no-untyped-def]
    """Take one stamped sample; return TAKEN, RESTARTED, or why it was not taken, and then nothing else has changed."""
    clock, last, rows = memory[0], memory[1], memory[2]
    if not _usable(stamped):
        return NOT_FINITE
    code, periods = _clocked(stamped[0], machine[3][0], clock)
    if code > RESTARTED:
        return code
    if code == RESTARTED:
        rows[0, 0] = np.nan
        _remember(stamped, last)
    _unwind(stamped, last)
    for period in range(1, periods + 1):
        _between(stamped, last, period / periods, work[2])
        if not _period(machine, memory, work, out[0]):
            return NO_BODY
    _remember(stamped, last)
    _wrench(machine[2], out, work[1])
    return code


@njit(cache=True, nogil=True, error_model="numpy")
def _clocked(t, numbers, clock):  # type: ignore[no-untyped-def]
    """Return what becomes of a sample of this time, and how many periods it is behind the last one."""
    passed = t - clock[0]
    if passed <= 0.0:
        clock[4] += 1.0
        if clock[4] < _SET_BACK:
            return (REPEATED if passed == 0.0 else LATE), 0
    clock[0], clock[4] = t, 0.0
    if not 0.0 < passed <= numbers[3]:
        clock[1], clock[2], clock[3] = 0.0, 0.0, -1.0
        return RESTARTED, 1
    clock[1] = _KEPT * clock[1] + passed / numbers[0]
    periods = max(1, int(np.floor(clock[1] + 0.5)))
    clock[1] -= periods
    return TAKEN, periods


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
def _period(machine, memory, work, out):  # type: ignore[no-untyped-def]
    """Let one period pass: delay, observer, doubt behind the start."""
    body, plan, _, (numbers, largest) = machine
    clock, _, rows, bent, ring = memory
    _delay(numbers[2], clock, ring, work[2])
    done = observe(body, plan, work[2], (rows, bent, *work[0]), out)
    doubt = behind_start(numbers[1] * clock[2])
    for j in range(largest.size):
        out[1, j] += (doubt * largest[j]) ** 2
    clock[2] += numbers[0]
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
    if clock[3] < 0.0:
        ring[:] = sample[channel]
        clock[3] = 0.0
    place = (int(clock[3]) + 1) % m
    clock[3] = place
    for j in range(sample.shape[1]):
        ring[place, j] = sample[channel, j]
        sample[channel, j] = (1.0 - part) * ring[(place - whole) % m, j] + part * ring[(place - whole - 1) % m, j]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def _wrench(task, out, work):  # type: ignore[no-untyped-def]
    """Fill the wrench and its covariance from the external torque at the filtered position."""
    links, place, directions, spread, turned = task
    links_work, jacobian, along, solving, solved = work
    n_v = jacobian.shape[1]
    jacobian_kernel(links, place, out[0][2], links_work, jacobian)
    if turned:
        turn_directions(directions, links_work[40 * n_v :], along)
    else:
        along[:] = directions
    wrench_kernel(jacobian, (along, spread), out[0][:2], solving, solved)
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
    wrench and its standard errors (6), and whether the start is forgotten. Return the number of rows filled, or -1
    where the mass matrix is that of no body.
    """
    n_v = samples[1].shape[1]
    q, dq, tau, tau_std, raw, wrench, wrench_std, settled = results
    memory = split(state, n_v, machine[0][4].size)
    work, out = scratch(n_v, machine[2][3].size), (np.empty((5, n_v)), np.empty((7, 6)))
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
        for r in range(6):
            wrench[filled, r], wrench_std[filled, r] = out[1][0, r], np.sqrt(out[1][1 + r, r])
        settled[filled] = behind_start(machine[3][0][1] * memory[0][2]) < SETTLED
        filled += 1
    return filled
