"""One piece of work of the study: a case and a model, its logs read once, all estimators fitted and judged."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from tauhat.dynamics.model import torque_model
from tauhat.errors import TauhatError, TauhatWarning
from tauhat.estimation.estimators import estimator_named
from tauhat.recordings.recording import Recording
from tauhat.robots.fitting import check_joint_order, fit_to_joints
from tauhat.robots.library import load_robot
from tauhat.robots.robot import Robot
from tauhat.studies.bad_ends import bad_end
from tauhat.studies.comparison import Candidate, Outcome, candidate_named, compare
from tauhat.studies.real_logs.case_file import RealCase

USELESS = 1.0  # error over torque from which a model predicts no better than no torque at all
_WARM_ROBOT, _WARM_TERMS = "two_link", "inertia,viscous,coulomb"  # of the fits before the first that is timed


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """A case, a model and the estimators, by name, that are fitted with it."""

    case: RealCase
    model: str
    estimators: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseFit:
    """What one model and estimator made of one case.

    case : its name
    outcome : errors, passes, time; or its failure
    doubt : why the method says itself that it did not end well; empty where it did
    """

    case: str
    outcome: Outcome
    doubt: str = ""

    @property
    def pair(self) -> tuple[str, str]:
        """Model and estimator."""
        return self.outcome.model, self.outcome.estimator

    @property
    def error(self) -> float:
        """Mean over the judged logs of error over torque; infinite where there is none."""
        return self.outcome.mean_unseen

    @property
    def loss(self) -> str:
        """Why this fit is not counted as a good one; empty where it is."""
        if self.outcome.failure or self.doubt:
            return self.outcome.failure or self.doubt
        useful = self.error < USELESS
        return "" if useful else f"error of {100 * self.error:.3g} % of the torque: worse than no model"


def fits_of(piece: Piece) -> tuple[CaseFit, ...]:
    """Return what every estimator makes of a case; an error is a result like any other."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)  # those of the fits are in their outcomes
        _warm_up(piece.estimators)
        return tuple(_fit(piece.case.name, outcome) for outcome in _outcomes(piece))


def _outcomes(piece: Piece) -> Sequence[Outcome]:
    case = piece.case
    try:
        fitted = [source.read() for source in case.fit]
        judged = [source.read() for source in case.judge]
        robot = _robot(case, (*fitted, *judged))
        candidates = [candidate_named(robot, piece.model, key, recordings=fitted) for key in piece.estimators]
    except TauhatError as error:
        return [Outcome(model=piece.model, estimator=key, failure=str(error)) for key in piece.estimators]
    return compare(candidates, fitted, judged, cutoff=case.cutoff).outcomes


def _robot(case: RealCase, recordings: Sequence[Recording]) -> Robot:
    """Return the case's robot with the joints that its logs have."""
    robot = fit_to_joints(load_robot(case.robot), recordings[0].joint_names, where=recordings[0].name)
    for recording in recordings:
        check_joint_order(robot, recording.joint_names, where=recording.name)
    return robot


def _fit(case: str, outcome: Outcome) -> CaseFit:
    cause = bad_end(estimator_named(outcome.estimator), cause=outcome.cause, advice=outcome.advice)
    return CaseFit(case=case, outcome=outcome, doubt=f"{cause}; {outcome.advice}" if cause else "")


@cache
def _warm_up(keys: tuple[str, ...]) -> None:
    """Fit each estimator once in this process: the first call loads compiled code, which is none of its cost."""
    robot = load_robot(_WARM_ROBOT)
    t = np.arange(0.0, 2.0, 0.004)
    q = np.column_stack([np.sin(3.0 * t) + 0.3 * np.sin(8.0 * t), np.cos(4.0 * t) + 0.3 * np.sin(7.0 * t)])
    tau = np.column_stack([np.cos(q[:, 0]), np.cos(q.sum(axis=1))]) + 0.01 * np.sin(np.outer(t, (50.0, 70.0)))
    model = torque_model(robot, _WARM_TERMS)
    log = Recording(t=t, q=q, tau=tau, joint_names=robot.joint_names)
    candidates = [Candidate(name="", model=model, estimator=estimator_named(key)) for key in keys]
    compare(candidates, [log], [log], cutoff=10.0)
