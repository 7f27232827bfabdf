"""When samples were taken: at their time stamps, or a whole number of periods apart with stamps that only jitter.

Two clocks go along, both in periods h:
    counted    phase+ = 0.8 phase + passed / h, rounded to a number of periods, at least one; what is left is kept
    believed   ticks of an even clock, the last of them a part of a period before the last sample
A robot moves smoothly, so the right clock is the one on which positions are smooth. With x_i the times of four samples
in a row by either clock, the third divided difference of a joint's positions, scaled so that white noise counts alike,
    r = sum of w_i q_i,    w_i = c / prod_(k != i) (x_i - x_k),    |w| = 1
is small by the right clock and grows with speed times jitter by the other. Sums of r^2 that forget within 100 samples
are compared joint by joint, and
    D = sum over joints of (R_counted - R_believed) / (R_counted + R_believed)
is 1 for each joint that moves when the stamps are right, -1 when they jitter, and about 0 for joints that stand or
where both clocks agree. Beyond 0.75 either way the sensor follows, else it stays; it begins with counting.

`clock` (CLOCK,): 0 last time, 1 phase of the count, 2 time since the start, 3 row of the ring last written, 4 late
samples in a row, 5 periods since the last tick, 6 whether stamps are believed, 7 samples since the start, 8 samples
judged. `judged` (5, n_v): 0-2 positions of the last three samples, 3 R believed, 4 R counted. `before` (2, 2): the last
two steps, in seconds and in counts. `numbers` begins with h, l, delay, longest as `sensor_kernel` has them.
"""

from __future__ import annotations

import numpy as np
from numba import njit

TAKEN, RESTARTED, LATE, REPEATED, NOT_FINITE, NO_BODY = range(6)
CLOCK, JUDGED, STEPS = 9, 5, 4
JITTERED, EXACT, AUTO = range(3)
LATEST, _PHASE, AGE, RING, _LATE_ROW, _SINCE_TICK, BELIEVED, _SEEN, _COUNTED = range(CLOCK)
_KEPT = 0.8  # of the phase: stamps that are a little off the rate never add up to a period
_SET_BACK = 50  # late samples in a row mean that the clock was set back
_REMEMBERED = 0.99  # of the sums of squares, sample by sample
_ENOUGH, _CLEAR = 50, 0.75  # samples judged before anything is decided, and D
_NOTHING = 1e-24  # [rad^2 or m^2] a roughness that is rounding
_ROUNDING = 1e-6  # of a period: a tick so little behind a sample is at it


@njit(cache=True, nogil=True, error_model="numpy")
def clocked(t, numbers, clock):  # type: ignore[no-untyped-def]
    """Return what becomes of a sample of this time, the time passed, and how many periods it is behind the last one."""
    passed = t - clock[LATEST]
    if passed <= 0.0:
        clock[_LATE_ROW] += 1.0
        if clock[_LATE_ROW] < _SET_BACK:
            return (REPEATED if passed == 0.0 else LATE), passed, 0
    clock[LATEST], clock[_LATE_ROW] = t, 0.0
    if not 0.0 < passed <= numbers[3]:
        clock[_PHASE], clock[AGE], clock[RING], clock[_SINCE_TICK], clock[_SEEN] = 0.0, 0.0, -1.0, 0.0, 0.0
        return RESTARTED, passed, 1
    clock[_PHASE] = _KEPT * clock[_PHASE] + passed / numbers[0]
    periods = max(1, int(np.floor(clock[_PHASE] + 0.5)))
    clock[_PHASE] -= periods
    return TAKEN, passed, periods


@njit(cache=True, nogil=True, error_model="numpy")
def ticks_until(passed, h, clock):  # type: ignore[no-untyped-def]
    """Return how many ticks of the even clock lie behind the last sample up to this one, and how early the last was.

    The part of the way from the last sample to this one at which tick k lies is `(k - early) h / passed`.
    """
    early = clock[_SINCE_TICK]
    whole = early + passed / h
    ticks = int(np.floor(whole + _ROUNDING))
    clock[_SINCE_TICK] = max(0.0, whole - ticks)
    return ticks, early


@njit(cache=True, nogil=True, error_model="numpy")
def judge_stamps(way, spans, q, memory):  # type: ignore[no-untyped-def]
    """Judge both clocks by one more position q (n_v,), `spans` (passed, periods) behind the last; decide on auto."""
    clock, judged, before = memory
    seen = clock[_SEEN]
    if way == AUTO and seen >= 3.0:
        for which in range(2):
            _add_roughness((before[which, 1], before[which, 0], spans[which]), q, judged, 3 + which)
        clock[_COUNTED] += 1.0
        if clock[_COUNTED] >= _ENOUGH:
            _decide(clock, judged)
    clock[_SEEN] = min(seen + 1.0, 3.0)
    for which in range(2):
        before[which, 1], before[which, 0] = before[which, 0], spans[which]
    for j in range(q.size):
        judged[2, j], judged[1, j], judged[0, j] = judged[1, j], judged[0, j], q[j]


@njit(cache=True, nogil=True, error_model="numpy")
def _add_roughness(steps, q, judged, row):  # type: ignore[no-untyped-def]
    """Add the square of the third divided difference of the last four positions, by a clock of these three steps."""
    a, b, c = steps
    w0, w1 = -1.0 / (a * (a + b) * (a + b + c)), 1.0 / (a * b * (b + c))
    w2, w3 = -1.0 / ((a + b) * b * c), 1.0 / ((a + b + c) * (b + c) * c)
    scale = 1.0 / np.sqrt(w0 * w0 + w1 * w1 + w2 * w2 + w3 * w3)
    for j in range(q.size):
        # differences: the weights add up to nothing, and large positions would leave their rounding
        r = w0 * (judged[2, j] - q[j]) + w1 * (judged[1, j] - q[j]) + w2 * (judged[0, j] - q[j])
        r *= scale
        judged[row, j] = _REMEMBERED * judged[row, j] + r * r


@njit(cache=True, nogil=True, error_model="numpy")
def _decide(clock, judged):  # type: ignore[no-untyped-def]
    decided = 0.0
    for j in range(judged.shape[1]):
        decided += (judged[4, j] - judged[3, j]) / (judged[4, j] + judged[3, j] + _NOTHING)
    if decided > _CLEAR and clock[BELIEVED] == 0.0:
        clock[BELIEVED], clock[_SINCE_TICK] = 1.0, 0.0
    elif decided < -_CLEAR:
        clock[BELIEVED] = 0.0
