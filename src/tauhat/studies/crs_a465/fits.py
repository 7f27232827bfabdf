"""What is done for one random arm of the CRS A465 study: every condition, model and method, and motions of all lengths.

The pieces of work know nothing of each other; each is a settings object that travels to a worker, and what comes back
are a few arrays of figures.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from tauhat.arrays import FloatArray
from tauhat.errors import ModelError, RecordingError
from tauhat.estimation import (
    CauchyLeastSquares,
    Estimator,
    HuberLeastSquares,
    OrdinaryLeastSquares,
    Solution,
    WeightedLeastSquares,
)
from tauhat.estimation.evidence import Evidence, evidence_from_rows
from tauhat.estimation.problem import Problem
from tauhat.estimation.rows import Rows, filtered_rows
from tauhat.estimation.solution import rank_and_condition, stacked
from tauhat.excitation import MotionSamples
from tauhat.recordings import Recording
from tauhat.simulation import TrueParameters
from tauhat.studies.crs_a465.coordinates import coordinates
from tauhat.studies.crs_a465.experiment import (
    CONDITIONS,
    PROCESSING,
    TERMS,
    Experiment,
    Identifiable,
    fitted_motion,
    identifiable,
    recorded,
    spoiled,
    true_arm,
    unseen_motion,
)

METHODS: Mapping[str, Estimator] = {
    "ols": OrdinaryLeastSquares(),
    "wls": WeightedLeastSquares(power=1.0),
    "irls": CauchyLeastSquares(power=1.0),
    "irls-huber": HuberLeastSquares(power=1.0),
}
LONG_CONDITION, LONG_METHOD = "unequal", "wls"  # what motions of all lengths are compared with
CONFIDENCE = 0.95
_SEED = 20261124


class Case(NamedTuple):
    """What is compared: a condition of the log, a model and a method."""

    condition: str
    model: str
    method: str


CASES = tuple(Case(condition, model, method) for condition in CONDITIONS for model in TERMS for method in METHODS)


class FitFigures(NamedTuple):
    """What became of one fit.

    joints : (n_v,) error of the torque on the unseen motion over that torque
    torque : the same, all joints stacked
    values, deviations : (n_c,) barycentric parameters and their standard errors
    misses : (n_b,) error of the model's own base parameters in standard errors
    inside : (n_b,) whether the truth lies in their 95 % intervals
    """

    joints: FloatArray
    torque: float
    values: FloatArray
    deviations: FloatArray
    misses: FloatArray
    inside: FloatArray


class Conditions(NamedTuple):
    """Condition number of the stacked regressor as it is, and with columns of unit norm."""

    plain: float
    scaled: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ArmFigures:
    """What one random arm showed.

    true_values : (n_c,) barycentric parameters
    effects : (n_c,) RMS torque that one unit of each causes on the fitted motion, all joints together [Nm a unit]
    torque_rms : (n_v,) of the fitted motion [Nm]
    conditions : of each model, on the fitted motion
    fits : of every case
    exact : of each model, least squares on a log without any noise
    lengths : (n_models, n_lengths) error of the torque on the unseen motion after a fitted motion of each length
    """

    true_values: FloatArray
    effects: FloatArray
    torque_rms: FloatArray
    conditions: Mapping[str, Conditions]
    fits: Mapping[Case, FitFigures]
    exact: Mapping[str, FitFigures]
    lengths: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class ArmPiece:
    """The work on one random arm.

    lengths : of the fitted motions that are compared [s]
    """

    experiment: Experiment
    seed: int
    lengths: tuple[float, ...]

    def done(self) -> ArmFigures:
        """Return what the arm showed."""
        rng = np.random.default_rng([_SEED, self.seed])
        truth = true_arm(self.experiment, rng)
        seconds = max(self.experiment.seconds, *self.lengths)
        whole = fitted_motion(self.experiment, rng, seconds=seconds)
        judge = judge_of(truth, unseen_motion(self.experiment, rng))
        columns = identifiable("full").regressor(whole)
        tau = columns @ identifiable("full").true_values(truth)
        robot = identifiable("full").model.robot
        log = recorded(whole, tau, robot=robot, name=f"arm {self.seed}")
        usual = first_seconds(log, self.experiment.seconds)
        exact = {name: prepared(identifiable(name), usual) for name in TERMS}
        effects = columns[: usual.n_t] @ coordinates().to_full
        return ArmFigures(
            true_values=coordinates().from_base["full"] @ identifiable("full").true_values(truth),
            effects=np.sqrt(np.mean(np.sum(effects**2, axis=1), axis=0)),
            torque_rms=np.sqrt(np.mean(tau[: usual.n_t] ** 2, axis=0)),
            conditions={name: conditions_of(problem.evidence) for name, problem in exact.items()},
            fits=self._fits(usual, judge, rng),
            exact={name: judge.figures(name, solved(problem, "ols")) for name, problem in exact.items()},
            lengths=self._lengths(log, judge, rng),
        )

    def _fits(self, log: Recording, judge: Judge, rng: np.random.Generator) -> dict[Case, FitFigures]:
        fits: dict[Case, FitFigures] = {}
        for condition in CONDITIONS:
            shown = spoiled(log, condition, self.experiment, rng)
            for name in TERMS:
                problem = prepared(identifiable(name), shown)
                found = {method: judge.figures(name, solved(problem, method)) for method in METHODS}
                fits |= {Case(condition, name, method): figures for method, figures in found.items()}
        return fits

    def _lengths(self, log: Recording, judge: Judge, rng: np.random.Generator) -> FloatArray:
        shown = spoiled(log, LONG_CONDITION, self.experiment, rng)
        return np.array([[judge.error_after(name, shown, seconds) for seconds in self.lengths] for name in TERMS])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Judge:
    """Compares solutions with the truth of one arm.

    truth : of the arm
    columns : (n_t, n_v, n_c) of the barycentric parameters on the unseen motion
    tau : (n_t, n_v) true torque there [Nm]
    """

    truth: TrueParameters
    columns: FloatArray
    tau: FloatArray

    def figures(self, name: str, solution: Solution) -> FitFigures:
        """Return what a solution of the named model is worth."""
        own, turn = identifiable(name), coordinates().from_base[name]
        values = turn @ solution.values
        error = self.columns @ values - self.tau
        missed = solution.values - own.true_values(self.truth)
        deviations = np.sqrt(np.diag(solution.covariance))
        half = float(stdtrit(solution.degrees, 0.5 + 0.5 * CONFIDENCE)) * deviations
        return FitFigures(
            joints=np.linalg.norm(error, axis=0) / np.linalg.norm(self.tau, axis=0),
            torque=float(np.linalg.norm(error) / np.linalg.norm(self.tau)),
            values=values,
            deviations=np.sqrt(np.einsum("jk,kl,jl->j", turn, solution.covariance, turn)),
            misses=missed / np.maximum(deviations, np.finfo(float).tiny),
            inside=np.asarray(np.abs(missed) <= half, dtype=np.float64),
        )

    def error_after(self, name: str, log: Recording, seconds: float) -> float:
        """Return the error on the unseen motion after the begin of a log; infinite where that is too short."""
        try:
            solution = solved(prepared(identifiable(name), first_seconds(log, seconds)), LONG_METHOD)
        except (ModelError, RecordingError):
            return np.inf
        return self.figures(name, solution).torque


def judge_of(truth: TrueParameters, unseen: MotionSamples) -> Judge:
    """Return the judge of an arm on a motion that it does not learn from."""
    full = identifiable("full")
    regressor = full.regressor(unseen)
    return Judge(truth=truth, columns=regressor @ coordinates().to_full, tau=regressor @ full.true_values(truth))


def prepared(own: Identifiable, log: Recording) -> Problem:
    """Return the problem of a log and a model, its rows made once for all methods."""
    layout = own.model.layout(own.base.independent)
    pieces = list(filtered_rows(own.model, layout, log, PROCESSING))
    if not pieces:
        raise ModelError("no row of the log is left to identify from", where=log.name)
    rows = Rows(*(np.concatenate(parts, axis=-1) for parts in zip(*pieces, strict=True)))
    return Problem(
        model=own.model,
        base=own.base,
        recordings=(log,),
        processing=PROCESSING,
        evidence=evidence_from_rows(layout, own.base, [rows]),
        kept=(rows,),
    )


def solved(problem: Problem, method: str) -> Solution:
    """Return the solution by a method; the shapes of friction are given, so none has to be unsure of them."""
    estimator = METHODS[method]
    if isinstance(estimator, OrdinaryLeastSquares | WeightedLeastSquares):
        return estimator.fit(problem.evidence)
    return estimator.fit_problem(problem)


def first_seconds(log: Recording, seconds: float) -> Recording:
    """Return the begin of a log."""
    return log.rows(0, int(np.searchsorted(log.t, log.t[0] + seconds)))


def conditions_of(evidence: Evidence) -> Conditions:
    """Return the condition numbers of the regressor, every joint's equation in newton metres."""
    alike = np.ones(evidence.n_v)
    matrix, _ = stacked(evidence, evidence.total, alike)
    return Conditions(float(np.linalg.cond(matrix)), rank_and_condition(evidence, alike)[1])
