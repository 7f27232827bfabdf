"""Prediction of unseen recordings: how far the model's torque is from the measured one, joint by joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, read_only
from tauhat.blas import single_threaded
from tauhat.errors import ModelError
from tauhat.estimation.confidence import student_quantile
from tauhat.estimation.estimate import Estimate, InputLog, input_log
from tauhat.recordings.processing import STANDSTILL, Processing
from tauhat.recordings.recording import Recording
from tauhat.robots.joint import Joint
from tauhat.verification.bands import PredictionBand, half_bands, prediction_band
from tauhat.verification.residual_tests import LogResiduals
from tauhat.verification.series import Kinematics, joined, predicted_rows, temperature_at

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
    band : how wide the 95 % band is, of the parameters alone and with the residual, and how often it holds
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
    band: PredictionBand


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LogPrediction:
    """Measured against predicted torque on one recording.

    input : which file and rows were predicted
    relative_rms, rms, r2 : all joints stacked
    moving_relative_rms : relative_rms over the rows in which some joint is faster than 2 % of its top speed
    t : (n,) [s]; tau, predicted, dq : (n, n_v), filtered and decimated, standstill at both ends left out
    q, ddq : (n, n_v) [rad, rad/s^2] or [m, m/s^2], likewise
    load : (n, n_v) the part of the predicted torque that the links take, without rotors and friction [Nm or N]
    std : (n, n_v) standard error of the predicted torque, from the parameters alone [Nm or N]
    level : (n_v,) root mean square residual of the fit: model error and noise, which no covariance knows [Nm or N]
    quantile : of the parameters' errors, by Student's t: half a 95 % interval is that many standard errors
    temperature : (n, n_v) [deg C], where it was logged
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
    q: FloatArray
    ddq: FloatArray
    load: FloatArray
    std: FloatArray
    level: FloatArray
    quantile: float
    temperature: FloatArray | None = None

    @property
    def parameter_band(self) -> FloatArray:
        """Half of the 95 % band of the predicted torque that the parameters' errors make, (n, n_v) [Nm or N]."""
        return self.quantile * self.std

    @property
    def whole_band(self) -> FloatArray:
        """Half of the 95 % band in which the measured torque should lie: parameters and residual, (n, n_v)."""
        return half_bands(self.parameter_band, self.level)

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
                "band": joint.band.to_dict(),
            }
            for joint in self.joints
        ]
        return {
            "log": self.log, "relative_rms": self.relative_rms, "rms": self.rms, "r2": self.r2,
            "moving_relative_rms": self.moving_relative_rms, "joints": joints,
        }  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Verification:
    """Prediction errors of one estimate on recordings it was not fitted to.

    residuals : which effects their residuals still hold, where they were searched (`residual_tests`)
    """

    logs: tuple[LogPrediction, ...]
    processing: Processing
    residuals: tuple[LogResiduals, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return `{"logs": [...], "processing": {...}}` as plain data, and `residuals` where they were searched."""
        document = {"logs": [log.to_dict() for log in self.logs], "processing": self.processing.to_dict()}
        return document | ({"residuals": [log.to_dict() for log in self.residuals]} if self.residuals else {})


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
    pieces = [
        piece._replace(own=())
        for piece in predicted_rows(estimate, recording, processing=processing, probes=Kinematics())
    ]
    rows = joined(pieces, recording)
    tau, predicted, std, dq = (_time_first(part) for part in (rows.tau, rows.predicted, rows.std, rows.dq))
    quantile = student_quantile(estimate.degrees)
    joints = []
    for j, joint in enumerate(estimate.robot.joints):
        series = _Joint(rows.t, tau[:, j], predicted[:, j], dq[:, j])
        band = prediction_band(series.error, quantile * std[:, j], level=float(estimate.joint_rms[j]))
        joints.append(_joint_error(joint, series, band))
    temperature = temperature_at(recording, rows.t)
    error, log = tau - predicted, input_log(recording)
    moving = (np.abs(dq) > STANDSTILL * np.abs(dq).max(axis=0)).any(axis=1)
    return LogPrediction(
        log=log.name,
        input=log,
        relative_rms=_ratio(error, tau),
        rms=float(np.sqrt(np.mean(error**2))),
        r2=_r2(error, tau),
        moving_relative_rms=_ratio(error[moving], tau[moving]),
        joints=tuple(joints),
        t=read_only(rows.t),
        tau=tau,
        predicted=predicted,
        dq=dq,
        q=_time_first(np.array([own[0] for own in rows.probes])),
        ddq=_time_first(np.array([own[1] for own in rows.probes])),
        load=_time_first(rows.load),
        std=std,
        level=estimate.joint_rms,
        quantile=quantile,
        temperature=None if temperature is None else read_only(temperature),
    )


class _Joint(NamedTuple):
    """Times and one joint's measured torque, predicted torque and velocity, (n,) each."""

    t: FloatArray
    tau: FloatArray
    predicted: FloatArray
    dq: FloatArray

    @property
    def error(self) -> FloatArray:
        """Measured less predicted torque, (n,)."""
        return self.tau - self.predicted


def _time_first(rows: FloatArray) -> FloatArray:
    return np.asarray(read_only(np.ascontiguousarray(rows.T)))


def _ratio(error: FloatArray, tau: FloatArray) -> float:
    size = float(np.linalg.norm(tau))
    return float(np.linalg.norm(error)) / size if size > 0 else float("inf")


def _r2(error: FloatArray, tau: FloatArray) -> float:
    spread = float(np.sum((tau - tau.mean(axis=0)) ** 2))
    return 1.0 - float(np.sum(error**2)) / spread if spread > 0 else 0.0


def _joint_error(joint: Joint, series: _Joint, band: PredictionBand) -> JointError:
    t, tau, _, dq = series
    error = series.error
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
        band=band,
    )


def _rms_or_nan(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")
