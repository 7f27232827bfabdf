"""Ordinary and weighted least squares on evidence alone: no second pass over the data."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ModelError
from tauhat.estimation.evidence import Evidence
from tauhat.estimation.problem import Problem
from tauhat.estimation.shape_uncertainty import covariance_with_shapes
from tauhat.estimation.solution import (
    Solution,
    honest_covariance,
    joint_residuals,
    joint_torques,
    number_of_groups,
    rank_and_condition,
    solve,
)


class Solved(NamedTuple):
    """Values and weights of a solve, without error bars."""

    values: FloatArray
    weights: FloatArray
    passes: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimator(ABC):
    """A method that turns evidence into parameter values.

    ridge : pull of the column-scaled parameters to zero (0: none)
    """

    key: ClassVar[str]
    ridge: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.ridge < np.inf:
            raise ModelError("the ridge cannot be negative", got=self.ridge)

    @abstractmethod
    def solve(self, evidence: Evidence) -> Solved:
        """Return values alone, the quick part of `fit`."""

    def settings(self) -> dict[str, Any]:
        """Return the settings as plain data, for the estimate file."""
        return asdict(self)

    def settled(self, problem: Problem) -> Problem:
        """Return the problem with what this method chooses itself, such as shapes of terms; by default as it is."""
        return problem

    def fit_problem(self, problem: Problem) -> Solution:
        """Return the solution of a whole problem; methods that need more than its evidence read its recordings."""
        return self.fit(problem.evidence)

    def fit(self, evidence: Evidence) -> Solution:
        """Return values, covariance and diagnostics.

        Raises
        ------
        ModelError
            when there are no more rows than parameters: neither values nor error bars would mean anything.
        """
        check_rows(evidence)
        solved = self.solve(evidence)
        spread = honest_covariance(evidence, solved.weights, solved.values, ridge=self.ridge)
        return diagnosed(evidence, solved, covariance=spread)


def check_rows(evidence: Evidence) -> None:
    """Refuse evidence of no more rows than parameters."""
    rows = evidence.n_v * evidence.n_t
    if rows <= evidence.n_b:
        raise ModelError(
            f"{rows} filtered rows cannot determine {evidence.n_b} base parameters",
            remedy="give a longer recording, or a higher cut-off",
        )


def degrees_of_freedom(evidence: Evidence) -> int:
    """Return the degrees of freedom of the standard errors: groups of time less one; rows where there is one group."""
    groups = number_of_groups(evidence)
    return groups - 1 if groups > 1 else evidence.n_v * evidence.n_t - evidence.n_b


def diagnosed(
    evidence: Evidence,
    solved: Solved,
    *,
    covariance: FloatArray,
    degrees: int | None = None,
    cause: str = "solved",
    advice: str = "",
) -> Solution:
    """Return values with what the evidence says of them: residuals, rank and condition, degrees of freedom.

    Parameters
    ----------
    covariance : of the values, (n_b, n_b)
    degrees : of freedom, where they are not those of the whole evidence
    cause, advice : as the solution has them
    """
    rank, condition = rank_and_condition(evidence, solved.weights)
    return Solution(
        values=solved.values,
        covariance=covariance,
        weights=solved.weights,
        joint_rms=joint_residuals(evidence, solved.values),
        torque_rms=joint_torques(evidence),
        rank=rank,
        condition=condition,
        degrees=degrees_of_freedom(evidence) if degrees is None else degrees,
        passes=solved.passes,
        cause=cause,
        advice=advice,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class LeastSquares(Estimator):
    """Least squares on evidence whose error bars know that shapes of terms were chosen on it, too."""

    def fit_problem(self, problem: Problem) -> Solution:
        """Return the solution with the shapes among the unknowns of its covariance."""
        solution = self.fit(problem.evidence)
        return replace(solution, covariance=covariance_with_shapes(problem, solution, ridge=self.ridge))


@dataclass(frozen=True, slots=True, kw_only=True)
class OrdinaryLeastSquares(LeastSquares):
    """Every joint's equation counts alike, in newton metres.

    Source: Khalil, Dombre, "Modeling, identification and control of robots", 2002, ch. 12.
    """

    key: ClassVar[str] = "ols"

    def solve(self, evidence: Evidence) -> Solved:
        """Return the solution with unit weights."""
        weights = np.ones(evidence.n_v)
        return Solved(solve(evidence, weights, ridge=self.ridge), weights, 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class WeightedLeastSquares(LeastSquares):
    """Each joint's equation is divided by the size of its own residual, to a power, and solved again.

    power : 1 makes every joint matter alike relative to its noise (the textbook's choice); 0.5 is between that and
        newton metres and predicts the stacked torque best on real logs
    passes : how often weights and solution follow each other

    Source: Gautier, "Dynamic identification of robots with power model", 1997; power: measured on real logs.
    """

    key: ClassVar[str] = "wls"
    power: float = 0.5
    passes: int = 3

    def __post_init__(self) -> None:
        super(WeightedLeastSquares, self).__post_init__()
        if not 0.0 <= self.power <= 2.0:
            raise ModelError("power of the joint weights out of range", expected="0 to 2", got=self.power)
        if self.passes < 1:
            raise ModelError("at least one pass is needed", got=self.passes)

    def solve(self, evidence: Evidence) -> Solved:
        """Return the solution after the last pass."""
        weights = np.ones(evidence.n_v)
        values = solve(evidence, weights, ridge=self.ridge)
        for _ in range(self.passes):
            weights = self._weights(evidence, values)
            values = solve(evidence, weights, ridge=self.ridge)
        return Solved(values, weights, self.passes + 1)

    def _weights(self, evidence: Evidence, values: FloatArray) -> FloatArray:
        residual, torque = joint_residuals(evidence, values), joint_torques(evidence)
        floor = max(1e-6 * torque.max(), np.finfo(float).tiny)
        return np.asarray(np.maximum(residual, floor) ** -self.power)
