"""The warmth of a joint: a state that friction heats, surroundings cool and nobody measures.

    theta' = (p / p0 - theta) / T,    p = (a + da theta) |dq| + (b + db theta) dq^2
with dry and viscous friction a, b at theta = 0, their change da, db by the warmth, and the power p0 at a typical speed:
theta is 1 where a joint settles that runs at this speed, were friction to stay as it is. Over a step p is constant, for
which `theta+ = k theta + (1 - k) p / p0`, k = exp(-h / T), is exact.

`numbers` of a joint are k and a, b, da, db over p0.
"""

from __future__ import annotations

from numba import njit


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def heated(numbers, theta, speed):  # type: ignore[no-untyped-def]
    """Return the warmth behind a step at this speed."""
    v = abs(speed)
    power = ((numbers[1] + numbers[3] * theta) + (numbers[2] + numbers[4] * theta) * v) * v
    return numbers[0] * theta + (1.0 - numbers[0]) * max(power, 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def warmth_kernel(numbers, dq, states, out):  # type: ignore[no-untyped-def]
    """Fill `out` with the warmth along dq, (n_v, n_t) each; numbers (n_v, 5); states (n_v,) are moved on."""
    for j in range(dq.shape[0]):
        theta = states[j]
        for k in range(dq.shape[1]):
            out[j, k] = theta
            theta = heated(numbers[j], theta, dq[j, k])
        states[j] = theta
