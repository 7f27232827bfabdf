"""Models and estimators beside each other: fitted on the same recordings, judged on the same unseen ones."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tauhat.dynamics.model import TorqueModel
from tauhat.errors import ModelError, TauhatError, TauhatWarning
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.identify import identify
from tauhat.estimation.least_squares import Estimator
from tauhat.estimation.physical_constraints import PhysicalConstraints
from tauhat.estimation.selecting import identify_selected
from tauhat.recordings.recording import Recording
from tauhat.verification.prediction import verify


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """One way to identify.

    name : of the model, as reports call it
    model : terms
    estimator : method
    selected : whether terms are added and dropped by cross-validation
    constraints : what physics allows; free by default
    """

    name: str
    model: TorqueModel
    estimator: Estimator
    selected: bool = False
    constraints: PhysicalConstraints | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What became of one candidate.

    fit : residual over torque on the fitted recordings
    unseen : of each judged recording, error over torque
    joints : of each judged recording, the same joint by joint
    n_parameters, condition : of the model
    seconds : that identification took
    warnings : what it warned of
    failure : why there is no estimate; empty when there is
    """

    model: str
    estimator: str
    fit: float = np.inf
    unseen: tuple[float, ...] = ()
    joints: tuple[tuple[float, ...], ...] = ()
    n_parameters: int = 0
    condition: float = np.inf
    seconds: float = 0.0
    warnings: tuple[str, ...] = ()
    failure: str = ""

    @property
    def mean_unseen(self) -> float:
        """Mean of the unseen errors; infinite where there is none."""
        return float(np.mean(self.unseen)) if self.unseen else np.inf

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "model": self.model,
            "estimator": self.estimator,
            "fit": self.fit if np.isfinite(self.fit) else None,
            "unseen": list(self.unseen),
            "joints": [list(joints) for joints in self.joints],
            "n_parameters": self.n_parameters,
            "condition": self.condition if np.isfinite(self.condition) else None,
            "seconds": self.seconds,
            "warnings": list(self.warnings),
            "failure": self.failure,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """The outcomes in the order of the candidates.

    fitted, judged : names of the recordings
    """

    fitted: tuple[str, ...]
    judged: tuple[str, ...]
    joint_names: tuple[str, ...]
    outcomes: tuple[Outcome, ...]

    @property
    def best(self) -> Outcome | None:
        """The outcome of the least mean error on unseen recordings; None when all failed."""
        return min((o for o in self.outcomes if not o.failure), key=lambda outcome: outcome.mean_unseen, default=None)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        best = self.best
        return {
            "fitted": list(self.fitted),
            "judged": list(self.judged),
            "outcomes": [outcome.to_dict() for outcome in self.outcomes],
            "best": None if best is None else {"model": best.model, "estimator": best.estimator},
        }


def compare(
    candidates: Sequence[Candidate],
    fitted: Sequence[Recording],
    judged: Sequence[Recording],
    *,
    cutoff: float | None = None,
    tell: Callable[[str], None] = lambda _: None,
) -> Comparison:
    """Return how every candidate predicts recordings that it did not see; one that fails does not stop the others.

    Parameters
    ----------
    fitted : recordings that every candidate is identified from
    judged : recordings of other motions
    cutoff : low-pass of all fits [Hz]; errors of different cut-offs could not be compared. Chosen by the first
        candidate by default
    tell : called with each candidate's name as it begins

    Raises
    ------
    ModelError
        when there is no candidate or no recording to judge on.
    """
    if not candidates or not judged:
        raise ModelError("a comparison needs a model, an estimator and a recording that is not fitted")
    outcomes: list[Outcome] = []
    shared = cutoff
    for candidate in candidates:
        tell(f"{candidate.name}, {candidate.estimator.key}")
        outcome, used = _outcome(candidate, fitted, judged, shared)
        shared = shared or used
        outcomes.append(outcome)
    return Comparison(
        fitted=tuple(recording.name for recording in fitted),
        judged=tuple(recording.name for recording in judged),
        joint_names=candidates[0].model.robot.joint_names,
        outcomes=tuple(outcomes),
    )


def _outcome(
    candidate: Candidate, fitted: Sequence[Recording], judged: Sequence[Recording], cutoff: float | None
) -> tuple[Outcome, float | None]:
    """Return the outcome and the cut-off that was used."""
    started = time.perf_counter()
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", TauhatWarning)
            estimate = _identified(candidate, fitted, cutoff)
        seconds = time.perf_counter() - started
        logs = verify(estimate, judged).logs
    except TauhatError as error:
        return Outcome(model=candidate.name, estimator=candidate.estimator.key, failure=str(error)), cutoff
    outcome = Outcome(
        model=candidate.name,
        estimator=candidate.estimator.key,
        fit=estimate.relative_rms,
        unseen=tuple(log.relative_rms for log in logs),
        joints=tuple(tuple(joint.relative_rms for joint in log.joints) for log in logs),
        n_parameters=estimate.n_fitted,
        condition=estimate.condition,
        seconds=seconds,
        warnings=tuple(str(w.message) for w in caught if issubclass(w.category, TauhatWarning)),
    )
    return outcome, estimate.processing.cutoff


def _identified(candidate: Candidate, fitted: Sequence[Recording], cutoff: float | None) -> Estimate:
    way = identify_selected if candidate.selected else identify
    return way(candidate.model, fitted, estimator=candidate.estimator, cutoff=cutoff, constraints=candidate.constraints)
