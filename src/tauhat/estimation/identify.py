"""From recordings to an estimate in one call."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray, read_only
from tauhat.blas import single_threaded
from tauhat.dynamics.base import base_parameters
from tauhat.dynamics.model import TorqueModel
from tauhat.errors import TauhatWarning
from tauhat.estimation.estimate import Estimate, InputLog, input_log
from tauhat.estimation.evidence import Evidence, collect_all
from tauhat.estimation.iterating import iterated
from tauhat.estimation.least_squares import Estimator, WeightedLeastSquares
from tauhat.estimation.physical import consistent
from tauhat.estimation.physical_constraints import PhysicalConstraints
from tauhat.estimation.problem import Problem
from tauhat.estimation.rows import check_recordings
from tauhat.estimation.solution import Solution, joint_residuals
from tauhat.estimation.tuning import tuned
from tauhat.recordings.choice import top_speeds
from tauhat.recordings.processing import Processing, moving_joints
from tauhat.recordings.recording import Recording

_DEAR = 0.02  # share of the residual that constraints may cost before the bound on rotor inertias is looked at
_ROTOR = "Ia"
_SURE = 5.0  # standard errors below zero at which the friction of a single joint surely is negative
_LIKELY = 2.0  # the same where most joints say so; behind a gear no friction is sensed, and its sign is chance
DOUBTFUL_CONDITION = 300.0  # scaled condition number above which a motion does not support its model


@single_threaded
def identify(
    model: TorqueModel,
    recordings: Sequence[Recording],
    *,
    estimator: Estimator | None = None,
    processing: Processing | None = None,
    cutoff: float | None = None,
    constraints: PhysicalConstraints | None = None,
) -> Estimate:
    """Return the model's base parameters identified from recordings, with error bars and provenance.

    Parameters
    ----------
    recordings : of the same robot; each is processed on its own and its evidence merged
    estimator : weighted least squares by default
    processing : all filters; chosen from the recordings by default and kept in the estimate
    cutoff : only the low-pass of torque and columns [Hz]; the rest is chosen
    constraints : what physics allows; the estimate then holds all standard parameters, too. Free by default

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
    check_recordings(model, recordings)
    method = estimator or WeightedLeastSquares()
    settled, settings = tuned(model, recordings, processing=processing, cutoff=cutoff)
    settled = iterated(settled, recordings, settings, method)
    base = base_parameters(settled)
    evidence = collect_all(settled, base, recordings, settings)
    problem = Problem(model=settled, base=base, recordings=tuple(recordings), processing=settings, evidence=evidence)
    return concluded(problem, method, seen_in(recordings), constraints=constraints)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Seen:
    """What an estimate notes of the recordings it was fitted on, and what its warnings are made of.

    inputs : one a recording
    top_speeds : (n_v,) of the joints in all of them [rad/s or m/s]
    moves : (n_v,) whether the joint moves in any of them
    joint_names : of the log
    """

    inputs: tuple[InputLog, ...]
    top_speeds: FloatArray
    moves: NDArray[np.bool_]
    joint_names: tuple[str, ...]

    def __post_init__(self) -> None:
        read_only(self.top_speeds)
        self.moves.setflags(write=False)


def seen_in(recordings: Sequence[Recording]) -> Seen:
    """Return what is noted of recordings."""
    return Seen(
        inputs=tuple(input_log(recording) for recording in recordings),
        top_speeds=top_speeds(recordings),
        moves=np.any([moving_joints(recording) for recording in recordings], axis=0),
        joint_names=recordings[0].joint_names,
    )


def concluded(
    problem: Problem, method: Estimator, seen: Seen, *, constraints: PhysicalConstraints | None = None
) -> Estimate:
    """Return the estimate that a method makes of a problem whose model and processing are settled.

    Warns
    -----
    TauhatWarning
        as `identify`.
    """
    problem = method.settled(problem)
    solution = method.fit_problem(problem)
    _warn_of_still_joints(seen)
    estimate = _estimate(problem, solution, method, seen)
    if constraints is not None:
        estimate = _made_physical(estimate, problem.evidence, solution, constraints)
    warn_of_weak_motion(problem.evidence, solution, estimate)
    _warn_of_negative_friction(estimate, seen)
    return estimate


def _estimate(problem: Problem, solution: Solution, method: Estimator, seen: Seen) -> Estimate:
    kept = {field.name for field in fields(Solution)} & {field.name for field in fields(Estimate)}
    return Estimate(
        model=problem.model,
        base=problem.base,
        processing=problem.processing,
        estimator={"name": method.key, **method.settings()},
        inputs=seen.inputs,
        top_speeds=seen.top_speeds,
        **{name: getattr(solution, name) for name in kept},
    )


def _made_physical(
    estimate: Estimate, evidence: Evidence, solution: Solution, constraints: PhysicalConstraints
) -> Estimate:
    """Return the estimate with the physically consistent parameters that fit best.

    Where the recordings clearly refuse a positive rotor inertia, it is left free: a torque that is measured behind the
    gear, or from which the controller has taken the rotor's share, has none, and the links must not pay for it.

    Warns
    -----
    TauhatWarning
        when that is so.
    """
    model, base, weights = estimate.model, estimate.base, solution.weights
    solved = solution.evidence or evidence
    found, kept = consistent(solved, model, base, weights=weights, constraints=constraints), constraints
    if found.cost > _DEAR and _ROTOR not in constraints.unbounded:
        freed = replace(constraints, unbounded=(*constraints.unbounded, _ROTOR))
        freer = consistent(solved, model, base, weights=weights, constraints=freed)
        if freer.cost < 0.5 * found.cost:
            warnings.warn(
                f"rotor inertias of at least zero cost {100 * found.cost:.0f} % of the residual, without that bound "
                f"{100 * freer.cost:.1f} %: it is not kept; the torque lacks the rotors' share (measured "
                "behind the gear, or compensated by the controller)",
                TauhatWarning,
                stacklevel=5,
            )
            found, kept = freer, freed
    return replace(
        estimate,
        values=found.values,
        joint_rms=joint_residuals(evidence, found.values),
        standard=found.standard,
        physical=found.report(kept),
    )


def warn_of_weak_motion(evidence: Evidence, solution: Solution, estimate: Estimate) -> None:
    """Warn when rank is lost or the scaled condition number says that the motion cannot tell the parameters apart."""
    if solution.rank < np.count_nonzero(np.diag(solution.covariance)):
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
            "motion and may be far off on another: record a richer one, give more recordings, or identify with "
            "physical constraints (--physical)",
            TauhatWarning,
            stacklevel=3,
        )


def _warn_of_still_joints(seen: Seen) -> None:
    """Warn of joints that only flicker: columns of noise look well conditioned and make parameters of nothing."""
    if not seen.moves.all():
        still = [name for name, moved in zip(seen.joint_names, seen.moves, strict=True) if not moved]
        warnings.warn(
            f"no motion of {', '.join(still)} in any recording: friction and rotor inertia there are fitted to encoder "
            "noise and predict nothing; record a motion that moves every joint, or lock those that stand still",
            TauhatWarning,
            stacklevel=4,
        )


def _warn_of_negative_friction(estimate: Estimate, seen: Seen) -> None:
    """Warn when friction likely drives most joints, or single ones surely, at a fifth and three fifths of top speed."""
    speeds, n_v = np.maximum(seen.top_speeds, np.finfo(float).tiny), estimate.robot.n_v
    levels = [estimate.friction(part * speeds) for part in (0.2, 0.6)]
    negative = np.all([level.torque < -_LIKELY * level.standard_errors for level in levels], axis=0)
    surely = np.all([level.torque < -_SURE * level.standard_errors for level in levels], axis=0)
    most = bool(negative.sum() > n_v / 2)
    joints = np.flatnonzero(negative if most else surely)
    if joints.size:
        names = ", ".join(estimate.robot.joint_names[joint] for joint in joints)
        remedy = "set `sign = -1`" if most else "`sign` takes one value a joint"
        warnings.warn(
            f"friction is negative on {joints.size} of {n_v} joints ({names}): the torque is "
            f"probably logged with the sign reversed; {remedy} in the map's [torque] section",
            TauhatWarning,
            stacklevel=4,
        )
