"""Iteratively reweighted least squares: rows that the model cannot explain count less.

Each pass weighs every filtered row by its residual over the joint's scale and solves the weighted evidence:

    u = (tau_j - Y_j x) / s_j,   s_j = 1.4826 median |tau_j - Y_j x|,   weight of the row = w(u) / s_j^(2 power)

Spikes of single samples are mended before the low-pass, which would smear each over all rows of its window.

Error bars: the block jackknife on the weighted evidence moves the solution as if the weights were fixed. They are not:
a residual beyond the threshold that grows, loses weight. The fit is held by `rho''`, not by `w`, and the error bars are
wider by that ratio (the sandwich formula with `rho''` in the outer factors, and `psi^2` between them).

Source: Huber, Ronchetti, "Robust statistics", 2009, ch. 7; Street, Carroll, Ruppert, "A note on computing robust
regression estimates via iteratively reweighted least squares", 1988 (covariance).
"""

from __future__ import annotations

from abc import ABC
from dataclasses import dataclass, field, replace
from typing import ClassVar, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ModelError
from tauhat.estimation.block import Block
from tauhat.estimation.evidence import Evidence, collect_all
from tauhat.estimation.least_squares import Estimator, Solved, WeightedLeastSquares, check_rows, degrees_of_freedom
from tauhat.estimation.losses import Bisquare, Cauchy, Huber, Loss
from tauhat.estimation.problem import Problem
from tauhat.estimation.repeated_rows import RepeatedRows, repeated_rows
from tauhat.estimation.rows import Rows
from tauhat.estimation.solution import (
    Solution,
    honest_covariance,
    joint_residuals,
    joint_torques,
    rank_and_condition,
    solve,
    stacked,
)
from tauhat.recordings.spikes import without_spikes

_NORMAL = 1.4826  # deviation of a normal variable over its median absolute deviation
_MEDIAN_OF = 65536  # residuals a joint at most: more do not make the median better
_FLOOR = 1e-9  # of the joint's torque: a scale below is rounding
_LEAST_BEND = 0.1  # of the weight: rows that hold the fit less than that do not hold it at all
_MANY = 0.3  # share of a joint's rows with less than half their weight that is worth a word


class FixedPoint(NamedTuple):
    """Values (n_b,), scales of the joints' residuals (n_v,), passes, and how far the last one moved the torque."""

    values: FloatArray
    scales: FloatArray
    passes: int
    moved: float


class Reweighted(NamedTuple):
    """What the passes ended with.

    values : (n_b,)
    scales : (n_v,) deviation of each joint's good residuals [Nm or N]
    evidence : of the rows times the roots of their last weights
    passes : over the rows
    moved : by how much the last pass changed the torque, over its residual
    """

    values: FloatArray
    scales: FloatArray
    evidence: Evidence
    passes: int
    moved: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ReweightedLeastSquares(Estimator, ABC):
    """Weighted least squares whose rows are weighted again by their own residuals.

    power : of the joints' scales in their weights, as in weighted least squares
    passes : at most
    tolerance : change of the torque, over its residual, at which it ends
    spike : distance of a torque sample from its neighbours, in usual ones, from which on it is mended; None: never
    loss : of the scaled residuals
    """

    power: float = 0.5
    passes: int = 60
    tolerance: float = 1e-3
    spike: float | None = 8.0
    loss: Loss = field(default_factory=Huber)

    def __post_init__(self) -> None:
        super(ReweightedLeastSquares, self).__post_init__()
        WeightedLeastSquares(power=self.power, passes=self.passes)
        if not 0.0 < self.tolerance < 1.0:
            raise ModelError("the tolerance is out of range", expected="0 to 1", got=self.tolerance)
        if self.spike is not None and not 0.0 < self.spike < np.inf:
            raise ModelError("the distance of a spike must be positive", got=self.spike)

    def solve(self, evidence: Evidence) -> Solved:
        """Return the weighted least-squares solution: without rows there is nothing to weigh."""
        return WeightedLeastSquares(power=self.power, ridge=self.ridge).solve(evidence)

    def fit_problem(self, problem: Problem) -> Solution:
        """Return the solution after the last pass over the rows."""
        check_rows(problem.evidence)
        cleaned, spikes = mended(problem, self.spike)
        rows = repeated_rows(cleaned)
        found = self.reweighted(rows)
        weights = found.scales**-self.power
        rank, condition = rank_and_condition(found.evidence, weights)
        return Solution(
            values=found.values,
            covariance=self._covariance(rows, found),
            weights=weights,
            joint_rms=joint_residuals(problem.evidence, found.values),
            torque_rms=joint_torques(problem.evidence),
            rank=rank,
            condition=condition,
            degrees=degrees_of_freedom(found.evidence),
            passes=found.passes,
            cause=self._cause(found),
            advice=self._advice(rows, found, spikes),
            evidence=found.evidence,
        )

    def reweighted(self, rows: RepeatedRows) -> Reweighted:
        """Return the fixed point of weights and solution, and the evidence weighted so."""
        point = self.fixed_point(rows)
        evidence = rows.weighted(lambda piece, _: self.row_weights(rows, piece, point.values, point.scales))
        values = solve(evidence, point.scales**-self.power, ridge=self.ridge)
        return Reweighted(values, point.scales, evidence, point.passes + 1, point.moved)

    def fixed_point(self, rows: RepeatedRows) -> FixedPoint:
        """Return values and scales that the weights by their own residuals leave where they are.

        A loss with several minima starts from Huber's, and keeps its scale: so it ends in the minimum nearest to the
        convex one.
        """
        start = self.solve(rows.problem.evidence).values
        first = FixedPoint(start, joint_scales(rows, start), 0, np.inf)
        if self.loss.convex:
            return self._passes(rows, self.loss, first, hold=False)
        convex = self._passes(rows, Huber(), first, hold=False)
        return self._passes(rows, self.loss, convex, hold=True)

    def row_weights(self, rows: RepeatedRows, piece: Rows, values: FloatArray, scales: FloatArray) -> FloatArray:
        """Return the weight of every equation of a piece, (n_v, n), between 0 and 1."""
        return self.loss.weight(rows.residuals(piece, values) / scales[:, None])

    def _passes(self, rows: RepeatedRows, loss: Loss, start: FixedPoint, *, hold: bool) -> FixedPoint:
        """Return what passes with one loss end with; `hold` keeps the scales."""
        given, values, scales = rows.problem.evidence, start.values, start.scales
        moved, done = np.inf, 0
        while done < self.passes and moved > self.tolerance:
            evidence, seen = _reweighted(rows, loss, values, scales)
            found = solve(evidence, scales**-self.power, ridge=self.ridge)
            moved = _moved(given, found - values, scales)
            values = found
            scales = scales if hold else _scales(seen, given)
            done += 1
        return FixedPoint(values, scales, start.passes + done, moved)

    def _covariance(self, rows: RepeatedRows, found: Reweighted) -> FloatArray:
        weights, evidence = found.scales**-self.power, found.evidence
        bend, force = self._moments(rows, found)
        freedom = evidence.n_v * evidence.n_t
        variance = float(np.mean((weights * found.scales) ** 2 * force)) * freedom / max(1, freedom - evidence.n_b)
        covariance = honest_covariance(evidence, weights, found.values, ridge=self.ridge, variance=variance)
        wider = _widening(evidence, weights, np.maximum(bend, _LEAST_BEND))
        return covariance * np.outer(wider, wider)

    def _moments(self, rows: RepeatedRows, found: Reweighted) -> tuple[FloatArray, FloatArray]:
        """Return the means of rho'' and of psi^2 over the mean of the weights, joint by joint, (n_v,) each."""
        bend, force, weight = (np.zeros_like(found.scales) for _ in range(3))
        for piece in rows:
            scaled = rows.residuals(piece, found.values) / found.scales[:, None]
            own = self.loss.weight(scaled)
            bend += self.loss.bend(scaled).sum(axis=1)
            force += np.sum((own * scaled) ** 2, axis=1)
            weight += own.sum(axis=1)
        least = np.maximum(weight, np.finfo(float).tiny)
        return bend / least, force / least

    def _cause(self, found: Reweighted) -> str:
        ended = "converged" if found.moved <= self.tolerance else f"stopped after {found.passes} passes"
        return f"{ended}: the last pass moved the torque by {100 * found.moved:.2g} % of its residual"

    def _advice(self, rows: RepeatedRows, found: Reweighted, spikes: float) -> str:
        lost = np.zeros_like(found.scales)
        for piece in rows:
            lost += (self.row_weights(rows, piece, found.values, found.scales) < 0.5).sum(axis=1)
        lost /= found.evidence.n_t
        names = rows.problem.model.robot.joint_names
        words = [f"{100 * spikes:.2g} % of the torque samples were spikes and mended"] if spikes > 0.0 else []
        if found.moved > self.tolerance:
            words.append("weights and solution still chase each other: allow more passes, or take Huber's loss")
        if lost.max() > _MANY:
            joint = int(lost.argmax())
            words.append(
                f"{100 * lost[joint]:.0f} % of the rows of {names[joint]} count less than half: that is no outlier "
                "but a model that lacks something there"
            )
        return "; ".join(words)


@dataclass(frozen=True, slots=True, kw_only=True)
class HuberLeastSquares(ReweightedLeastSquares):
    """Reweighting by Huber's loss: one minimum, and large residuals still pull, all with the same force."""

    key: ClassVar[str] = "irls-huber"


@dataclass(frozen=True, slots=True, kw_only=True)
class BisquareLeastSquares(ReweightedLeastSquares):
    """Reweighting by Tukey's bisquare: residuals far outside count nothing."""

    key: ClassVar[str] = "irls-bisquare"
    loss: Loss = field(default_factory=Bisquare)


@dataclass(frozen=True, slots=True, kw_only=True)
class CauchyLeastSquares(ReweightedLeastSquares):
    """Reweighting by Cauchy's loss: the farther a residual, the weaker its pull, never quite none.

    The default of the three: outliers that last cost it next to nothing, which Huber's cannot say, and where all rows
    are hard to explain it drops none of them, which Tukey's does.
    """

    key: ClassVar[str] = "irls"
    loss: Loss = field(default_factory=Cauchy)


def _reweighted(
    rows: RepeatedRows, loss: Loss, values: FloatArray, scales: FloatArray
) -> tuple[Evidence, list[FloatArray]]:
    """Return the evidence weighted by the residuals that the values leave, and these, thinned, for the next scales."""
    seen: list[FloatArray] = []

    def weigh(piece: Rows, _: int) -> FloatArray:
        residuals = rows.residuals(piece, values)
        seen.append(_thinned(residuals, rows.problem.evidence.n_t))
        return loss.weight(residuals / scales[:, None])

    return rows.weighted(weigh, most_blocks=1), seen


def mended(problem: Problem, threshold: float | None) -> tuple[Problem, float]:
    """Return the problem without spikes of torque, its evidence made again where there were any, and their share."""
    if threshold is None:
        return problem, 0.0
    parts = [without_spikes(recording, threshold=threshold) for recording in problem.recordings]
    share = float(np.average([part.share for part in parts], weights=[part.recording.n_t for part in parts]))
    if share == 0.0:
        return problem, 0.0
    recordings = tuple(part.recording for part in parts)
    evidence = collect_all(problem.model, problem.base, recordings, problem.processing)
    return replace(problem, recordings=recordings, evidence=evidence, kept=()), share


def joint_scales(rows: RepeatedRows, values: FloatArray) -> FloatArray:
    """Return the deviation of each joint's residuals by their median, (n_v,) [Nm or N]."""
    given = rows.problem.evidence
    return _scales([_thinned(rows.residuals(piece, values), given.n_t) for piece in rows], given)


def _thinned(residuals: FloatArray, n_t: int) -> FloatArray:
    return np.asarray(np.abs(residuals[:, :: -(-n_t // _MEDIAN_OF)]))


def _scales(seen: list[FloatArray], evidence: Evidence) -> FloatArray:
    torque = joint_torques(evidence)
    floor = np.maximum(_FLOOR * torque.max(), np.finfo(float).tiny)
    return np.asarray(np.maximum(_NORMAL * np.median(np.concatenate(seen, axis=1), axis=1), floor))


def _moved(evidence: Evidence, step: FloatArray, scales: FloatArray) -> float:
    """Return the change of the torque by a step of the parameters, over the residuals' scale, all joints alike."""
    parts = zip(evidence.supports, evidence.total.factors, scales, strict=True)
    squares = sum(float(np.sum((factor[:, :-1] @ step[place]) ** 2)) / scale**2 for place, factor, scale in parts)
    return float(np.sqrt(squares / (evidence.n_v * evidence.n_t)))


def _widening(evidence: Evidence, weights: FloatArray, held: FloatArray) -> FloatArray:
    """Return by what factor each error bar grows when joint j is held only by the part `held` of its weights."""
    white = _white_variances(evidence, evidence.total, weights)
    return np.asarray(_white_variances(evidence, evidence.total, weights * np.sqrt(held)) / white)


def _white_variances(evidence: Evidence, block: Block, weights: FloatArray) -> FloatArray:
    matrix, _ = stacked(evidence, block, weights)
    norms = np.linalg.norm(matrix, axis=0)
    scale = np.where(norms > 0.0, norms, 1.0)
    _, singular, right = np.linalg.svd(np.linalg.qr(matrix / scale, mode="r"), full_matrices=False)
    return np.asarray(np.sum((right.T / np.maximum(singular, 1e-10 * singular[0])) ** 2, axis=1) / scale**2)
