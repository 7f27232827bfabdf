"""Models and estimators beside each other: fitted on the same recordings, judged on the same unseen ones."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.named_model import AUTO, named_model
from tauhat.errors import ModelError, TauhatError, TauhatWarning
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.estimators import estimator_named
from tauhat.estimation.identify import identify
from tauhat.estimation.least_squares import Estimator
from tauhat.estimation.physical_constraints import PhysicalConstraints
from tauhat.estimation.selecting import identify_selected
from tauhat.recordings.recording import Recording
from tauhat.robots.robot import Robot
from tauhat.verification.prediction import verify

PHYSICAL = "+physical"
"""Behind the name of a model: with physical constraints."""


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


def candidate_named(robot: Robot, model: str, estimator: str, *, recordings: Sequence[Recording]) -> Candidate:
    """Return the candidate that people name: a model as `named_model` takes it, and an estimator.

    Parameters
    ----------
    model : with `+physical` behind it, physical constraints hold; `auto` is the choice by cross-validation
    recordings : that are fitted; what their maps say of motors that turn with two joints belongs to the model

    Raises
    ------
    ModelError
        a model or an estimator that is unknown or does not fit the robot.
    """
    name = model.strip()
    terms = name.removesuffix(PHYSICAL)
    shared = [motor for recording in recordings for motor in recording.shared_motors]
    return Candidate(
        name=name,
        model=named_model(robot, terms, shared_motors=shared),
        estimator=estimator_named(estimator),
        selected=terms == AUTO,
        constraints=PhysicalConstraints() if name.endswith(PHYSICAL) else None,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What became of one candidate.

    fit : residual over torque on the fitted recordings
    unseen : of each judged recording, error over torque
    moving : of each judged recording, the same over the rows in which the robot moves
    joints : of each judged recording, the same joint by joint
    n_parameters, condition : of the model
    passes : how often the problem was solved
    cause, advice : why the method stopped, and what to do about it
    seconds, processor_seconds : that identification took
    warnings : what it warned of
    failure : why there is no estimate; empty when there is
    fitted_to : which recordings it was identified from, where there are several sets of them
    """

    model: str
    estimator: str
    fit: float = np.inf
    unseen: tuple[float, ...] = ()
    moving: tuple[float, ...] = ()
    joints: tuple[tuple[float, ...], ...] = ()
    n_parameters: int = 0
    condition: float = np.inf
    passes: int = 0
    cause: str = ""
    advice: str = ""
    seconds: float = 0.0
    processor_seconds: float = 0.0
    warnings: tuple[str, ...] = ()
    failure: str = ""
    fitted_to: str = ""

    @property
    def name(self) -> str:
        """How reports call it: model, estimator, and what it was fitted to."""
        return ", ".join(part for part in (self.model, self.estimator, self.fitted_to) if part)

    @property
    def mean_unseen(self) -> float:
        """Mean of the unseen errors; infinite where there is none."""
        return float(np.mean(self.unseen)) if self.unseen else np.inf

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "model": self.model,
            "estimator": self.estimator,
            "fitted_to": self.fitted_to,
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
            "best": None
            if best is None
            else {"model": best.model, "estimator": best.estimator, "fitted_to": best.fitted_to},
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
    return compare_sets([FittedSet(recordings=fitted, candidates=candidates)], judged, cutoff=cutoff, tell=tell)


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedSet:
    """Recordings, and who is fitted to them.

    name : what outcomes call the recordings; empty where there are no others
    """

    name: str = ""
    recordings: Sequence[Recording]
    candidates: Sequence[Candidate]


def compare_sets(
    sets: Sequence[FittedSet],
    judged: Sequence[Recording],
    *,
    cutoff: float | None = None,
    tell: Callable[[str], None] = lambda _: None,
) -> Comparison:
    """Return `compare` for several sets of recordings that are fitted, all with the low-pass of the first.

    Raises
    ------
    ModelError
        when there is no candidate or no recording to judge on.
    """
    pairs = [(one, candidate) for one in sets for candidate in one.candidates]
    if not pairs or not judged:
        raise ModelError("a comparison needs a model, an estimator and a recording that is not fitted")
    outcomes: list[Outcome] = []
    shared = cutoff
    for one, candidate in pairs:
        tell(", ".join(part for part in (candidate.name, candidate.estimator.key, one.name) if part))
        outcome, used = _outcome(candidate, one.recordings, judged, shared)
        shared = shared or used
        outcomes.append(replace(outcome, fitted_to=one.name))
    return Comparison(
        fitted=tuple(dict.fromkeys(recording.name for one in sets for recording in one.recordings)),
        judged=tuple(recording.name for recording in judged),
        joint_names=pairs[0][1].model.robot.joint_names,
        outcomes=tuple(outcomes),
    )


def _outcome(
    candidate: Candidate, fitted: Sequence[Recording], judged: Sequence[Recording], cutoff: float | None
) -> tuple[Outcome, float | None]:
    """Return the outcome and the cut-off that was used."""
    started, worked = time.perf_counter(), time.process_time()
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", TauhatWarning)
            estimate = _identified(candidate, fitted, cutoff)
        seconds, processor_seconds = time.perf_counter() - started, time.process_time() - worked
        logs = verify(estimate, judged).logs
    except TauhatError as error:
        return Outcome(model=candidate.name, estimator=candidate.estimator.key, failure=str(error)), cutoff
    outcome = Outcome(
        model=candidate.name,
        estimator=candidate.estimator.key,
        fit=estimate.relative_rms,
        unseen=tuple(log.relative_rms for log in logs),
        moving=tuple(log.moving_relative_rms for log in logs),
        joints=tuple(tuple(joint.relative_rms for joint in log.joints) for log in logs),
        n_parameters=estimate.n_fitted,
        condition=estimate.condition,
        passes=estimate.passes,
        cause=estimate.cause,
        advice=estimate.advice,
        seconds=seconds,
        processor_seconds=processor_seconds,
        warnings=tuple(str(w.message) for w in caught if issubclass(w.category, TauhatWarning)),
    )
    return outcome, estimate.processing.cutoff


def _identified(candidate: Candidate, fitted: Sequence[Recording], cutoff: float | None) -> Estimate:
    way = identify_selected if candidate.selected else identify
    return way(candidate.model, fitted, estimator=candidate.estimator, cutoff=cutoff, constraints=candidate.constraints)
