"""The warmth of the gears beside an observer: what it takes off the torque, what it adds to the error, how it is known.

The sensitivity of a joint's friction to its warmth, with z the Dahl state of the thermal term on the position as
measured and y' the velocity of the filtered position, is that behind the filter that the torque passes,
    g = filter(Hd z) + Hv y'
The warmth is slow, so that `theta g` is the friction it makes behind that filter. It comes without the filter's delay:
a correction of theta is seen in the next e already, and not made again. With e the mean external torque of the step,
    friction + theta g        variance of tau_ext + g^2 P
    where the arm is free and the joint moves:  theta - G e,  P (1 - G g),  G = P g / (g^2 P + c rms^2)
    always:  theta+ = warmed by friction (`dynamics.thermal_kernel`),  P+ = k^2 P + (1 - k^2) wander^2
Over a gap t the arm may have stood or run, as before a start: k = exp(-t / T), theta0 and P0 those of a start,
    theta+ = k theta + (1 - k) theta0,  P+ = k^2 P + (1 - k)^2 P0 + (1 - k^2) wander^2
On an arm that is free e is `-g (true theta - theta)` and the model's error. This error is alike over about a second: c,
twice that time over the step, makes the samples of it count as one. An e beyond `limit` deviations counts as that many.

Where nobody knows what changes friction (observer `refresh`), Hd and Hv are that friction itself and theta the part by
which it is larger; nothing heats it, p = 0.

`heat` is numbers (n_v, 5) of `dynamics.thermal_kernel`, slopes Hd, Hv (n_v, 2), slow speeds (n_v,), and the settings:
theta and P at the start, wander^2, c, limit, hold [s], h, length of the Dahl state. `rows` is the observer's memory, of
which 13 theta, 14 P, 15 z, 16 time since the last contact [s], 18-20 filter(Hd z), its slope and what went into the
filter last, and 17, in its first place, what the caller knows: 1 free, -1 touched; at 0 the rule decides, every
|tau_ext| within `limit` of its deviations for `hold` seconds.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from tauhat.dynamics.passive_kernel import bent_by
from tauhat.dynamics.thermal_kernel import heated

WARMTH, VARIANCE, BENT, SINCE, SAID, FELT, SLOPE, LAST = range(13, 21)


@njit(cache=True, nogil=True, error_model="numpy")
def _begin(settings, rows):  # type: ignore[no-untyped-def]
    """Start with a warmth that nobody knows, or with what is left of it behind a gap."""
    for j in range(rows.shape[1]):
        if not rows[VARIANCE, j] > 0.0:
            rows[WARMTH, j], rows[VARIANCE, j] = settings[0], settings[1]
        rows[BENT, j] = rows[SINCE, j] = rows[FELT, j] = rows[SLOPE, j] = rows[LAST, j] = 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def outlast(heat, passed, rows):  # type: ignore[no-untyped-def]
    """Let a time pass in which nobody saw the arm; one that is not above zero is of another clock: nothing is known."""
    numbers, _, _, settings = heat
    for j in range(rows.shape[1]):
        if not passed > 0.0:
            rows[VARIANCE, j] = 0.0
        elif rows[VARIANCE, j] > 0.0:
            kept = numbers[j, 0] ** (passed / settings[6])
            rows[WARMTH, j] = settings[0] + kept * (rows[WARMTH, j] - settings[0])
            lost = (1.0 - kept) ** 2 * settings[1] + (1.0 - kept * kept) * settings[2]
            rows[VARIANCE, j] = kept * kept * rows[VARIANCE, j] + lost


@njit(cache=True, nogil=True, error_model="numpy")
def feel_warmth(heat, numbers, q, rows):  # type: ignore[no-untyped-def]
    """Pass the sensitivity of dry friction through the filter; before `rows` has the position q (n_v,) of the sample.

    Row 6 of the memory is nan at the first sample.
    """
    slopes, settings = heat[1], heat[3]
    if np.isnan(rows[6, 0]):
        _begin(settings, rows)
    for j in range(q.size):
        rows[BENT, j] = bent_by(q[j] - rows[0, j], settings[7], rows[BENT, j])
        now, last = slopes[j, 0] * rows[BENT, j], rows[LAST, j]
        g, slope = rows[FELT, j], rows[SLOPE, j]
        rows[FELT, j] = numbers[0] * g + numbers[1] * slope + numbers[4] * last + numbers[6] * now
        rows[SLOPE, j] = numbers[2] * g + numbers[3] * slope + numbers[5] * last + numbers[7] * now
        rows[LAST, j] = now


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _sensitivity(slopes, rows, j):  # type: ignore[no-untyped-def]
    """Return g of a joint, once `rows` has the filtered velocity of the sample."""
    return rows[FELT, j] + slopes[j, 1] * rows[2, j]


@njit(cache=True, nogil=True, error_model="numpy")
def add_warm_friction(heat, rows, friction):  # type: ignore[no-untyped-def]
    """Add what the warmth makes of friction to `friction` (n_v,)."""
    for j in range(friction.size):
        friction[j] += rows[WARMTH, j] * _sensitivity(heat[1], rows, j)


@njit(cache=True, nogil=True, error_model="numpy")
def _is_free(settings, rows, out):  # type: ignore[no-untyped-def]
    touched = False
    for j in range(rows.shape[1]):
        if out[0, j] * out[0, j] > settings[4] * settings[4] * out[1, j]:
            touched = True
    since = 0.0 if touched else rows[SINCE, 0] + settings[6]
    rows[SINCE] = since
    return since > settings[5]


@njit(cache=True, nogil=True, error_model="numpy")
def follow_warmth(rms, heat, rows, out):  # type: ignore[no-untyped-def]
    """Widen the variance, correct the warmth where the arm is free, and warm or cool it until the next sample."""
    numbers, slopes, slow, settings = heat
    for j in range(rows.shape[1]):
        g = _sensitivity(slopes, rows, j)
        out[1, j] += g * g * rows[VARIANCE, j]
    free = _is_free(settings, rows, out)
    if rows[SAID, 0] != 0.0:
        free = rows[SAID, 0] > 0.0
    for j in range(rows.shape[1]):
        theta, P, speed = rows[WARMTH, j], rows[VARIANCE, j], rows[2, j]
        if free and abs(speed) > slow[j]:
            g = _sensitivity(slopes, rows, j)
            noise = rms[j] * rms[j]
            most = settings[4] * np.sqrt(noise + g * g * P)
            gain = P * g / (g * g * P + settings[3] * noise)
            theta -= gain * min(max(out[4, j], -most), most)
            P *= 1.0 - gain * g
        kept = numbers[j, 0] * numbers[j, 0]
        rows[WARMTH, j] = heated(numbers[j], theta, speed)
        rows[VARIANCE, j] = kept * P + (1.0 - kept) * settings[2]
