"""The rate of samples by their time stamps, which jitter, are rounded, come in pairs, and have gaps."""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import SensingError

OFF_RATE = 0.05  # a clock further off than this is another one
_MOST, _SINGLE = 0.75, 0.05  # of the steps that have to be whole multiples, and single ones, where samples are lost
_NO_GAP = 2.5  # periods that two stamps may be apart, early and late by most of one, with no sample between them
_TELLING = 10.0  # periods: half a one more or less of longer steps is within `OFF_RATE`
_TIE = 0.05  # period that a step is from one and a half, say: it is as well one as two
_ORDINARY = 0.25  # of the median: two steps further off hold a lost sample, or one that is late


def check_rate(t: FloatArray, rate: float, *, where: str) -> None:
    """Pass time stamps of this rate, within 5 %, also where many samples between are lost.

    Parameters
    ----------
    t : time stamps [s]
    rate : that is expected [Hz]

    Raises
    ------
    SensingError
        when samples come at another rate.
    """
    usual, expected = usual_step(t), 1.0 / rate
    steps = usual, step_without_gaps(t, expected), step_between_gaps(t, expected)
    if any(abs(step * rate - 1.0) <= OFF_RATE for step in steps):
        return
    raise SensingError(
        "samples of another rate", where=where, expected=f"{rate:.6g} Hz within {100 * OFF_RATE:.0f} %",
        got=f"{1.0 / usual:.6g} Hz" if usual > 0 else "time that stands still",
        remedy="make the sensor for the rate of the samples (--rate)",
    )  # fmt: skip


def usual_step(t: FloatArray) -> float:
    """Return the time between samples [s]: the mean over pairs of steps near their median, lost samples left out.

    Pairs, since some programs stamp two samples at once. Zero where there are too few.
    """
    times = t[np.isfinite(t)]
    span = min(2, times.size - 1)
    if span < 1:
        return 0.0
    steps = (times[span:] - times[:-span]) / span
    steps = steps[steps > 0.0]
    if not steps.size:
        return 0.0
    middle = float(np.median(steps))
    return float(steps[np.abs(steps - middle) <= _ORDINARY * middle].mean())


def step_without_gaps(t: FloatArray, near: float) -> float:
    """Return the mean step, however stamps jitter or are rounded, where none is as long as a gap [s]; else zero."""
    steps = np.diff(t[np.isfinite(t)])
    steps = steps[steps != 0.0]
    if not steps.size or steps.min() < 0.0 or steps.max() > _NO_GAP * near:
        return 0.0
    return float(steps.mean())


def step_between_gaps(t: FloatArray, near: float) -> float:
    """Return the step near one that is expected, of which the times between samples are whole multiples [s].

    So samples of a busy machine have one, though half of them may be lost; those of another rate have none, also where
    it is the expected one over a whole number: then hardly a step is single. Zero where there is none.
    """
    steps = np.diff(t[np.isfinite(t)])
    steps = steps[(steps > 0.0) & (steps <= _TELLING * near)]
    fewer, more = (np.maximum(1.0, np.round(steps / near + side)) for side in (-_TIE, _TIE))
    whole = np.abs(steps - more * near) <= _ORDINARY * near  # one of two, where it is by chance
    single = np.count_nonzero(whole & (more == 1.0))
    if np.count_nonzero(whole) < _MOST * steps.size or single <= _SINGLE * steps.size:
        return 0.0
    found = (float(steps.sum() / periods.sum()) for periods in (fewer, more))  # of all: whole ones are near by choice
    return max(found, key=lambda step: abs(step - near))
