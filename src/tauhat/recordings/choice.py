"""Cut-off frequencies chosen from the recordings when the user gives none."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.recordings.processing import Processing, clock_step, interpolated, moving_joints, unwrapped
from tauhat.recordings.recording import Recording

MOTION_CUTOFF = 3.0  # cut-off of the position over that of torque and columns
_SIGNAL_OVER_FLOOR = 15.0  # spectral density of the position over its noise floor where motion ends
_MOTION_SHARE = 0.999  # share of the velocity's power below the motion's own highest frequency
_BAND_OVER_MOTION = 20.0  # the band of friction's harmonics over the motion's highest frequency
_WINDOW = 4.0  # [s] of one periodogram


def choose_processing(recordings: Sequence[Recording], *, cutoff: float | None = None) -> Processing:
    """Return filters for these recordings: the given cut-off or the smallest that `choose_cutoff` finds in them."""
    chosen = min(choose_cutoff(recording) for recording in recordings) if cutoff is None else cutoff
    return Processing(cutoff=chosen, motion_cutoff=MOTION_CUTOFF * chosen)


def choose_cutoff(recording: Recording) -> float:
    """Return a low-pass cut-off [Hz] from the spectrum of the positions.

    Motion ends where the position's spectrum meets its noise floor (the median above 0.6 of the highest frequency).
    Where the log is so clean that this is far above anything the robot does, twenty times the frequency that holds
    99.9 % of the velocity's power is enough for the harmonics that friction makes. Joints that stand still say nothing.
    """
    from scipy.signal import welch

    step = 1.0 / recording.rate  # the mean: a finer clock would show interpolation instead of the noise floor
    clock = np.arange(recording.t[0], recording.t[-1], step)
    q = interpolated(recording.t, unwrapped(recording.q), clock)
    size = min(clock.size, round(_WINDOW / step))
    frequency, density = welch(q, fs=1.0 / step, nperseg=size, detrend="linear", axis=1)
    loud = density[:, 1:].sum(axis=1) > 0
    moving = loud & moving_joints(recording)
    moving = moving if moving.any() else loud
    if not moving.any():
        return float(frequency[-1])
    limits = [_floor_frequency(frequency, row) for row in density[moving]]
    noise_limit = float(np.median(limits))
    shares = [_motion_frequency(frequency, row, noise_limit) for row in density[moving]]
    lowest = 10.0 * frequency[1]
    return float(np.clip(min(noise_limit, _BAND_OVER_MOTION * np.median(shares)), lowest, frequency[-1]))


def _floor_frequency(frequency: FloatArray, density: FloatArray) -> float:
    floor = np.median(density[frequency > 0.6 * frequency[-1]])
    below = np.flatnonzero(density[1:] <= _SIGNAL_OVER_FLOOR * floor)
    return float(frequency[1 + below[0]]) if below.size else float(frequency[-1])


def _motion_frequency(frequency: FloatArray, density: FloatArray, noise_limit: float) -> float:
    power = density * frequency**2 * (frequency <= noise_limit)
    total = np.cumsum(power)
    return float(frequency[np.searchsorted(total, _MOTION_SHARE * total[-1])])


def top_speeds(recordings: Sequence[Recording]) -> FloatArray:
    """Return each joint's largest speed over 50 ms in the recordings, (n_v,) [rad/s or m/s]."""
    tops = []
    for recording in recordings:
        span = max(1, round(0.05 / clock_step(recording)))
        q = unwrapped(recording.q)
        span = min(span, recording.n_t - 1)
        tops.append((np.abs(q[span:] - q[:-span]) / (recording.t[span:] - recording.t[:-span])[:, None]).max(axis=0))
    return np.asarray(np.max(tops, axis=0))
