"""Averaging of whole periods: a motion repeated n times gives the same motion with noise divided by sqrt(n)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tauhat.arrays import FloatArray, read_only
from tauhat.errors import RecordingError
from tauhat.recordings.processing import clock_step, interpolated, unwrapped
from tauhat.recordings.recording import Recording

_SIGNALS = ("q", "dq", "ddq", "tau", "temperature", "wrench")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PeriodAverage:
    """One period of a repeated motion, averaged.

    recording : one period on a uniform clock
    periods : how many were averaged
    torque_noise : (n_v,) deviation of the torque between the periods, before averaging [Nm or N]; zeros without torque
    position_spread : (n_v,) the same of the position [rad or m]: how well the motion was repeated
    """

    recording: Recording
    periods: int
    torque_noise: FloatArray
    position_spread: FloatArray


def average_periods(recording: Recording, *, period: float, skip: int = 1) -> PeriodAverage:
    """Return the mean of the recording's whole periods.

    Parameters
    ----------
    period : length of one period [s]
    skip : periods left out at the beginning, while the robot settles into the motion

    Raises
    ------
    RecordingError
        when fewer than two whole periods are left.

    Source: Swevers, Ganseman, Tükel, De Schutter, Van Brussel, "Optimal robot excitation and identification", 1997.
    """
    if not period > 0.0 or skip < 0:
        raise RecordingError("period must be positive and skip not negative", got=f"period {period} s, skip {skip}")
    size = round(period / clock_step(recording))
    whole = int((recording.duration + clock_step(recording)) / period + 1e-6) - skip
    if whole < 2 or size < 2:
        raise RecordingError(
            "fewer than two whole periods to average", where=recording.name,
            expected=f">= {(skip + 2) * period:g} s", got=f"{recording.duration:g} s",
            remedy="record longer, skip fewer periods, or correct the period",
        )  # fmt: skip
    step = period / size
    begin = float(recording.t[0]) + skip * period
    t = np.asarray(begin + step * np.arange(whole * size), dtype=np.float64)
    folded = {name: _folded(recording, name, t, whole) for name in _SIGNALS if getattr(recording, name) is not None}
    means = {name: parts.mean(axis=0) for name, parts in folded.items()}
    averaged = replace(recording, t=t[:size], **{**dict.fromkeys(_SIGNALS), **means})
    still = np.zeros((2, size, recording.n_v))
    return PeriodAverage(
        recording=averaged,
        periods=whole,
        torque_noise=read_only(_spread(folded.get("tau", still))),
        position_spread=read_only(_spread(folded["q"])),
    )


def _folded(recording: Recording, name: str, t: FloatArray, whole: int) -> FloatArray:
    """Return a signal as (n_periods, n_per_period, n)."""
    signal = unwrapped(recording.q) if name == "q" else getattr(recording, name)
    return interpolated(recording.t, signal, t).T.reshape(whole, -1, signal.shape[1])


def _spread(folded: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.mean(np.var(folded, axis=0, ddof=1), axis=0)))
