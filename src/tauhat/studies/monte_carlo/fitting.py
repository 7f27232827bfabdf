"""One piece of work of the study: the data of one case made once, all its estimators fitted to them."""

from __future__ import annotations

import time
import warnings
from dataclasses import dataclass, replace
from functools import cache
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.blas import single_threaded
from tauhat.errors import TauhatError, TauhatWarning
from tauhat.estimation.closed_loop import ClosedLoop
from tauhat.estimation.estimators import estimator_named
from tauhat.estimation.least_squares import Estimator
from tauhat.estimation.output_error import OutputError
from tauhat.estimation.problem import Problem
from tauhat.estimation.simulating import SimulationEstimator
from tauhat.estimation.solution import Solution
from tauhat.studies.bad_ends import bad_end
from tauhat.studies.monte_carlo.experiment import Disturbance, Experiment, experiment_of, logged, problem_of
from tauhat.studies.monte_carlo.measures import column_sizes, model_torque, relative_error

CONFIDENCE = 0.95
_WARM_ROBOT, _WARM_SECONDS = "two_link", 2.0  # of the fits before the first that is timed


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One log, and what is fitted to it.

    robot : what `load_robot` takes
    noise : name of the level, in parts of the usual noise
    disturbance : what that is
    seconds : duration of the motion [s]
    estimators : by name
    """

    robot: str
    noise: float
    disturbance: Disturbance
    seed: int
    seconds: float
    estimators: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """What one estimator made of one case.

    parameter_error : `relative_error` of the base parameters; nan where it failed
    torque_error : norm of the torque's error over the torque, all joints stacked, on the unseen motion
    errors : of every base parameter, in what it does to the torque of the unseen motion
    inside : share of the 95 % intervals that hold the truth
    passes : how often the problem was solved
    seconds : of processor time that the fit took
    condition : number of the scaled regressor
    n_parameters : base parameters
    cause : why it ended
    doubt : the cause again, where the method itself says that this is no good end
    failure : the error that it raised; empty when there was none
    """

    robot: str
    noise: float
    rate: float
    seed: int
    estimator: str
    parameter_error: float = np.nan
    torque_error: float = np.nan
    errors: tuple[float, ...] = ()
    inside: float = np.nan
    passes: int = 0
    seconds: float = 0.0
    condition: float = np.nan
    n_parameters: int = 0
    cause: str = ""
    doubt: str = ""
    failure: str = ""


@single_threaded
def fits_of(case: Case) -> tuple[Fit, ...]:
    """Return what every estimator makes of a case; an error is a result like any other."""
    _warm_up(case.estimators)
    blank = Fit(robot=case.robot, noise=case.noise, rate=case.disturbance.rate, seed=case.seed, estimator="")
    experiment = experiment_of(case.robot, seed=case.seed, seconds=case.seconds)
    try:
        problem = problem_of(experiment.model, logged(experiment, case.disturbance, seed=case.seed))
    except TauhatError as error:
        return tuple(replace(blank, estimator=key, failure=str(error)) for key in case.estimators)
    return tuple(_fit(replace(blank, estimator=key), experiment, problem) for key in case.estimators)


class _Solved(NamedTuple):
    """A solution, by what, of which problem (shapes may be the estimator's own), and its processor time [s]."""

    method: Estimator
    problem: Problem
    solution: Solution
    seconds: float


def _fit(blank: Fit, experiment: Experiment, problem: Problem) -> Fit:
    begun = time.process_time()
    try:
        found = _solved(method_of(blank.estimator, experiment.loop), problem)
    except TauhatError as error:
        return replace(blank, failure=str(error), seconds=time.process_time() - begun)
    return _judged(blank, experiment, found)


def _solved(method: Estimator, problem: Problem) -> _Solved:
    begun = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)  # what they say is in the figures
        settled = method.settled(problem)
        solution = method.fit_problem(settled)
    return _Solved(method, settled, solution, time.process_time() - begun)


def method_of(key: str, loop: ClosedLoop) -> Estimator:
    """Return the estimator of this name in its default settings; one that simulates knows the robot's law."""
    method = estimator_named(key)
    if isinstance(method, OutputError):
        return replace(method, loop=loop, threads=1)  # the other cores belong to other cases
    return replace(method, loop=loop) if isinstance(method, SimulationEstimator) else method


def _judged(blank: Fit, experiment: Experiment, found: _Solved) -> Fit:
    model, base, values = found.problem.model, found.problem.base, found.solution.values
    motion = experiment.unseen
    truth = base.projection @ experiment.standard
    exact = model_torque(experiment.model, experiment.standard, motion)
    standard = np.zeros(model.n_p)
    standard[base.independent] = values
    sizes = column_sizes(model, base, motion, exact)
    return replace(
        blank,
        parameter_error=relative_error(values, truth, sizes),
        errors=tuple((sizes * (values - truth)).tolist()),
        torque_error=float(np.linalg.norm(model_torque(model, standard, motion) - exact) / np.linalg.norm(exact)),
        inside=float(np.mean(np.abs(values - truth) <= _half_intervals(found.solution))),
        passes=found.solution.passes,
        seconds=found.seconds,
        condition=found.solution.condition,
        n_parameters=base.n_b,
        cause=found.solution.cause,
        doubt=bad_end(found.method, cause=found.solution.cause, advice=found.solution.advice),
    )


def _half_intervals(solution: Solution) -> FloatArray:
    from scipy.special import stdtrit

    quantile = float(stdtrit(solution.degrees, 0.5 + 0.5 * CONFIDENCE))
    return np.asarray(quantile * np.sqrt(np.diag(solution.covariance)))


@cache
def _warm_up(keys: tuple[str, ...]) -> None:
    """Fit each estimator once in this process: the first call loads compiled code, which is none of its cost."""
    experiment = experiment_of(_WARM_ROBOT, seed=0, seconds=_WARM_SECONDS)
    disturbance = Disturbance(position=1e-5, torque=0.01, rate=500.0)
    problem = problem_of(experiment.model, logged(experiment, disturbance, seed=0))
    for key in keys:
        _fit(Fit(robot=_WARM_ROBOT, noise=0.0, rate=500.0, seed=0, estimator=key), experiment, problem)
