"""What a whole rehearsal found: logs, models, proofs and the error budget, as the chapters read them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tauhat.dynamics.model import torque_model
from tauhat.errors import TauhatError
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.estimators import estimator_named
from tauhat.estimation.identify import identify
from tauhat.recordings.recording import Recording
from tauhat.simulation.experiment import Simulation
from tauhat.studies.gain_tuning import TunedGains
from tauhat.studies.whole_rehearsal.scene import UNSEEN, MotionName, Scene
from tauhat.verification.error_budget import BudgetSettings, ErrorBudget
from tauhat.verification.known_payload import PayloadCheck
from tauhat.verification.motion_tracking import TrackingComparison
from tauhat.verification.prediction import LogPrediction, Verification, verify
from tauhat.verification.residual_tests import LogResiduals, residual_tests
from tauhat.verification.static import StaticCheck
from tauhat.verification.truth import TruthComparison, compare_with_truth

SEARCHED: MotionName = "task path"  # the unseen motion whose residual is searched for missing effects
JUDGED: tuple[MotionName, ...] = tuple(name for name in UNSEEN if name != SEARCHED)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Models:
    """The model that was chosen before, and the one with what its residuals name.

    first : estimate with the terms that were asked for
    verified : the first on the unseen motions, in the order of `UNSEEN`
    residuals : what the first leaves on the searched one
    named : terms that are named there and that the first lacks
    final, final_verified, final_truth : the second model, and its errors against logs and against the true torque; the
        first where nothing with a term was named, or where the second is not taken
    failure : why the model with the named terms is not taken; empty otherwise
    """

    first: Estimate
    verified: Verification
    residuals: LogResiduals
    named: tuple[str, ...]
    final: Estimate
    final_verified: Verification
    final_truth: tuple[TruthComparison, ...]
    failure: str = ""

    @property
    def added(self) -> tuple[str, ...]:
        """Terms that the final model has and the first has not."""
        return () if self.failure else self.named

    def log(self, name: MotionName) -> LogPrediction:
        """Return the final model's prediction of an unseen motion."""
        return self.final_verified.logs[UNSEEN.index(name)]


class Pooled(NamedTuple):
    """Errors over the unseen motions that were not searched, all joints stacked, parts of the torque."""

    first: float
    final: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Findings:
    """Everything that the chapters tell of.

    fitted, unseen : logs with their truth; the unseen ones in the order of `UNSEEN`
    budget_settings, budget : of the error
    """

    scene: Scene
    fitted: Simulation
    unseen: tuple[Simulation, ...]
    models: Models
    tracking: TrackingComparison
    tuning: TunedGains
    static: StaticCheck
    payload: PayloadCheck
    budget_settings: BudgetSettings
    budget: ErrorBudget

    @property
    def pooled(self) -> Pooled:
        """Errors of both models on the unseen motions that were not searched."""
        both = (self.models.verified, self.models.final_verified)
        return Pooled(*(pooled([log.logs[UNSEEN.index(name)] for name in JUDGED]) for log in both))

    @property
    def bend(self) -> tuple[float, ...]:
        """Root mean square of what each joint bends by on the task path [rad or m]; motors' encoders do not see it."""
        truth = self.unseen[UNSEEN.index("task path")].truth
        return tuple(np.sqrt(np.mean((truth.motor_q - truth.q) ** 2, axis=0)).tolist())

    def tracked(self, name: str) -> float:
        """Return the norm over the joints of a controller's tracking error [rad or m]."""
        return float(np.linalg.norm(self.tracking.run(name).rms))


def modelled(scene: Scene, fitted: Recording, unseen: tuple[Simulation, ...], *, terms: str, estimator: str) -> Models:
    """Return the identified model, what its residuals name, and the model with it.

    Raises
    ------
    EstimateError
        when the log does not identify the first model.
    """
    method, logs = estimator_named(estimator), [done.recording for done in unseen]
    first = identify(torque_model(scene.robot, terms), [fitted], estimator=method)
    verified = verify(first, logs)
    (residuals,) = residual_tests(first, [logs[UNSEEN.index(SEARCHED)]])
    known = [term.key for term in first.model.terms]
    named = [term for joint in residuals.joints for effect in joint.missing for term in _terms(effect.term)]
    added = tuple(term for term in dict.fromkeys(named) if term not in known)
    final, final_verified, failure = first, verified, ""
    if added:
        try:
            final = identify(torque_model(scene.robot, [*known, *added]), [fitted], estimator=method)
            final_verified = verify(final, logs)
            failure = _worse(verified, final_verified)
        except TauhatError as error:
            failure = f"it could not be identified: {error}"
    if failure:
        final, final_verified = first, verified
    return Models(
        first=first,
        verified=verified,
        residuals=residuals,
        named=added,
        final=final,
        final_verified=final_verified,
        final_truth=tuple(compare_with_truth(final, done.truth) for done in unseen),
        failure=failure,
    )


def _worse(first: Verification, second: Verification) -> str:
    """Return why the second model is not taken, from the log that was searched anyway; empty where it is better."""
    before, after = (verified.logs[UNSEEN.index(SEARCHED)].relative_rms for verified in (first, second))
    if after < before:
        return ""
    return f"on the {SEARCHED} it is off by {100 * after:.3g} %, the model without them by {100 * before:.3g} %"


def _terms(listed: str) -> list[str]:
    return [term.strip() for term in listed.split(",") if term.strip()]


def pooled(logs: list[LogPrediction]) -> float:
    """Return the norm of the error over that of the torque, all joints of all logs stacked."""
    error = np.sqrt(sum(float(np.sum((log.tau - log.predicted) ** 2)) for log in logs))
    return float(error / np.sqrt(sum(float(np.sum(log.tau**2)) for log in logs)))
