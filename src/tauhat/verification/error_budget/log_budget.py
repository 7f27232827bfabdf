"""The error budget of a real log: effects that its residual holds, noise, uncertain parameters, what has no name.

What is named are effects that the model lacks, each with the share of the squared residual that it removes where it was
not fitted. Where the motion repeats with a known period, the variance of the residual from period to period is noise:
no model of the motion can predict it. Where it does not, only the white part of the torque's noise is known, which is
less than all of it. Beside them stands what parameters of the model's own remove when they are refitted on stretches
of the log: as much as their covariance lets expect is uncertainty, the rest says that they are others here, or that the
fit has bent them to make up for a missing effect. Effects are counted beside refitted parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ModelError
from tauhat.estimation.estimate import Estimate
from tauhat.recordings.processing import Processing, clock_step, white_noise
from tauhat.recordings.recording import Recording
from tauhat.verification.joint_search import Effect, JointCase, no_columns
from tauhat.verification.prediction import LogPrediction, predict_recording
from tauhat.verification.residual_tests import LogResiduals, residual_tests
from tauhat.verification.series import Kinematics, base_places, covariance_root, joined, predicted_rows
from tauhat.verification.whiteness import whiteness

NoiseSource: TypeAlias = Literal["periods", "white torque"]
_NOT_REPEATING = frozenset({"time", "temperature"})  # dependences of effects that differ from period to period
_FEWEST_PERIODS = 2
_TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, slots=True, kw_only=True)
class LogShare:
    """What one effect makes of a log's squared residual, all joints stacked.

    share, standard_error : of the squared residual
    joints : on which it was found, and its share of each one's own squared residual
    term : of the torque model that has it; empty where none does
    """

    effect: str
    share: float
    standard_error: float
    joints: tuple[tuple[str, float], ...]
    term: str
    advice: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LogBudget:
    """Where the residual of one log comes from.

    relative_rms : norm of the error over that of the torque, all joints stacked
    missing : effects that the model lacks, the largest first; their shares add up
    changed : groups of the model's parameters that are others on this log than in the fit, each by itself; they
        overlap with one another and with what is missing
    noise : share that does not repeat with the period, less the named effects that do not; without a period, the share
        of the torque's white noise, at least
    source : how the noise is known
    periods : how many of the log were compared; zero without a period
    uncertain : share that refitted parameters remove, as far as the error bars of the fit let it expect
    refitted : share that they remove beyond that
    unnamed : share that is left, never below zero
    joints : name and share of the squared residual
    """

    log: str
    relative_rms: float
    missing: tuple[LogShare, ...]
    changed: tuple[LogShare, ...]
    noise: float
    source: NoiseSource
    periods: int
    uncertain: float
    refitted: float
    unnamed: float
    joints: tuple[tuple[str, float], ...]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return asdict(self)


def log_budget(
    estimate: Estimate,
    recordings: Sequence[Recording],
    *,
    period: float | None = None,
    processing: Processing | None = None,
) -> tuple[LogBudget, ...]:
    """Return for each recording what its residual is made of.

    Parameters
    ----------
    recordings : best such that were not fitted
    period : of a repeated motion, not averaged [s]
    processing : other filters than the estimate's own

    Raises
    ------
    RecordingError
        when a recording does not fit the robot or lacks torque.
    ModelError
        when a recording is too short, or has fewer than two whole periods.
    """
    settings = processing or estimate.processing
    if period is not None and not (np.isfinite(period) and period > 0.0):
        raise ModelError("error budget: period", expected="a positive number of seconds", got=period)
    tested = residual_tests(estimate, recordings, processing=settings)
    return tuple(
        _of_log(estimate, recording, residuals, settings, period)
        for recording, residuals in zip(recordings, tested, strict=True)
    )


def _of_log(
    estimate: Estimate, recording: Recording, residuals: LogResiduals, processing: Processing, period: float | None
) -> LogBudget:
    prediction = predict_recording(estimate, recording, processing=processing)
    squares = np.mean((prediction.tau - prediction.predicted) ** 2, axis=0)
    weights = squares / max(float(squares.sum()), _TINY)
    missing = _gathered([joint.missing for joint in residuals.joints], residuals, weights)
    changed = _gathered([joint.changed for joint in residuals.joints], residuals, weights)
    if period is None:
        variance, periods = _white_variance(recording, processing), 0
    else:
        variance, periods = _unrepeated_variance(prediction, period)
    noise = float(weights @ np.minimum(variance / np.where(squares > 0.0, squares, 1.0), 1.0))
    if periods:
        noise = max(noise - _varying(residuals, weights), 0.0)
    refit = float(weights @ refitted_shares(estimate, recording, processing))
    uncertain = min(float(np.mean(prediction.std**2, axis=0).sum() / max(float(squares.sum()), _TINY)), refit)
    return LogBudget(
        log=residuals.log,
        relative_rms=prediction.relative_rms,
        missing=missing,
        changed=changed,
        noise=noise,
        source="periods" if periods else "white torque",
        periods=periods,
        uncertain=uncertain,
        refitted=refit - uncertain,
        unnamed=max(1.0 - sum(share.share for share in missing) - noise - refit, 0.0),
        joints=tuple((joint.name, float(weight)) for joint, weight in zip(residuals.joints, weights, strict=True)),
    )


def _gathered(
    found: Sequence[tuple[Effect, ...]], residuals: LogResiduals, weights: FloatArray
) -> tuple[LogShare, ...]:
    """Return the effects of all joints, each effect once, with its share of the whole squared residual."""
    shares: dict[str, LogShare] = {}
    for joint, effects, weight in zip(residuals.joints, found, weights, strict=True):
        for effect in effects:
            before = shares.get(effect.effect)
            start = before or LogShare(
                effect=effect.effect, share=0.0, standard_error=0.0, joints=(), term=effect.term, advice=effect.advice
            )  # fmt: skip
            shares[effect.effect] = replace(
                start,
                share=start.share + float(weight) * effect.share,
                standard_error=float(np.hypot(start.standard_error, weight * effect.standard_error)),
                joints=(*start.joints, (joint.name, effect.share)),
            )
    return tuple(sorted(shares.values(), key=lambda share: -share.share))


def _varying(residuals: LogResiduals, weights: FloatArray) -> float:
    """Return the share of named effects that change from period to period: they are not noise."""
    return float(
        sum(
            weight * effect.share
            for joint, weight in zip(residuals.joints, weights, strict=True)
            for effect in joint.missing
            if effect.dependence in _NOT_REPEATING
        )
    )


def refitted_shares(estimate: Estimate, recording: Recording, processing: Processing) -> FloatArray:
    """Return the share of each joint's squared residual that refitting its own parameters removes, (n_v,).

    They are refitted on all stretches of the recording but one, which judges, as the residual tests do; never below
    zero.
    """
    pieces = predicted_rows(estimate, recording, processing=processing, probes=Kinematics())
    rows = joined(list(pieces), recording)
    step = float(rows.t[-1] - rows.t[0]) / (rows.t.size - 1)
    layout = estimate.model.layout(estimate.base.independent)
    shares = []
    for joint, residual in enumerate(rows.tau - rows.predicted):
        place = base_places(estimate, np.asarray(layout.parameters[layout.of_joint(joint)]))
        case = JointCase(
            joint=joint,
            name=estimate.robot.joint_names[joint],
            unit="",
            rms=float(np.sqrt(np.mean(residual**2))),
            relative_rms=float("nan"),
            residual=residual,
            own=rows.own[joint],
            terms=(),
            root=covariance_root(estimate.covariance[np.ix_(place, place)]),
            whiteness=whiteness(residual, step=step, cutoff=processing.cutoff),
        )
        folds = case.cut(np.zeros((0, residual.size)))
        whole = float(folds.squares.sum())
        shares.append(max(1.0 - float(folds.free(no_columns()).sum()) / max(whole, _TINY), 0.0))
    return np.array(shares)


def _unrepeated_variance(prediction: LogPrediction, period: float) -> tuple[FloatArray, int]:
    """Return the variance of the residual from period to period, (n_v,) [Nm^2 or N^2], and how many were compared."""
    from scipy.interpolate import CubicSpline

    t, step = prediction.t, float(np.median(np.diff(prediction.t)))
    periods = int((t[-1] - t[0]) / period + 1e-6)
    size = int(period / step)
    if periods < _FEWEST_PERIODS or size < _FEWEST_PERIODS:
        raise ModelError(
            "fewer than two whole periods of motion to compare",
            where=prediction.log,
            expected=f"{_FEWEST_PERIODS * period:g} s or more",
            got=f"{t[-1] - t[0]:.3g} s",
            remedy="a longer recording, or correct the period",
        )
    residual = CubicSpline(t, prediction.tau - prediction.predicted)
    places = t[0] + np.arange(size) * (period / size)
    folded = np.array([residual(places + number * period) for number in range(periods)])
    return np.asarray(folded.var(axis=0, ddof=1).mean(axis=0)), periods


def _white_variance(recording: Recording, processing: Processing) -> FloatArray:
    """Return the variance that the white part of the torque's noise has behind the filter, (n_v,) [Nm^2 or N^2]."""
    if recording.tau is None:
        return np.zeros(recording.n_v)
    kernel = processing.parallel_filter(1.0 / clock_step(recording)).kernel
    return np.asarray(white_noise(recording.tau) ** 2 * float(kernel @ kernel))
