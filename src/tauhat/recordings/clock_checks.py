"""Checks of the clock: order, duplicates, gaps, jitter, unit."""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.recordings.findings import Finding
from tauhat.recordings.log import LARGEST_TIME, Log

_GAP = 3.0  # steps longer than this many median steps are gaps
_HARMLESS_GAPS = (0.01, 20.0)  # part of the steps, and length in median steps, below which gaps are only noted
_JITTER = 0.05  # standard deviation over mean of the steps, from which plain differences are wrong
_STEPS = (2e-5, 0.2)  # [s] shortest and longest step of a controller's log


def check_clock(log: Log) -> list[Finding]:
    """Return what is wrong with the time stamps of a log of at least two samples."""
    finite = np.flatnonzero(np.abs(log.t) <= LARGEST_TIME)
    steps = np.diff(log.t[finite])
    after = finite[1:]
    if not (steps > 0).any():
        return [
            Finding(
                code="time_stands", severity="error", message="the time never increases",
                advice="choose another time column in the map, or give [time] rate",
            )
        ]  # fmt: skip
    found = [*_order(log, steps, after), *_gaps(log, steps, after), *_jitter(steps), *_unit(steps)]
    forward = steps[steps > 0]
    if not found:
        rate = 1.0 / forward.mean()
        message = f"{log.n_t} samples at {rate:.4g} Hz for {log.t[-1] - log.t[0]:.4g} s, no gaps, steady"
        found.append(Finding(code="clock", severity="ok", message=message, number=rate))
    return found


def _order(log: Log, steps: FloatArray, after: np.ndarray) -> list[Finding]:
    found = []
    back = np.flatnonzero(steps < 0)
    if back.size:
        row = log.first_row + int(after[back[0]])
        found.append(
            Finding(
                code="time_back", severity="error", number=float(back.size),
                message=f"time goes back {_times(back.size)}, first at row {row} by {-steps[back[0]]:.3g} s",
                advice="two runs in one file? take one with rows FROM:TO",
            )
        )  # fmt: skip
    same = np.flatnonzero(steps == 0)
    if same.size:
        found.append(_duplicates(log, after[same], same))
    return found


def _duplicates(log: Log, rows: np.ndarray, same: np.ndarray) -> Finding:
    copies = np.logical_and.reduce(
        [(signal[rows] == signal[rows - 1]).all(axis=1) for signal in log.signals().values()]
    )
    first = f"first at row {log.first_row + int(rows[0])}"
    if copies.all():
        return Finding(
            code="duplicate_rows", severity="warning", number=float(same.size),
            message=f"{same.size} rows repeat the row before exactly, {first}", advice="they are dropped when read",
        )  # fmt: skip
    return Finding(
        code="duplicate_time", severity="error", number=float(np.count_nonzero(~copies)),
        message=f"{np.count_nonzero(~copies)} time stamps appear twice with different values, {first}",
        advice="the clock is too coarse: give [time] rate in the map",
    )  # fmt: skip


def _gaps(log: Log, steps: FloatArray, after: np.ndarray) -> list[Finding]:
    median = float(np.median(steps[steps > 0]))
    gaps = np.flatnonzero(steps > _GAP * median)
    if not gaps.size:
        return []
    longest = int(gaps[steps[gaps].argmax()])
    few, short = _HARMLESS_GAPS
    harmless = gaps.size < few * steps.size and steps[longest] < short * median
    return [
        Finding(
            code="time_gaps", severity="note" if harmless else "warning", number=float(steps[longest]),
            message=f"{_gap_count(gaps.size)} in time, the longest {steps[longest]:.3g} s at row "
            f"{log.first_row + int(after[longest])} where {median:.3g} s is usual",
            advice="short ones are bridged by resampling; cut the log at long ones with rows FROM:TO",
        )
    ]  # fmt: skip


def _jitter(steps: FloatArray) -> list[Finding]:
    forward = steps[steps > 0]
    jitter = float(forward.std() / forward.mean())
    if jitter < _JITTER:
        return []
    return [
        Finding(
            code="time_jitter", severity="warning", number=jitter,
            message=f"uneven clock: steps of {forward.min():.3g} to {forward.max():.3g} s, {jitter:.0%} of the mean",
            advice="processing resamples it; a logged velocity beats a differentiated position",
        )
    ]  # fmt: skip


def _unit(steps: FloatArray) -> list[Finding]:
    step = float(np.median(steps[steps > 0]))
    shortest, longest = _STEPS
    if shortest <= step <= longest:
        return []
    guess = "ms" if step > longest and step < 100 else "us or ns" if step > longest else "s"
    return [
        Finding(
            code="time_unit", severity="warning", number=step,
            message=f"a step of {step:.3g} s is unlikely for a controller: does the time count {guess}?",
            advice='set [time] unit = "s", "ms", "us" or "ns" in the map',
        )
    ]  # fmt: skip


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"


def _gap_count(count: int) -> str:
    return "one gap" if count == 1 else f"{count} gaps"
