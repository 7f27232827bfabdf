"""From recordings to an estimate in one call."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import asdict, fields

import numpy as np

from tauhat.blas import single_threaded
from tauhat.dynamics.base import BaseParameters, base_parameters
from tauhat.dynamics.model import TorqueModel
from tauhat.errors import ModelError, TauhatWarning
from tauhat.estimation.estimate import Estimate, input_log
from tauhat.estimation.evidence import Evidence, collect_all
from tauhat.estimation.least_squares import Estimator, WeightedLeastSquares
from tauhat.estimation.rows import check_joints
from tauhat.estimation.solution import Solution
from tauhat.estimation.tuning import tuned
from tauhat.recordings.processing import Processing, moving_joints
from tauhat.recordings.recording import Recording

DOUBTFUL_CONDITION = 300.0  # scaled condition number above which a motion does not support its model


@single_threaded
def identify(
    model: TorqueModel,
    recordings: Sequence[Recording],
    *,
    estimator: Estimator | None = None,
    processing: Processing | None = None,
    cutoff: float | None = None,
) -> Estimate:
    """Return the model's base parameters identified from recordings, with error bars and provenance.

    Parameters
    ----------
    recordings : of the same robot; each is processed on its own and its evidence merged
    estimator : weighted least squares by default
    processing : all filters; chosen from the recordings by default and kept in the estimate
    cutoff : only the low-pass of torque and columns [Hz]; the rest is chosen

    Raises
    ------
    RecordingError
        when a recording does not fit the robot or lacks torque.
    ModelError
        when the recordings cannot determine the model at all.

    Warns
    -----
    TauhatWarning
        when a joint stands still, the motion is too weak for the model, or friction comes out negative on most joints.
    """
    if not recordings:
        raise ModelError("no recording to identify from")
    for recording in recordings:
        check_joints(model, recording)
    method = estimator or WeightedLeastSquares()
    settled, settings = tuned(model, recordings, processing=processing, cutoff=cutoff)
    base = base_parameters(settled)
    evidence = collect_all(settled, base, recordings, settings)
    solution = method.fit(evidence)
    _warn_of_still_joints(recordings)
    estimate = _estimate(settled, base, solution, settings=settings, method=method, recordings=recordings)
    warn_of_weak_motion(evidence, solution, estimate)
    _warn_of_negative_friction(estimate)
    return estimate


def _estimate(
    model: TorqueModel,
    base: BaseParameters,
    solution: Solution,
    *,
    settings: Processing,
    method: Estimator,
    recordings: Sequence[Recording],
) -> Estimate:
    kept = {field.name for field in fields(Solution)} & {field.name for field in fields(Estimate)}
    return Estimate(
        model=model,
        base=base,
        processing=settings,
        estimator={"name": method.key, **asdict(method)},
        inputs=tuple(input_log(recording) for recording in recordings),
        **{name: getattr(solution, name) for name in kept},
    )


def warn_of_weak_motion(evidence: Evidence, solution: Solution, estimate: Estimate) -> None:
    """Warn when rank is lost or the scaled condition number says that the motion cannot tell the parameters apart."""
    if solution.rank < evidence.n_b:
        warnings.warn(
            f"the motion determines only {solution.rank} of {evidence.n_b} base parameters, the others are the "
            "smallest that fit: do not use the model outside this motion; record a richer one",
            TauhatWarning,
            stacklevel=3,
        )
    elif solution.condition > DOUBTFUL_CONDITION:
        weakest = sorted(estimate.summary(), key=lambda row: -row.relative)[:3]
        warnings.warn(
            f"scaled condition number {solution.condition:.3g} (good below 100, doubtful above "
            f"{DOUBTFUL_CONDITION:g}); least certain: {', '.join(row.name for row in weakest)}; the model fits this "
            "motion and may be far off on another: record a richer one or give more recordings",
            TauhatWarning,
            stacklevel=3,
        )


def _warn_of_still_joints(recordings: Sequence[Recording]) -> None:
    """Warn of joints that only flicker: columns of noise look well conditioned and make parameters of nothing."""
    moves = np.any([moving_joints(recording) for recording in recordings], axis=0)
    if not moves.all():
        still = [name for name, moved in zip(recordings[0].joint_names, moves, strict=True) if not moved]
        warnings.warn(
            f"no motion of {', '.join(still)} in any recording: friction and rotor inertia there are fitted to encoder "
            "noise and predict nothing; record a motion that moves every joint, or lock those that stand still",
            TauhatWarning,
            stacklevel=3,
        )


def _warn_of_negative_friction(estimate: Estimate) -> None:
    parameters = estimate.model.parameters
    friction = [
        (float(value), parameters[index])
        for index, value in zip(estimate.base.independent, estimate.values, strict=True)
        if parameters[index].symbol in {"Fc", "Fv"}
    ]
    negative = {parameter.joint for value, parameter in friction if value < 0}
    both = {joint for joint in negative if all(value < 0 for value, p in friction if p.joint == joint)}
    if len(both) > estimate.robot.n_v / 2:
        numbers = ", ".join(estimate.robot.joint_names[joint] for joint in sorted(both))
        warnings.warn(
            f"friction is negative on {len(both)} of {estimate.robot.n_v} joints ({numbers}): the torque is probably "
            "logged with the sign reversed; set `sign = -1` in the map's [torque] section",
            TauhatWarning,
            stacklevel=3,
        )
