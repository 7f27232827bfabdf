"""Friction by speed, joint by joint; each kernel adds a torque and its derivative by dq where that is positive.

With the smooth sign `s = tanh(dq / w)`, whose derivative is `(1 - s^2) / w`:
cube root `c |dq|^(1/3) sgn(dq)`; by direction `v+ dq + c+ s` forwards and `v- dq + c- s` backwards; Stribeck
`c exp(-(dq / vs)^2) s`; polynomial `(k0 + k4 exp(-|dq| / vs)) s + k1 dq + k2 |dq| dq + k3 dq^3`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

SLOWEST = 1e-6  # [rad/s or m/s] below which the slope of the cube root no longer grows


@njit(cache=True, nogil=True, error_model="numpy")
def add_smooth_sign(dq, peak, width, torque, damping):  # type: ignore[no-untyped-def]
    """Add `peak s`; all (n_v,)."""
    for j in range(dq.size):
        s = np.tanh(dq[j] / width[j])
        torque[j] += peak[j] * s
        damping[j] += peak[j] / width[j] * (1.0 - s * s)


@njit(cache=True, nogil=True, error_model="numpy")
def add_cube_root(dq, coefficient, torque, damping):  # type: ignore[no-untyped-def]
    """Add `c |dq|^(1/3) sgn(dq)`; all (n_v,)."""
    for j in range(dq.size):
        speed = abs(dq[j])
        torque[j] += np.copysign(coefficient[j] * speed ** (1.0 / 3.0), dq[j])
        damping[j] += max(0.0, coefficient[j]) / 3.0 * max(speed, SLOWEST) ** (-2.0 / 3.0)


@njit(cache=True, nogil=True, error_model="numpy")
def add_by_direction(dq, forwards, backwards, width, torque, damping):  # type: ignore[no-untyped-def]
    """Add viscous and Coulomb friction (2, n_v) of the direction that dq has."""
    for j in range(dq.size):
        s = np.tanh(dq[j] / width[j])
        side = forwards if dq[j] > 0.0 else backwards
        torque[j] += side[0, j] * dq[j] + side[1, j] * s
        damping[j] += side[0, j] + side[1, j] / width[j] * (1.0 - s * s)


@njit(cache=True, nogil=True, error_model="numpy")
def add_stribeck(dq, peak, speed, width, torque, damping):  # type: ignore[no-untyped-def]
    """Add the bump beside zero speed; all (n_v,)."""
    for j in range(dq.size):
        s = np.tanh(dq[j] / width[j])
        bump = peak[j] * np.exp(-((dq[j] / speed[j]) ** 2))
        torque[j] += bump * s
        slope = bump * ((1.0 - s * s) / width[j] - 2.0 * dq[j] / speed[j] ** 2 * s)
        damping[j] += max(0.0, slope)


@njit(cache=True, nogil=True, error_model="numpy")
def add_polynomial(dq, k, speed, width, torque, damping):  # type: ignore[no-untyped-def]
    """Add the five parts, k (5, n_v)."""
    for j in range(dq.size):
        v, size = dq[j], abs(dq[j])
        s = np.tanh(v / width[j])
        decay = k[4, j] * np.exp(-size / speed[j])
        torque[j] += (k[0, j] + decay) * s + v * (k[1, j] + size * (k[2, j] + size * k[3, j]))
        slope = (k[0, j] + decay) * (1.0 - s * s) / width[j] - decay / speed[j] * abs(s)
        slope += k[1, j] + size * (2.0 * k[2, j] + 3.0 * size * k[3, j])
        damping[j] += max(0.0, slope)
