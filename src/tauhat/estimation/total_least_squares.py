"""Total least squares: errors in the columns as well as in the torque.

Noise in position, speed and acceleration makes the columns wrong, and least squares then draws parameters to zero. With
errors of the columns of covariance `D = diag(c^2)` a row, of the torque of variance `c_b^2`, and joints weighted as in
weighted least squares, the estimate minimises

    |b - A x|^2 / (c_b^2 + x' D x)

Scaled columns `A / c` and torque `b / c_b` side by side have one smallest singular value `s`, and its right singular
vector is `[x; -1]` in that scale. Columns without error (c = 0) are taken out first by QR (mixed total least squares).
Errors are taken to be the same part of every column's norm and `torque_error` times that part of the torque's.

Error bars: leaving out block g moves the solution by `-(H - H_g)^-1 s_g` in first order, with
    s = A'e + f D x,   H = A'A - f D,   f = |e|^2 / (c_b^2 + x'Dx)
of the block and of the whole; e is the residual.

Source: Golub, Van Loan, "An analysis of the total least squares problem", 1980; Van Huffel, Vandewalle, "The total
least squares problem", 1991, ch. 3.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ModelError
from tauhat.estimation.evidence import Evidence
from tauhat.estimation.least_squares import Estimator, Solved, WeightedLeastSquares, check_rows, diagnosed
from tauhat.estimation.problem import Problem
from tauhat.estimation.solution import Solution, stacked, time_groups, widened

_NONE = 1e-8  # smallest singular value of the columns over that with the torque, less one, below which none exists
_SHAKY = 2.0  # the same ratio below which errors are magnified rather than removed
_SMALLEST = 1e-12  # part of the largest eigenvalue at which a direction counts as not determined


class Scales(NamedTuple):
    """Sizes of the errors of each column (n_b,), zero where exact, and of the torque, up to a common factor."""

    columns: FloatArray
    torque: float


class TotalFit(NamedTuple):
    """Values, and how far the columns' smallest singular value is above that with the torque; one: no solution."""

    values: FloatArray
    ratio: float


@dataclass(frozen=True, slots=True, kw_only=True)
class TotalLeastSquares(Estimator):
    """Weighted least squares that lets columns have errors, too.

    power : of the joints' residuals in their weights
    torque_error : error of the torque in parts of its norm, over that of the columns in parts of theirs; large values
        are weighted least squares
    exact : symbols of parameters whose columns have no error; offsets by default
    """

    key: ClassVar[str] = "tls"
    power: float = 0.5
    torque_error: float = 1.0
    exact: tuple[str, ...] = ("To",)

    def __post_init__(self) -> None:
        super(TotalLeastSquares, self).__post_init__()
        WeightedLeastSquares(power=self.power)
        if not 0.0 < self.torque_error < np.inf:
            raise ModelError("the error of the torque must be positive", got=self.torque_error)
        if self.ridge:
            raise ModelError("total least squares takes no ridge", got=self.ridge)

    def solve(self, evidence: Evidence) -> Solved:
        """Return the solution with no column exact: evidence alone does not know their names."""
        weighted = WeightedLeastSquares(power=self.power).solve(evidence)
        found = total_fit(evidence, weighted.weights, self.scales(evidence, weighted.weights))
        values = weighted.values if found is None else found.values
        return Solved(values, weighted.weights, weighted.passes + 1)

    def fit(self, evidence: Evidence) -> Solution:
        """Return the solution with no column exact."""
        return self._fitted(evidence, np.zeros(evidence.n_b, dtype=np.bool_))

    def fit_problem(self, problem: Problem) -> Solution:
        """Return the solution; columns of the `exact` symbols have no error."""
        parameters = problem.model.parameters
        exact = [parameters[index].symbol in self.exact for index in problem.base.independent]
        return self._fitted(problem.evidence, np.array(exact, dtype=np.bool_))

    def scales(self, evidence: Evidence, weights: FloatArray, exact: FloatArray | None = None) -> Scales:
        """Return the sizes of the errors that this method takes columns and torque to have."""
        matrix, rhs = stacked(evidence, evidence.total, weights)
        norms = np.linalg.norm(matrix, axis=0)
        columns = norms if exact is None else np.where(exact, 0.0, norms)
        return Scales(columns, self.torque_error * float(np.linalg.norm(rhs)))

    def _fitted(self, evidence: Evidence, exact: FloatArray) -> Solution:
        check_rows(evidence)
        weighted = WeightedLeastSquares(power=self.power).fit(evidence)
        scales = self.scales(evidence, weighted.weights, exact)
        found = total_fit(evidence, weighted.weights, scales)
        if found is None:
            return replace(
                weighted,
                cause="total least squares has no solution here (nongeneric): the values are weighted least squares'",
                advice="the errors are as large as what the weakest parameters do: give richer motion, drop the "
                "parameters that the motion does not show (--essential), or keep wls",
            )
        doubtful = found.ratio < _SHAKY
        return diagnosed(
            evidence,
            Solved(found.values, weighted.weights, weighted.passes + 1),
            covariance=total_covariance(evidence, weighted.weights, scales, found.values),
            cause=f"solved; the columns' weakest direction stands {found.ratio:.3g} times above the errors",
            advice="that is too close: errors are magnified rather than removed, prefer wls" if doubtful else "",
        )


def total_fit(evidence: Evidence, weights: FloatArray, scales: Scales) -> TotalFit | None:
    """Return the total least-squares solution, or None where there is none (nongeneric).

    Parameters
    ----------
    weights : (n_v,) factors on each joint's equations
    """
    matrix, rhs = stacked(evidence, evidence.total, weights)
    norms = np.linalg.norm(matrix, axis=0)
    if not (norms > 0.0).all() or scales.torque <= 0.0:
        return None
    loose = scales.columns > 0.0
    units = np.where(loose, scales.columns, norms)
    order = np.concatenate([np.flatnonzero(~loose), np.flatnonzero(loose)])
    ordered = np.column_stack([(matrix / units)[:, order], rhs / scales.torque])
    triangle = np.asarray(np.linalg.qr(ordered, mode="r"))
    first = int((~loose).sum())
    lower = triangle[first:, first:]
    _, singular, right = np.linalg.svd(lower)
    last = right[-1]
    columns_alone = np.linalg.svd(lower[:, :-1], compute_uv=False) if loose.any() else np.array([np.inf])
    least = singular[-1] if lower.shape[0] >= lower.shape[1] else 0.0
    ratio = float(columns_alone[-1] / least) if least > 0.0 else np.inf
    undetermined = columns_alone[-1] <= _SMALLEST * singular[0]
    if undetermined or ratio <= 1.0 + _NONE or abs(last[-1]) <= _NONE:
        return None
    scaled = np.empty(evidence.n_b)
    scaled[first:] = -last[:-1] / last[-1]
    scaled[:first] = np.linalg.solve(
        triangle[:first, :first], triangle[:first, -1] - triangle[:first, first:-1] @ scaled[first:]
    )
    values = np.empty(evidence.n_b)
    values[order] = scaled * scales.torque / units[order]
    return TotalFit(values, ratio)


def total_covariance(evidence: Evidence, weights: FloatArray, scales: Scales, values: FloatArray) -> FloatArray:
    """Return the covariance of a total least-squares solution, (n_b, n_b); see the head of this file."""
    matrix, rhs = stacked(evidence, evidence.total, weights)
    norms = np.linalg.norm(matrix, axis=0)
    error = (scales.columns / norms) ** 2
    scaled = values * norms
    whole = _bend(matrix / norms, rhs, scaled, error, torque=scales.torque)
    variance = whole.squares / max(1, evidence.n_v * evidence.n_t - evidence.n_b)
    inverse = _inverse(whole.bend)
    gram = (matrix / norms).T @ (matrix / norms)
    white = variance * inverse @ gram @ inverse
    groups = time_groups(evidence)
    unit = np.outer(norms, norms)
    if len(groups) == 1:
        return np.asarray(white / unit)
    moves = []
    for block in groups:
        part, right = stacked(evidence, block, weights)
        own = _bend(part / norms, right, scaled, error, torque=scales.torque)
        moves.append(-_held(whole.bend - own.bend, own.score))
    return widened(white / unit, np.array(moves) / norms)


class _Bend(NamedTuple):
    """Score s, second derivative H and squared residual of a block."""

    score: FloatArray
    bend: FloatArray
    squares: float


def _bend(matrix: FloatArray, rhs: FloatArray, values: FloatArray, error: FloatArray, *, torque: float) -> _Bend:
    rest = rhs - matrix @ values
    squares = float(rest @ rest)
    share = squares / (torque**2 + float(values @ (error * values)))
    return _Bend(
        score=matrix.T @ rest + share * error * values,
        bend=matrix.T @ matrix - share * np.diag(error),
        squares=squares,
    )


def _held(bend: FloatArray, score: FloatArray) -> FloatArray:
    """Return `bend^-1 score`; directions that are not held are held a little."""
    try:
        np.linalg.cholesky(bend)
    except np.linalg.LinAlgError:
        return _inverse(bend) @ score
    return np.asarray(np.linalg.solve(bend, score))


def _inverse(bend: FloatArray) -> FloatArray:
    """Return the inverse of a symmetric matrix; directions that are not held are held a little."""
    sizes, axes = np.linalg.eigh(bend)
    return np.asarray((axes / np.maximum(sizes, _SMALLEST * sizes[-1])) @ axes.T)
