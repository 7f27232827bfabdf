"""Contact sample by sample: external torque against what free motion showed in the same condition.

    b   : zero of each joint, taken while the arm stands and nothing touches it; it fades with the way the joints go
    x_j = |tau_j - b_j| / (sigma_j limit_j)            s = max over joints of x_j
    contact from s >= 1 until s < release
sigma is the observer's own error. The limit is that of free motion: one while the arm settles after a motion, one where
it rests, then steps of the joint's own speed, the first for a joint that stands while others move. Beyond the largest
speed of the free motion the limit grows with the speed.

`way` holds release, step, seconds of settling, of the zero, fading distance, seconds in which the zero follows, and the
seconds at the start in which nothing is told. `rows` is the memory, (2, n_v): zero and x. `state` (3,): 1 in contact,
seconds for which the arm has stood, seconds seen. `sensed` (3, n_v): torque, its variance, velocity; `settled` whether
the sensor has forgotten its start: before, nothing is told. `edges` (n_steps, n_v) is where steps of speed end;
`limits` (2 + n_steps, n_v).
"""

from __future__ import annotations

import numpy as np
from numba import njit

ROWS, STATES = 2, 3
SETTLING, RESTING, MOVING = range(3)
_OVER = 1.05  # in parts of the largest speed of the free motion: faster is outside of it


@njit(cache=True, nogil=True, error_model="numpy")
def judge(scaling, way, sensed, settled, memory):  # type: ignore[no-untyped-def]
    """Take one sample; return s, the condition, and whether a joint is faster than in the free motion."""
    edges, limits = scaling
    rows, state = memory
    state[2] += way[1]
    if not settled or state[2] < way[6]:
        state[0] = state[1] = 0.0
        rows[:] = 0.0
        return 0.0, SETTLING, False
    stands, fastest = _stands(edges[0], sensed[2])
    if stands:
        state[1] += way[1]
    elif state[0] == 0.0:
        state[1] = 0.0
    condition = MOVING if not stands else (SETTLING if state[1] < way[2] else RESTING)
    largest, outside = 0.0, False
    for j in range(rows.shape[1]):
        speed = abs(sensed[2, j])
        if way[3] > 0.0:
            rows[0, j] += _change_of_zero(way, (sensed[0, j], rows[0, j]), (stands, fastest), state)
        limit = _limit(edges[:, j], limits[2:, j], speed) if condition == MOVING else limits[condition, j]
        rows[1, j] = abs(sensed[0, j] - rows[0, j]) / (np.sqrt(sensed[1, j]) * limit)
        largest = max(largest, rows[1, j])
        outside = outside or speed > _OVER * edges[-1, j]
    held = way[0] if state[0] > 0.0 else 1.0
    state[0] = 1.0 if largest >= held else 0.0
    return largest, condition, outside


@njit(cache=True, nogil=True, error_model="numpy")
def _stands(slow, dq):  # type: ignore[no-untyped-def]
    stands, fastest = True, 0.0
    for j in range(dq.size):
        fastest = max(fastest, abs(dq[j]))
        stands = stands and abs(dq[j]) < slow[j]
    return stands, fastest


@njit(cache=True, nogil=True, error_model="numpy")
def _change_of_zero(way, torque, moving, state):  # type: ignore[no-untyped-def]
    """Return by how much a zero changes: standing, the mean of the first seconds, then following; moving, fading."""
    tau, zero = torque
    stands, fastest = moving
    if not stands:
        return zero * np.expm1(-fastest * way[1] / way[4])
    if state[0] > 0.0:
        return 0.0
    span = state[1] if state[1] < way[3] else way[5]
    return (tau - zero) * min(1.0, way[1] / span)


@njit(cache=True, nogil=True, error_model="numpy")
def _limit(edges, limits, speed):  # type: ignore[no-untyped-def]
    for k in range(edges.size):
        if speed < edges[k]:
            return limits[k]
    return limits[-1] * max(1.0, speed / edges[-1])


@njit(cache=True, nogil=True, error_model="numpy")
def judge_along(scaling, way, sensed, settled, memory, out):  # type: ignore[no-untyped-def]
    """Fill `out` (n_t, 4 + 2 n_v): in contact, s, condition, outside, x, zero; `sensed` (n_t, 3, n_v)."""
    n_v = sensed.shape[2]
    for k in range(out.shape[0]):
        largest, condition, outside = judge(scaling, way, sensed[k], settled[k], memory)
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = memory[1][0], largest, condition, 1.0 if outside else 0.0
        out[k, 4 : 4 + n_v], out[k, 4 + n_v :] = memory[0][1], memory[0][0]
