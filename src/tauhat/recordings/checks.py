"""Checks of a log that need no model: what is wrong or doubtful in it, in plain words, and what to do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.recordings.clock_checks import check_clock
from tauhat.recordings.findings import SEVERITIES, Finding
from tauhat.recordings.log import LARGEST_TIME, Log
from tauhat.recordings.recording import FEWEST_SAMPLES, LARGEST_VALUE
from tauhat.recordings.unit_checks import check_units, check_velocity
from tauhat.recordings.value_checks import (
    check_corrupt,
    check_joints,
    check_quantisation,
    check_spikes,
    check_torque,
)
from tauhat.robots.robot import Robot

_SLACK = 1e-3  # part of a limit by which encoders may overshoot it
_SOUND = (check_units, check_joints, check_torque, check_spikes, check_quantisation, check_velocity)


def check_log(log: Log) -> tuple[Finding, ...]:
    """Return what a log's own numbers tell, the gravest first.

    Rows that are corrupt or out of order are reported once; everything else is judged on the rows that are left.
    """
    if log.n_t < FEWEST_SAMPLES:
        message = f"only {log.n_t} samples"
        advice = f"at least {FEWEST_SAMPLES} are needed, a motion of some seconds is of use"
        return (
            Finding(code="too_few_samples", severity="error", message=message, number=float(log.n_t), advice=advice),
        )
    found = [*check_corrupt(log), *check_clock(log)]
    sound = sound_rows(log)
    if np.count_nonzero(sound) >= FEWEST_SAMPLES:
        cleaned = _only(log, sound)
        for check in _SOUND:
            found.extend(check(cleaned))
    return _gravest_first(found)


def check_limits(log: Log, robot: Robot) -> tuple[Finding, ...]:
    """Return where a log exceeds the limits of a robot, the gravest first.

    A position or speed beyond its limit is a wrong unit, offset or robot more often than a real event; a torque beyond
    its limit is often a short peak and only noted.
    """
    if log.n_v != robot.n_v:
        return (
            Finding(
                code="joint_count", severity="error", number=float(log.n_v),
                message=f"the log has {log.n_v} joints, {robot.name} has {robot.n_v}: {', '.join(robot.joint_names)}",
                advice="choose the columns of the same joints in the map, or lock the others of the robot",
            ),
        )  # fmt: skip
    cleaned = _only(log, sound_rows(log))
    found = [
        *_beyond(cleaned, robot, "position", (robot.lower, robot.upper)),
        *_beyond(cleaned, robot, "velocity", (-robot.velocity_limit, robot.velocity_limit)),
        *_beyond(cleaned, robot, "effort", (-robot.effort_limit, robot.effort_limit)),
    ]
    if not found and cleaned.n_t:
        found = [Finding(code="limits", severity="ok", message=f"inside the limits of {robot.name}")]
    return _gravest_first(found)


def sound_rows(log: Log) -> np.ndarray:
    """Return a mask of the rows whose numbers are possible and whose time is later than all before, (n_t,)."""
    sound = np.abs(log.t) <= LARGEST_TIME
    for signal in log.signals().values():
        with np.errstate(invalid="ignore"):
            sound &= (np.isfinite(signal) & (np.abs(signal) <= LARGEST_VALUE)).all(axis=1)
    latest = np.maximum.accumulate(np.where(sound, log.t, -np.inf))
    return sound & (log.t > np.concatenate([[-np.inf], latest[:-1]]))


def _only(log: Log, rows: np.ndarray) -> Log:
    """Return the log with some of its rows, the log itself when these are all."""
    if rows.all():
        return log
    cut = {name: signal[rows] for name, signal in log.signals().items()}
    return replace(log, t=log.t[rows], **cut)


def _beyond(log: Log, robot: Robot, kind: str, limits: tuple[FloatArray, FloatArray]) -> list[Finding]:
    values = {"position": log.q, "velocity": log.dq, "effort": log.tau}[kind]
    if values is None or not values.size:
        return []
    lower, upper = limits
    reach = np.where(np.isfinite(upper - lower), upper - lower, 0.0)
    excess = np.maximum(values - upper, lower - values)
    found = []
    for index in np.flatnonzero(excess.max(axis=0) > _SLACK * reach + 1e-9):
        row = int(excess[:, index].argmax())
        count = int(np.count_nonzero(excess[:, index] > _SLACK * reach[index] + 1e-9))
        joint = robot.joints[index]
        unit = {"position": joint.unit, "velocity": f"{joint.unit}/s", "effort": joint.effort_unit}[kind]
        bound = upper[index] if values[row, index] > upper[index] else lower[index]
        found.append(
            Finding(
                code=f"{kind}_limit", severity="note" if kind == "effort" else "warning", joint=joint.name,
                number=float(values[row, index]),
                message=f"{kind} reaches {values[row, index]:.4g} {unit}, the limit is {bound:.4g} ({count} samples)",
                advice="check unit, sign and offset in the map, and that this is the right robot",
            )
        )  # fmt: skip
    return found


def _gravest_first(found: list[Finding]) -> tuple[Finding, ...]:
    return tuple(sorted(found, key=lambda finding: -SEVERITIES.index(finding.severity)))
