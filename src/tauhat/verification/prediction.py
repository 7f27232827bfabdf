"""Prediction of unseen recordings: how far the model's torque is from the measured one, joint by joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, read_only
from tauhat.blas import single_threaded
from tauhat.errors import ModelError
from tauhat.estimation.estimate import Estimate, InputLog, input_log
from tauhat.estimation.rows import filtered_rows
from tauhat.recordings.processing import STANDSTILL, Processing
from tauhat.recordings.recording import Recording
from tauhat.robots.joint import Joint

PARTS = 10  # stretches of time, and bins of speed, that the error is told for


@dataclass(frozen=True, slots=True, kw_only=True)
class JointError:
    """Prediction error of one joint on one recording.

    rms : of the error [Nm or N]
    relative_rms : norm of the error over norm of the measured torque
    r2 : share of the torque's variance that is predicted
    worst, worst_at : largest error [Nm or N] and its time [s]
    by_time : rms error in ten equal stretches of time [Nm or N]
    by_speed : rms error in ten bins from zero to the joint's largest speed; nan where there is no sample
    """

    name: str
    unit: str
    rms: float
    relative_rms: float
    r2: float
    worst: float
    worst_at: float
    by_time: tuple[float, ...]
    by_speed: tuple[float, ...]
    top_speed: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LogPrediction:
    """Measured against predicted torque on one recording.

    input : which file and rows were predicted
    relative_rms, rms, r2 : all joints stacked
    moving_relative_rms : relative_rms over the rows in which some joint is faster than 2 % of its top speed
    t : (n,) [s]; tau, predicted, dq : (n, n_v), filtered and decimated, standstill at both ends left out
    """

    log: str
    input: InputLog
    relative_rms: float
    rms: float
    r2: float
    moving_relative_rms: float
    joints: tuple[JointError, ...]
    t: FloatArray
    tau: FloatArray
    predicted: FloatArray
    dq: FloatArray

    def to_dict(self) -> dict[str, Any]:
        """Return the figures, without the series, as plain data."""
        joints = [
            {
                "name": joint.name,
                "unit": joint.unit,
                "relative_rms": joint.relative_rms,
                "rms": joint.rms,
                "r2": joint.r2,
                "worst": joint.worst,
                "worst_at": joint.worst_at,
                "by_time": list(joint.by_time),
                "by_speed": [value if np.isfinite(value) else None for value in joint.by_speed],
                "top_speed": joint.top_speed,
            }
            for joint in self.joints
        ]
        return {
            "log": self.log, "relative_rms": self.relative_rms, "rms": self.rms, "r2": self.r2,
            "moving_relative_rms": self.moving_relative_rms, "joints": joints,
        }  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Verification:
    """Prediction errors of one estimate on recordings it was not fitted to."""

    logs: tuple[LogPrediction, ...]
    processing: Processing

    def to_dict(self) -> dict[str, Any]:
        """Return `{"logs": [...], "processing": {...}}` as plain data."""
        return {"logs": [log.to_dict() for log in self.logs], "processing": self.processing.to_dict()}


@single_threaded
def verify(
    estimate: Estimate, recordings: Sequence[Recording], *, processing: Processing | None = None
) -> Verification:
    """Return how well the estimate predicts recordings, through the filters it was fitted with.

    Parameters
    ----------
    processing : other filters than the estimate's own

    Raises
    ------
    RecordingError
        when a recording does not fit the robot or lacks torque.
    """
    if not recordings:
        raise ModelError("no recording to verify on")
    settings = processing or estimate.processing
    logs = tuple(predict_recording(estimate, recording, processing=settings) for recording in recordings)
    return Verification(logs=logs, processing=settings)


def predict_recording(estimate: Estimate, recording: Recording, *, processing: Processing) -> LogPrediction:
    """Return measured and predicted torque of one recording and their difference in figures."""
    model, base = estimate.model, estimate.base
    layout = model.layout(base.independent)
    place = np.empty(len(base.names))
    place[base.independent] = estimate.values
    weights = place[layout.parameters]
    times, measured, predicted, speeds = [], [], [], []
    for rows in filtered_rows(model, layout, recording, processing):
        joints = [layout.of_joint(joint) for joint in range(model.robot.n_v)]
        predicted.append(np.array([weights[part] @ rows.columns[part] for part in joints]))
        times.append(rows.t)
        measured.append(rows.tau)
        speeds.append(rows.dq)
    if not times:
        raise ModelError("no row of the recording is left to verify on", where=recording.name)
    series = [np.ascontiguousarray(np.concatenate(part, axis=1).T) for part in (measured, predicted, speeds)]
    return _log_prediction(estimate, input_log(recording), _Series(np.concatenate(times), *series))


class _Series(NamedTuple):
    """Times (n,) and measured torque, predicted torque and velocity, (n, n_v) each, or (n,) for one joint."""

    t: FloatArray
    tau: FloatArray
    predicted: FloatArray
    dq: FloatArray

    def of_joint(self, joint: int) -> _Series:
        return _Series(self.t, self.tau[:, joint], self.predicted[:, joint], self.dq[:, joint])


def _log_prediction(estimate: Estimate, log: InputLog, series: _Series) -> LogPrediction:
    t, tau, predicted, dq = series
    error = tau - predicted
    moving = (np.abs(dq) > STANDSTILL * np.abs(dq).max(axis=0)).any(axis=1)
    joints = tuple(_joint_error(joint, series.of_joint(k)) for k, joint in enumerate(estimate.robot.joints))
    return LogPrediction(
        log=log.name,
        input=log,
        relative_rms=_ratio(error, tau),
        rms=float(np.sqrt(np.mean(error**2))),
        r2=_r2(error, tau),
        moving_relative_rms=_ratio(error[moving], tau[moving]),
        joints=joints,
        t=read_only(t),
        tau=read_only(tau),
        predicted=read_only(predicted),
        dq=read_only(dq),
    )


def _ratio(error: FloatArray, tau: FloatArray) -> float:
    size = float(np.linalg.norm(tau))
    return float(np.linalg.norm(error)) / size if size > 0 else float("inf")


def _r2(error: FloatArray, tau: FloatArray) -> float:
    spread = float(np.sum((tau - tau.mean(axis=0)) ** 2))
    return 1.0 - float(np.sum(error**2)) / spread if spread > 0 else 0.0


def _joint_error(joint: Joint, series: _Series) -> JointError:
    t, tau, predicted, dq = series
    error = tau - predicted
    speed = np.abs(dq)
    top = float(speed.max())
    in_time = np.array_split(error, PARTS)
    bins = np.minimum((PARTS * speed / top).astype(int), PARTS - 1) if top > 0 else np.zeros(error.size, dtype=int)
    worst = int(np.abs(error).argmax())
    return JointError(
        name=joint.name,
        unit=joint.effort_unit,
        rms=float(np.sqrt(np.mean(error**2))),
        relative_rms=_ratio(error, tau),
        r2=_r2(error, tau),
        worst=float(abs(error[worst])),
        worst_at=float(t[worst]),
        by_time=tuple(float(np.sqrt(np.mean(part**2))) if part.size else 0.0 for part in in_time),
        by_speed=tuple(_rms_or_nan(error[bins == k]) for k in range(PARTS)),
        top_speed=top,
    )


def _rms_or_nan(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")
