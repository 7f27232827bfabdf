"""Least squares with a pull to zero (ridge) or to the nominal robot (Gaussian prior), as strong as it helps.

With joints weighted as in weighted least squares, residual variance `s^2` and prior `x ~ N(x0, k^2 L L')`, the estimate
minimises

    |b - A x|^2 + (s / k)^2 |L^-1 (x - x0)|^2

`k`, the deviation of parameters from what they are pulled to, in parts of their usual size, is chosen by

- ridge: x0 = 0, and L is diagonal: `|b| / |A_i|`, the value with which a parameter alone would make the whole torque;
- prior: x0 is the nominal robot's, and `L L' = P S P'` with P from standard to base parameters and S the squared usual
  sizes: of inertial parameters the root mean square nominal value of their unit, of drives with nominal values these;
  parameters that nobody knows are pulled to zero with the ridge's size.

Error bars: those of a Bayesian, `s^2 (A'A + (s/k)^2 (L L')^-1)^-1`, widened by the block jackknife at fixed k.

Source: Hoerl, Kennard, "Ridge regression", 1970; Stone, "Cross-validatory choice and assessment of statistical
predictions", 1974.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.base import BaseParameters
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.nominal import nominal_standard_parameters
from tauhat.dynamics.terms import INERTIAL_SYMBOLS
from tauhat.errors import ModelError
from tauhat.estimation.evidence import Evidence
from tauhat.estimation.least_squares import Estimator, Solved, WeightedLeastSquares, check_rows, diagnosed
from tauhat.estimation.problem import Problem
from tauhat.estimation.solution import Solution, block_moves, stacked, time_groups, widened

FOLDS = 8  # blocks of time that are left out in turn
_GRID = np.logspace(2.0, -3.0, 26)  # deviations that are tried, weakest pull first
_RANK = 1e-10  # smallest eigenvalue of the prior, with unit diagonal, that is not zero


class Pull(NamedTuple):
    """What parameters are pulled to, (n_b,), and the root L of their usual squared sizes, (n_b, n_b)."""

    centre: FloatArray
    root: FloatArray


class Choice(NamedTuple):
    """The deviation that predicts left-out blocks best, their error over that without pull, and the number of blocks.

    deviation : infinite where there is nothing to leave out
    """

    deviation: float
    error: float
    folds: int


@dataclass(frozen=True, slots=True, kw_only=True)
class PulledLeastSquares(Estimator, ABC):
    """Weighted least squares with a pull whose strength cross-validation chooses.

    power : of the joints' residuals in their weights
    deviation : of the parameters from what they are pulled to, in parts of their usual size; chosen by default
    """

    power: float = 0.5
    deviation: float | None = None

    def __post_init__(self) -> None:
        super(PulledLeastSquares, self).__post_init__()
        WeightedLeastSquares(power=self.power)
        if self.deviation is not None and not 0.0 < self.deviation < np.inf:
            raise ModelError("the deviation of a prior must be positive", got=self.deviation)
        if self.ridge:
            raise ModelError("the pull takes the place of the ridge", expected="ridge 0", got=self.ridge)

    @abstractmethod
    def pull(self, evidence: Evidence, weights: FloatArray, problem: Problem | None) -> Pull:
        """Return what the parameters are pulled to; without a problem nothing is known of the robot."""

    def solve(self, evidence: Evidence) -> Solved:
        """Return values and weights, the quick part."""
        weighted = WeightedLeastSquares(power=self.power).solve(evidence)
        pull = self.pull(evidence, weighted.weights, None)
        chosen = self._chosen(evidence, weighted.weights, pull)
        fitted = _Pulled.of(evidence, weighted.weights, pull, chosen.deviation)
        return Solved(fitted.values, weighted.weights, weighted.passes + 1)

    def fit(self, evidence: Evidence) -> Solution:
        """Return values, covariance and diagnostics, knowing nothing of the robot."""
        return self._fitted(evidence, None)

    def fit_problem(self, problem: Problem) -> Solution:
        """Return values, covariance and diagnostics."""
        return self._fitted(problem.evidence, problem)

    def _chosen(self, evidence: Evidence, weights: FloatArray, pull: Pull) -> Choice:
        if self.deviation is not None:
            return Choice(self.deviation, np.nan, 0)
        return chosen_deviation(evidence, weights, pull)

    def _fitted(self, evidence: Evidence, problem: Problem | None) -> Solution:
        check_rows(evidence)
        weighted = WeightedLeastSquares(power=self.power).solve(evidence)
        weights = weighted.weights
        pull = self.pull(evidence, weights, problem)
        chosen = self._chosen(evidence, weights, pull)
        fitted = _Pulled.of(evidence, weights, pull, chosen.deviation)
        white = fitted.variance * fitted.root @ fitted.root.T
        groups = time_groups(evidence)
        moves = block_moves(evidence, groups, weights, fitted.values, root=fitted.root) if len(groups) > 1 else None
        return diagnosed(
            evidence,
            Solved(fitted.values, weights, weighted.passes + 1),
            covariance=white if moves is None else widened(white, moves),
            cause=_cause(chosen),
            advice=_advice(chosen),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class RidgeLeastSquares(PulledLeastSquares):
    """Weighted least squares, every parameter pulled to zero as much as that helps to predict left-out time."""

    key: ClassVar[str] = "ridge"

    def pull(self, evidence: Evidence, weights: FloatArray, problem: Problem | None) -> Pull:  # noqa: ARG002 (no robot)
        """Return a pull to zero, each parameter in units of what makes the whole torque."""
        return Pull(np.zeros(evidence.n_b), np.diag(_whole_torque(evidence, weights)))


@dataclass(frozen=True, slots=True, kw_only=True)
class PriorLeastSquares(PulledLeastSquares):
    """Weighted least squares, pulled to the nominal robot as much as that helps to predict left-out time."""

    key: ClassVar[str] = "prior"

    def pull(self, evidence: Evidence, weights: FloatArray, problem: Problem | None) -> Pull:
        """Return the pull to the nominal robot; the ridge's where no robot is known."""
        sizes = _whole_torque(evidence, weights)
        if problem is None:
            return Pull(np.zeros(evidence.n_b), np.diag(sizes))
        standard = nominal_standard_parameters(problem.model)
        usual = _usual_sizes(problem.model, problem.base, standard, sizes)
        projection = problem.base.projection
        covariance = (projection * usual**2) @ projection.T
        own = np.sqrt(np.diag(covariance))
        axis, turn = np.linalg.eigh(covariance / np.outer(own, own))
        root = own[:, None] * turn * np.sqrt(np.maximum(axis, _RANK * axis[-1]))
        return Pull(projection @ standard, root)


def chosen_deviation(evidence: Evidence, weights: FloatArray, pull: Pull) -> Choice:
    """Return the deviation of the prior with which blocks of time that were left out are predicted best."""
    folds = evidence.merged_blocks(FOLDS)
    fewest = evidence.n_v * (evidence.n_t - max(block.n_t for block in folds))
    if len(folds) < 2 or fewest <= evidence.n_b:
        return Choice(np.inf, 1.0, 0)
    errors = np.zeros(_GRID.size + 1)
    for index, block in enumerate(folds):
        others = evidence.of_blocks(folds[:index] + folds[index + 1 :])
        path = _Path.of(others, weights, pull)
        matrix, rhs = stacked(evidence, block, weights)
        tried = np.array([path.values(deviation) for deviation in (np.inf, *_GRID)])
        errors += np.sum((rhs[:, None] - matrix @ tried.T) ** 2, axis=0)
    best = int(errors.argmin())
    deviation = np.inf if best == 0 else float(_GRID[best - 1])
    return Choice(deviation, float(np.sqrt(errors[best] / errors[0])), len(folds))


class _Path(NamedTuple):
    """A pulled problem in coordinates `u = L^-1 (x - x0)`, by its SVD: solutions of every strength."""

    pull: Pull
    singular: FloatArray
    right: FloatArray
    turned: FloatArray
    variance: float

    @classmethod
    def of(cls, evidence: Evidence, weights: FloatArray, pull: Pull) -> _Path:
        matrix, rhs = stacked(evidence, evidence.total, weights)
        rest = rhs - matrix @ pull.centre
        triangle = np.asarray(np.linalg.qr(np.column_stack([matrix @ pull.root, rest]), mode="r"))
        left, singular, right = np.linalg.svd(triangle[:, :-1], full_matrices=False)
        turned = left.T @ triangle[:, -1]
        squares = float(triangle[:, -1] @ triangle[:, -1] - turned @ turned)
        freedom = max(1, evidence.n_v * evidence.n_t - evidence.n_b)
        floor = np.finfo(float).eps * float(rhs @ rhs)
        return cls(pull, singular, right, turned, max(squares, floor) / freedom)

    def damped(self, deviation: float) -> FloatArray:
        """Return `sqrt(S^2 + (s/k)^2)`; directions without data or pull are as good as fixed."""
        size = np.hypot(self.singular, np.sqrt(self.variance) / deviation)
        return np.asarray(np.where(size > _RANK * size.max(), size, np.inf))

    def values(self, deviation: float) -> FloatArray:
        coordinates = self.right.T @ (self.singular / self.damped(deviation) ** 2 * self.turned)
        return np.asarray(self.pull.centre + self.pull.root @ coordinates)


class _Pulled(NamedTuple):
    """The solution of one strength, a root of the inverse of what holds it, and the residual's variance."""

    values: FloatArray
    root: FloatArray
    variance: float

    @classmethod
    def of(cls, evidence: Evidence, weights: FloatArray, pull: Pull, deviation: float) -> _Pulled:
        path = _Path.of(evidence, weights, pull)
        root = pull.root @ (path.right.T / path.damped(deviation))
        return cls(path.values(deviation), root, path.variance)


def _whole_torque(evidence: Evidence, weights: FloatArray) -> FloatArray:
    """Return the value with which each parameter alone would make the whole torque, (n_b,)."""
    matrix, rhs = stacked(evidence, evidence.total, weights)
    norms = np.linalg.norm(matrix, axis=0)
    if not rhs.any():
        raise ModelError("the torque is zero throughout", remedy="name the right torque columns in the map")
    return np.asarray(np.linalg.norm(rhs) / np.maximum(norms, _RANK * norms.max()))


def _usual_sizes(model: TorqueModel, base: BaseParameters, standard: FloatArray, sizes: FloatArray) -> FloatArray:
    """Return the usual size of every standard parameter, (n_p,); zero for a regrouped one that nobody knows."""
    usual = np.abs(standard)
    units = np.array([parameter.unit for parameter in model.parameters])
    bodies = np.array([parameter.symbol in INERTIAL_SYMBOLS for parameter in model.parameters])
    for unit in np.unique(units[bodies]):
        alike = bodies & (units == unit)
        usual[alike] = np.sqrt(np.mean(standard[alike] ** 2))
    own = usual[base.independent]
    usual[base.independent] = np.where(own > 0.0, own, sizes)
    return usual


def _cause(chosen: Choice) -> str:
    if chosen.folds == 0 and np.isnan(chosen.error):
        return "solved with the deviation that was given"
    if chosen.folds == 0:
        return "solved without pull: too little data to leave any of it out"
    if np.isinf(chosen.deviation):
        return f"solved without pull: none predicts {chosen.folds} left-out blocks of time better"
    return (
        f"deviation {chosen.deviation:.3g} of the usual sizes, by {chosen.folds} left-out blocks of time: their error "
        f"is {100 * (1 - chosen.error):.2g} % less than without pull"
    )


def _advice(chosen: Choice) -> str:
    strongest = chosen.folds > 0 and chosen.deviation <= _GRID[-1]
    return "what it is pulled to predicts left-out time as well as any fit: record a richer motion" if strongest else ""
