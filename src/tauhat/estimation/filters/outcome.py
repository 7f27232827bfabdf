"""From what a recursion has found to a solution like any other."""

from __future__ import annotations

import warnings
from abc import abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ModelError, TauhatWarning
from tauhat.estimation.evidence import Evidence
from tauhat.estimation.least_squares import Estimator, Solved, WeightedLeastSquares, check_rows, diagnosed
from tauhat.estimation.problem import Problem
from tauhat.estimation.solution import Solution, honest_covariance, joint_residuals, joint_torques, time_groups


class Found(NamedTuple):
    """Values (n_b,) with weights of the joints (n_v,), how often the recordings were read, and why it stopped."""

    values: FloatArray
    weights: FloatArray
    passes: int
    cause: str
    advice: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Recursion(Estimator):
    """A method that goes through the recordings in time; evidence alone is not enough for it."""

    def solve(self, evidence: Evidence) -> Solved:
        """Return weighted least squares: what settles terms and filters before the recursion runs."""
        return WeightedLeastSquares(ridge=self.ridge).solve(evidence)

    def fit(self, evidence: Evidence) -> Solution:
        """Refuse: the samples themselves are needed.

        Raises
        ------
        ModelError
            always.
        """
        raise ModelError(
            f"estimator {self.key} goes through the recordings, evidence is not enough",
            got=", ".join(evidence.recordings),
            remedy="call fit_problem, or identify",
        )

    @abstractmethod
    def fit_problem(self, problem: Problem) -> Solution:
        """Return the solution after the last sample."""


def residual_weights(evidence: Evidence) -> tuple[FloatArray, FloatArray]:
    """Return the residual of each joint after weighted least squares [Nm or N], and one over it, (n_v,) each.

    Raises
    ------
    ModelError
        when there are no more rows than parameters: nothing would be left over, and a filter take its torque for exact.
    """
    check_rows(evidence)
    residual = joint_residuals(evidence, WeightedLeastSquares().solve(evidence).values)
    floor = 1e-6 * joint_torques(evidence).max()
    deviation = np.maximum(residual, floor)
    return deviation, 1.0 / deviation


def solution_of(evidence: Evidence, found: Found, *, covariance: FloatArray | None = None) -> Solution:
    """Return the solution with diagnostics on the evidence.

    Parameters
    ----------
    covariance : of the values (n_b, n_b) as the recursion has it. A filter takes its noise for white and may be far too
        sure; each standard error is raised to at least that of least squares with the same weights, which is the
        default

    Warns
    -----
    TauhatWarning
        when there is advice: the recursion did not end well.
    """
    if found.advice:
        warnings.warn(f"{found.cause}; {found.advice}", TauhatWarning, stacklevel=3)
    groups = len(time_groups(evidence))
    rows = evidence.n_v * evidence.n_t - evidence.n_b
    spread = honest_covariance(evidence, found.weights, found.values, ridge=0.0)
    blocked = groups > 1 and not found.advice
    if covariance is not None:
        spread = covariance if found.advice else _raised(covariance, spread)
    return diagnosed(
        evidence,
        Solved(found.values.copy(), found.weights.copy(), found.passes),
        covariance=spread,
        degrees=groups - 1 if blocked else max(1, rows),
        cause=found.cause,
        advice=found.advice,
    )


def _raised(covariance: FloatArray, least: FloatArray) -> FloatArray:
    """Return a covariance with the same correlations and no standard error below that of `least`."""
    factor = np.sqrt(np.maximum(1.0, np.diag(least) / np.diag(covariance)))
    return np.asarray(covariance * np.outer(factor, factor))
