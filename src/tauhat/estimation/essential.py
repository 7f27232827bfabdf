"""Essential parameters: the base parameters that the data can see, found by dropping the others one at a time.

A base parameter that a motion hardly excites comes out with an error larger than itself; left in, it costs prediction.
Stepwise from the full model, on evidence alone (dropping a parameter is dropping its column from the factors):

1. the candidate is the parameter of the largest relative standard deviation, `sigma_i / |x_i|`;
2. it goes when an F-test does not object, alone in the model at hand, `F = x_i^2 / sigma_i^2` with 1 and nu degrees of
   freedom, and together with all q that went before in the full model, `F = x_d' C_dd^-1 x_d / q` with q and nu;
3. what is left is fitted again, until a candidate has to stay.

The variances are those of the block jackknife over at most eight groups of time, and nu is their number less one. The F
of white residuals, (RSS_reduced - RSS_full) over RSS_full by its thousands of degrees, is `x_i^2` over the white
variance: on filtered data it is too large by the ratio of the two variances and objects to dropping what is noise.

Source: Pham, Gautier, "Essential parameters of robots", 1991; Khalil, Dombre, "Modeling, identification and control of
robots", 2002, ch. 12; variances and degrees of freedom: Cameron, Miller 2015, as in `solution`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from tauhat.arrays import IntArray, read_only
from tauhat.errors import ModelError
from tauhat.estimation.evidence import Evidence
from tauhat.estimation.least_squares import Estimator, LeastSquares, Solved, WeightedLeastSquares
from tauhat.estimation.problem import Problem
from tauhat.estimation.solution import Solution

SIGNIFICANCE = 0.05  # how often a parameter that is zero is kept for nothing
TEST_GROUPS = 8  # of time in the tests: longer than for error bars, since many tests add up what correlation is left
_SILENT = 1e-9  # a column below this part of the largest is rounding of a constant position, not motion
_SINGULAR = 1e-10  # eigenvalues of a correlation below this are zero


@dataclass(frozen=True, slots=True, kw_only=True)
class EssentialStep:
    """One candidate and the tests that decided on it.

    parameter : index among the evidence's parameters
    value, standard_error, relative : in the model at hand; relative is infinite where the column is silent
    alone, alone_limit : F of this parameter being zero, and its largest value without objection
    together, together_limit : the same for all dropped so far and this one, in the full model
    relative_rms : residual over torque of the model without it
    dropped : False for the candidate that had to stay and ended the search
    """

    parameter: int
    value: float
    standard_error: float
    relative: float
    alone: float
    alone_limit: float
    together: float
    together_limit: float
    relative_rms: float
    dropped: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EssentialParameters:
    """Which parameters the data supports, how that was decided, and the fit of these alone.

    kept : indices among the evidence's parameters, sorted
    dropped : the others, in the order in which they went
    steps : one a candidate
    solution : over all parameters; dropped ones are zero with variance zero, rank and condition are of the kept ones
    """

    kept: IntArray
    dropped: IntArray
    steps: tuple[EssentialStep, ...]
    solution: Solution

    def __post_init__(self) -> None:
        read_only(self.kept)
        read_only(self.dropped)


@dataclass(frozen=True, slots=True, kw_only=True)
class EssentialLeastSquares(Estimator):
    """Least squares on the essential parameters alone; the others are zero, with variance zero.

    inner : method of every fit
    significance : of the tests
    """

    key: ClassVar[str] = "essential"
    inner: Estimator = field(default_factory=WeightedLeastSquares)
    significance: float = SIGNIFICANCE

    def solve(self, evidence: Evidence) -> Solved:
        """Return the values of the whole model: which parameters are essential is decided by `fit`."""
        return self.inner.solve(evidence)

    def settled(self, problem: Problem) -> Problem:
        """Return the problem with what the inner method chooses itself."""
        return self.inner.settled(problem)

    def fit_problem(self, problem: Problem) -> Solution:
        """Return the solution on the evidence as the inner method weighs its rows, where it does."""
        if isinstance(self.inner, LeastSquares):
            return self.fit(problem.evidence)
        weighted = self.inner.fit_problem(problem).evidence
        return replace(self.fit(weighted or problem.evidence), evidence=weighted)

    def fit(self, evidence: Evidence) -> Solution:
        """Return values, covariance and diagnostics of the essential parameters."""
        return essential_parameters(evidence, estimator=self.inner, significance=self.significance).solution


def essential_parameters(
    evidence: Evidence, *, estimator: Estimator | None = None, significance: float = SIGNIFICANCE
) -> EssentialParameters:
    """Return the parameters that the evidence supports, by stepwise F-tests; no second pass over data.

    Parameters
    ----------
    estimator : weighted least squares by default
    significance : chance at which a parameter that is zero is kept all the same, at each test

    Raises
    ------
    ModelError
        when the significance is not between 0 and 1, or there are no more rows than parameters.
    """
    if not 0.0 < significance < 1.0:
        raise ModelError("the significance of the test is out of range", expected="0 to 1", got=significance)
    method = estimator or WeightedLeastSquares()
    coarse = replace(evidence, blocks=evidence.merged_blocks(TEST_GROUPS))
    silent = _silent(coarse)
    visible = np.setdiff1d(np.arange(evidence.n_b), silent)
    if not visible.size:
        raise ModelError("no parameter loads any joint in these recordings")
    full = method.fit(coarse.keeping(visible))
    steps = [_silent_step(int(index), full) for index in silent]
    kept, solution = visible, full
    while kept.size > 1:
        shorter, smaller, step = _tried(coarse, method, kept, solution, full=(visible, full), significance=significance)
        steps.append(step)
        if not step.dropped:
            break
        kept, solution = shorter, smaller
    return EssentialParameters(
        kept=kept,
        dropped=np.array([step.parameter for step in steps if step.dropped], dtype=np.intp),
        steps=tuple(steps),
        solution=_spread(method.fit(evidence.keeping(kept)), kept, evidence.n_b),
    )


def _silent(evidence: Evidence) -> IntArray:
    """Return the parameters whose columns are nothing or mere rounding."""
    squares = np.zeros(evidence.n_b)
    for support, factor in zip(evidence.supports, evidence.total.factors, strict=True):
        np.add.at(squares, support, np.sum(factor[:, :-1] ** 2, axis=0))
    norms = np.sqrt(squares)
    return np.flatnonzero(norms <= _SILENT * norms.max())


def _silent_step(parameter: int, full: Solution) -> EssentialStep:
    return EssentialStep(
        parameter=parameter,
        value=0.0,
        standard_error=0.0,
        relative=np.inf,
        alone=0.0,
        alone_limit=0.0,
        together=0.0,
        together_limit=0.0,
        relative_rms=_relative_rms(full),
        dropped=True,
    )


def _tried(
    evidence: Evidence,
    method: Estimator,
    kept: IntArray,
    solution: Solution,
    *,
    full: tuple[IntArray, Solution],
    significance: float,
) -> tuple[IntArray, Solution, EssentialStep]:
    """Return the parameters and fit without the least certain one, and the tests of its going."""
    errors = np.sqrt(np.diag(solution.covariance))
    sizes = np.abs(solution.values)
    candidate = int(np.argmin(sizes / errors))
    shorter = np.delete(kept, candidate)
    smaller = method.fit(evidence.keeping(shorter))
    everyone, start = full
    gone = np.flatnonzero(~np.isin(everyone, shorter))
    alone = float((sizes[candidate] / errors[candidate]) ** 2)
    together = _joint_statistic(start, gone)
    limits = _limit(1, solution.degrees, significance), _limit(gone.size, start.degrees, significance)
    step = EssentialStep(
        parameter=int(kept[candidate]),
        value=float(solution.values[candidate]),
        standard_error=float(errors[candidate]),
        relative=float(errors[candidate] / sizes[candidate]) if sizes[candidate] > 0.0 else np.inf,
        alone=alone,
        alone_limit=limits[0],
        together=together,
        together_limit=limits[1],
        relative_rms=_relative_rms(smaller),
        dropped=alone <= limits[0] and together <= limits[1],
    )
    return shorter, smaller, step


def _joint_statistic(solution: Solution, gone: IntArray) -> float:
    """Return `x_d' C_dd^-1 x_d / q`, on the correlation matrix, whose scale does not depend on units."""
    covariance = solution.covariance[np.ix_(gone, gone)]
    errors = np.sqrt(np.diag(covariance))
    scaled = solution.values[gone] / errors
    weights = np.linalg.lstsq(covariance / np.outer(errors, errors), scaled, rcond=_SINGULAR)[0]
    return float(scaled @ weights) / gone.size


def _limit(parameters: int, degrees: int, significance: float) -> float:
    from scipy.special import fdtri

    return float(fdtri(parameters, degrees, 1.0 - significance))


def _relative_rms(solution: Solution) -> float:
    return float(np.linalg.norm(solution.joint_rms) / np.linalg.norm(solution.torque_rms))


def _spread(solution: Solution, kept: IntArray, n_b: int) -> Solution:
    """Return the solution over all parameters, zero with variance zero where they were dropped."""
    values, covariance = np.zeros(n_b), np.zeros((n_b, n_b))
    values[kept] = solution.values
    covariance[np.ix_(kept, kept)] = solution.covariance
    return replace(solution, values=values, covariance=covariance)
