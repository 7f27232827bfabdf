"""Checks of the numbers themselves: corrupt rows, spikes, quantisation, joints that stand or are missing."""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.recordings.findings import Finding
from tauhat.recordings.log import LARGEST_TIME, Log
from tauhat.recordings.recording import LARGEST_VALUE

STANDING = {"rad": 1e-3, "m": 1e-4}  # travel below which a joint stands
_COARSE = 0.2  # quantisation step x rate over usual speed, from which plain differences are mostly steps
_FLAT = 5  # samples at the extreme value in a row that make a flat top
_SPIKE = {"q": 10.0, "dq": 100.0, "tau": 100.0}  # spike over the roughness around it
_SPIKE_STEPS = 8.0  # a spike is taller than this many quantisation steps
_SPIKE_JUMPS = 4.0  # and than this many usual changes from sample to sample (their 99th percentile)
_SPIKE_SPAN = {"q": 0.0, "dq": 0.0, "tau": 0.02}  # and than this part of the signal's span
_SPIKE_FLOOR = {"q": 1e-3, "dq": 1e-2, "tau": 0.0}  # and than this [rad, rad/s]; a tenth of it in metres
_AROUND = 20  # samples on either side that a spike is compared with


def check_corrupt(log: Log) -> list[Finding]:
    """Return rows that hold no number or an impossible one."""
    found = []
    broken = ~np.isfinite(log.t)
    for signal in log.signals().values():
        broken |= ~np.isfinite(signal).all(axis=1)
    if broken.any():
        found.append(_rows("corrupt_rows", log, broken, "hold no number (empty, NaN or infinite)"))
    with np.errstate(invalid="ignore"):
        absurd = np.isfinite(log.t) & (np.abs(log.t) > LARGEST_TIME)
    for signal in log.signals().values():
        with np.errstate(invalid="ignore"):
            absurd |= (np.isfinite(signal) & (np.abs(signal) > LARGEST_VALUE)).any(axis=1)
    if absurd.any():
        found.append(
            _rows("impossible_values", log, absurd, f"hold a value no joint reaches (above {LARGEST_VALUE:g})")
        )
    return found


def _rows(code: str, log: Log, bad: np.ndarray, what: str) -> Finding:
    count = int(np.count_nonzero(bad))
    first = log.first_row + int(np.argmax(bad))
    return Finding(
        code=code, severity="error", number=float(count), message=f"{count} rows {what}, first at row {first}",
        advice="remove these rows, or take others with rows FROM:TO",
    )  # fmt: skip


def check_spikes(log: Log) -> list[Finding]:
    """Return single samples that stick out of their neighbours as no machine moves."""
    found = []
    for name, signal in log.signals().items():
        if name not in _SPIKE:
            continue
        for joint, unit, values in zip(log.joint_names, log.units, signal.T, strict=True):
            least = _SPIKE_FLOOR[name] * (1.0 if unit == "rad" else 0.1)
            rows = spikes(values, ratio=_SPIKE[name], floor=max(least, _SPIKE_SPAN[name] * float(np.ptp(values))))
            if rows.size:
                found.append(_spike_finding(name, joint, rows, log.first_row))
    return found


def _spike_finding(name: str, joint: str, rows: np.ndarray, first_row: int) -> Finding:
    count = "one single sample" if rows.size == 1 else f"{rows.size} single samples"
    return Finding(
        code="spikes", severity="warning", joint=joint, number=float(rows.size),
        message=f"{count} of {name} out of line, first at row {first_row + int(rows[0])}",
        advice="corrupt rows or glitches of the logger: remove them, or cut the log with rows FROM:TO",
    )  # fmt: skip


def spikes(values: FloatArray, *, ratio: float, floor: float) -> np.ndarray:
    """Return samples that stand alone: `d[k] = x[k] - (x[k-1] + x[k+1]) / 2` is `ratio` times any `|d|` around.

    The two neighbours of a lone spike of height h have `d = -h / 2`; steps, noise and knocks of a machine do not.

    Parameters
    ----------
    values : (n_t,)
    ratio : over the largest |d| of 20 samples on either side, the next two left out
    floor : smallest height
    """
    from scipy.ndimage import maximum_filter1d

    if values.size < 2 * _AROUND:
        return np.empty(0, dtype=np.intp)
    bend = np.zeros_like(values)
    bend[1:-1] = values[1:-1] - 0.5 * (values[2:] + values[:-2])
    height = np.abs(bend)
    around = maximum_filter1d(height, _AROUND - 1, mode="nearest")
    reach = 3 + (_AROUND - 1) // 2
    rough = np.maximum(np.roll(around, reach), np.roll(around, -reach))
    beside = np.maximum(np.abs(np.roll(bend, 1) + 0.5 * bend), np.abs(np.roll(bend, -1) + 0.5 * bend))
    jump = float(np.quantile(np.abs(np.diff(values)), 0.99))
    least = max(floor, _SPIKE_STEPS * quantisation_step(values), _SPIKE_JUMPS * jump)
    alone = (beside < 0.3 * height) & (height > least) & (height > ratio * rough)
    alone[:reach] = alone[-reach:] = False
    return np.flatnonzero(alone)


def quantisation_step(values: FloatArray) -> float:
    """Return the grid that values lie on, estimated from the gaps between distinct values; 0 where there is none."""
    distinct = np.unique(values)
    gaps = np.diff(distinct)
    gaps = np.sort(gaps[gaps > 1e-9 * max(1e-6, float(np.abs(distinct).max()))])
    if gaps.size < 3:
        return float(gaps[0]) if gaps.size else 0.0
    step = float(gaps[gaps.size // 100])
    near = gaps[gaps < 20.0 * step] / step
    regular = np.abs(near - np.round(near)) < 0.1
    return step if regular.mean() > 0.8 else 0.0


def check_quantisation(log: Log) -> list[Finding]:
    """Return whether the steps of the position sensor drown the speed at this rate."""
    rate = 1.0 / float(np.median(np.diff(log.t)))
    finest = 0.0
    found = []
    for joint, unit, values in zip(log.joint_names, log.units, log.q.T, strict=True):
        step = quantisation_step(values)
        finest = max(finest, step)
        speed = _top_speed(values, rate)
        if np.ptp(values) < 10.0 * STANDING[unit] or step * rate < _COARSE * speed:
            continue
        found.append(
            Finding(
                code="quantisation", severity="note", joint=joint, number=step,
                message=f"position moves in steps of {step:.2g} {unit}: one step from sample to sample is "
                f"{step * rate:.2g} {unit}/s, the joint's top speed {speed:.2g} {unit}/s",
                advice="log the velocity too, or keep the cut-off low",
            )
        )  # fmt: skip
    if not found:
        units = "/".join(sorted(set(log.units)))
        text = f"in steps of at most {finest:.2g} {units}" if finest else "without visible steps"
        message = f"position {text}, fine at this rate"
        found.append(Finding(code="quantisation", severity="ok", message=message, number=finest))
    return found


def _top_speed(values: FloatArray, rate: float) -> float:
    """Return the largest mean speed over a tenth of a second."""
    span = min(values.size - 1, max(1, round(0.1 * rate)))
    return float(np.abs(values[span:] - values[:-span]).max()) * rate / span


def check_joints(log: Log) -> list[Finding]:
    """Return joints that stand still or are not there at all."""
    travel = np.ptp(log.q, axis=0)
    torque = np.ptp(log.tau, axis=0) if log.tau is not None else np.ones(log.n_v)
    missing = (travel == 0) & (torque == 0)
    standing = (travel < [STANDING[unit] for unit in log.units]) & ~missing
    found = [
        Finding(
            code="missing_joint", severity="warning", joint=log.joint_names[index], number=0.0,
            message="position and torque never change: the joint is not in the log",
            advice="check its columns in the map",
        )
        for index in np.flatnonzero(missing)
    ]  # fmt: skip
    if standing.any():
        names = ", ".join(log.joint_names[index] for index in np.flatnonzero(standing))
        found.append(
            Finding(
                code="standing_joints", severity="note", number=float(np.count_nonzero(standing)),
                message=f"standing still: {names}",
                advice="what only their motion shows cannot be identified from this log",
            )
        )  # fmt: skip
    return found


def check_torque(log: Log) -> list[Finding]:
    """Return torque that is missing, all zero or cut off at a limit."""
    if log.tau is None:
        advice = "add a [torque] section to the map: without torque nothing can be identified"
        return [Finding(code="torque_missing", severity="note", message="the log has no torque", advice=advice)]
    return [
        finding
        for joint, values in zip(log.joint_names, log.tau.T, strict=True)
        for finding in _check_one_torque(joint, values)
    ]


def _check_one_torque(joint: str, values: FloatArray) -> list[Finding]:
    if not values.any():
        return [
            Finding(
                code="torque_zero", severity="error", joint=joint, number=0.0, message="torque is zero throughout",
                advice="check its column in the map",
            )
        ]  # fmt: skip
    flat = flat_top(values)
    if not flat:
        return []
    return [
        Finding(
            code="saturation", severity="warning", joint=joint, number=float(flat),
            message=f"torque stays at its extreme value for up to {flat} samples: it is cut off",
            advice="leave these rows out: the true torque was larger",
        )
    ]  # fmt: skip


def flat_top(values: FloatArray) -> int:
    """Return the longest run of samples at the largest or smallest value, 0 where that is no flat top.

    Logs that hold each value for some samples have runs everywhere; the flat top must be clearly longer.
    """
    edges = np.flatnonzero(np.diff(values)) + 1
    bounds = np.concatenate([[0], edges, [values.size]])
    lengths = np.diff(bounds)
    heads = values[bounds[:-1]]
    extreme = (heads == values.max()) | (heads == values.min())
    if extreme.all():
        return 0
    longest = int(lengths[extreme].max())
    usual = float(np.quantile(lengths[~extreme], 0.99))
    return longest if longest >= _FLAT and longest > 2.0 * usual else 0
