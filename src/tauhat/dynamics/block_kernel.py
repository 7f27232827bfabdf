"""Loading one block of 64 samples: positions, speeds, accelerations, and cosine and sine of the positions together.

Cosine and sine are computed here, both at once and without branches, so that they vectorise like the rest: NumPy calls
the scalar C library for float64 and took a quarter of the regressor's time. With `k = round(2 q / pi)` and
`r = q - k pi/2` (pi/2 in three parts, Cody and Waite), |r| <= pi/4, the Taylor polynomials of degree 17 and 18 are exact
to rounding, and quadrant `k mod 4` swaps and signs them. For |q| < 1e5 the error stays below 3e-16 + 2e-17 |q|.
"""

from __future__ import annotations

from numba import njit

_ROUND = 6755399441055744.0  # 1.5 * 2^52: adding and subtracting it rounds to the nearest whole number
_PER_QUADRANT = 0.6366197723675814  # 2 / pi
_HALF_PI_1 = 1.5707963267341256  # the leading 33 bits of pi/2
_HALF_PI_2 = 6.077100506303966e-11  # the next 33
_HALF_PI_3 = 2.0222662487959506e-21  # the rest


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def load_block(start, size, q, dq, ddq, block):  # type: ignore[no-untyped-def]
    """Fill `block` (5, n_v, 64): cos q, sin q, q, dq, ddq of samples `start` on; a short block repeats old values."""
    for i in range(q.shape[0]):
        position, speed, acceleration = q[i, start:], dq[i, start:], ddq[i, start:]
        cosine, sine = block[0, i], block[1, i]
        angle, rate, change = block[2, i], block[3, i], block[4, i]
        for s in range(size):
            angle[s] = position[s]
        for s in range(size):
            rate[s] = speed[s]
        for s in range(size):
            change[s] = acceleration[s]
        turn_block(angle, cosine, sine)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def turn_block(angle, cosine, sine):  # type: ignore[no-untyped-def]
    """Fill cosine and sine (64,) of `angle` (64,)."""
    for s in range(64):
        a = angle[s]
        k = (a * _PER_QUADRANT + _ROUND) - _ROUND
        r = ((a - k * _HALF_PI_1) - k * _HALF_PI_2) - k * _HALF_PI_3
        t = r * r
        si = -7.647163731819816e-13 + t * 2.8114572543455206e-15
        si = 1.6059043836821613e-10 + t * si
        si = -2.505210838544172e-08 + t * si
        si = 2.7557319223985893e-06 + t * si
        si = -0.0001984126984126984 + t * si
        si = 0.008333333333333333 + t * si
        si = -0.16666666666666666 + t * si
        si = r + r * (t * si)
        co = 4.779477332387385e-14 - t * 1.5619206968586225e-16
        co = -1.1470745597729725e-11 + t * co
        co = 2.08767569878681e-09 + t * co
        co = -2.755731922398589e-07 + t * co
        co = 2.48015873015873e-05 + t * co
        co = -0.001388888888888889 + t * co
        co = 0.041666666666666664 + t * co
        co = 1.0 - (0.5 * t - (t * t) * co)
        turn = k - 4.0 * ((0.25 * k - 0.375 + _ROUND) - _ROUND)
        odd = turn == 1.0 or turn == 3.0
        sine_size = co if odd else si
        cosine_size = si if odd else co
        sine[s] = -sine_size if turn >= 2.0 else sine_size
        cosine[s] = -cosine_size if (turn == 1.0 or turn == 2.0) else cosine_size
