"""The linear algebra on evidence: weighted solve on the factors, and standard errors that survive correlated residuals.

Solve: every joint's factor, times its weight, is a few rows of one small stacked problem `A x = b`, solved by SVD with
columns scaled to unit norm.

Standard errors: the white-noise formula `s^2 (A'A)^-1` assumes independent residuals and is far too small on filtered
data and unmodelled friction. Here whole blocks of time are left out one at a time (delete-a-block jackknife), exactly
and without solving again: with `A = Q R` and `B_g = A_g R^-1`, leaving block g out moves the solution by
    x_(g) - x = -R^-1 (E - B_g' B_g)^-1 B_g' e_g.
The variance of each parameter is the jackknife's, never less than the white one; the correlations between parameters
are those of the white-noise covariance, so that the matrix stays regular when there are fewer blocks than parameters.

Source: Cameron, Miller, "A practitioner's guide to cluster-robust inference", 2015; Künsch 1989 (block jackknife).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray, read_only
from tauhat.errors import ModelError
from tauhat.estimation.block import Block
from tauhat.estimation.evidence import Evidence

RANK = 1e-10  # singular values below this part of the largest are taken as zero
_SILENT = 1e-9  # a column below this part of the largest is rounding of a constant position, not motion
_WELL = 1e-8  # smallest over largest pivot with which the triangle is solved as it is
MOST_GROUPS = 16  # of blocks of time in the jackknife: fewer and longer ones outlast the residuals' correlation
_LEAST_FREE = 1e-3  # smallest eigenvalue of E - B'B that is trusted: a parameter that one block alone decides


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Solution:
    """A least-squares solution on evidence.

    values : (n_b,)
    covariance : (n_b, n_b), honest under correlated residuals
    weights : (n_v,) of the joints' equations
    joint_rms : (n_v,) root mean square of the residuals [Nm or N]
    torque_rms : (n_v,) root mean square of the torque [Nm or N]
    rank, condition : of the weighted stacked regressor with columns scaled to unit norm
    degrees : degrees of freedom of the standard errors
    passes : how often the problem was solved
    cause : why the method stopped, in words
    advice : what to do about it where something is wrong
    evidence : that was solved, where the method weighted its rows; None where it is the one that was given
    """

    values: FloatArray
    covariance: FloatArray
    weights: FloatArray
    joint_rms: FloatArray
    torque_rms: FloatArray
    rank: int
    condition: float
    degrees: int
    passes: int
    cause: str = "solved"
    advice: str = ""
    evidence: Evidence | None = None

    def __post_init__(self) -> None:
        for array in (self.values, self.covariance, self.weights, self.joint_rms, self.torque_rms):
            read_only(array)


def solve(evidence: Evidence, weights: FloatArray, *, ridge: float) -> FloatArray:
    """Return the weighted least-squares solution, (n_b,); the one of minimum norm where the evidence lacks rank.

    Parameters
    ----------
    weights : (n_v,) factors on each joint's equations
    ridge : pull of every column-scaled parameter to zero: adds `ridge^2 |x_scaled|^2` to the squared error of a problem
        with columns of unit norm

    Raises
    ------
    ModelError
        when the torque or a whole column is zero.
    """
    from scipy.linalg import solve_triangular

    triangle, scale = _triangle(evidence, weights)
    square, rhs = triangle[:, :-1], triangle[:, -1]
    if ridge > 0.0:
        pulled = np.vstack([triangle, ridge * np.eye(evidence.n_b, evidence.n_b + 1)])
        triangle = np.asarray(np.linalg.qr(pulled, mode="r"))[: evidence.n_b]
        square, rhs = triangle[:, :-1], triangle[:, -1]
    pivots = np.abs(np.diag(square))
    if square.shape[0] == square.shape[1] and pivots.min() > _WELL * pivots.max():
        return np.asarray(solve_triangular(square, rhs) / scale)
    left, singular, right = np.linalg.svd(square, full_matrices=False)
    kept = singular > RANK * singular[0]
    return np.asarray(right[kept].T @ ((left[:, kept].T @ rhs) / singular[kept]) / scale)


def rank_and_condition(evidence: Evidence, weights: FloatArray) -> tuple[int, float]:
    """Return rank and condition number of the weighted stacked regressor with columns of unit norm."""
    triangle, _ = _triangle(evidence, weights)
    singular = np.linalg.svd(triangle[:, :-1], compute_uv=False)
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0 else np.inf
    return int((singular > RANK * singular[0]).sum()), condition


def _triangle(evidence: Evidence, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the factor [R z] of the whole weighted problem with columns of unit norm, and the columns' norms.

    Columns of mere rounding are zero there and their norm infinite: their parameters come out as zero, without rank.
    """
    matrix, rhs = stacked(evidence, evidence.total, weights)
    if not rhs.any():
        raise ModelError("the torque is zero throughout", remedy="name the right torque columns in the map")
    scale = np.linalg.norm(matrix, axis=0)
    if not (scale > 0).all():
        silent = int((scale <= 0).sum())
        raise ModelError(
            f"{silent} of {evidence.n_b} base parameters never load a joint in these recordings",
            remedy="record a motion that moves every joint, all together, or lock those that stand still",
        )
    scale = np.where(scale > _SILENT * scale.max(), scale, np.inf)
    triangle = np.asarray(np.linalg.qr(np.column_stack([matrix / scale, rhs]), mode="r"))
    return triangle[: evidence.n_b], np.asarray(scale)


def stacked(evidence: Evidence, block: Block, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return one block's weighted factors of all joints as rows over all parameters, and their right-hand sides."""
    parts, rights = [], []
    for joint, factor in enumerate(block.factors):
        rows = np.zeros((factor.shape[0], evidence.n_b))
        rows[:, evidence.supports[joint]] = weights[joint] * factor[:, :-1]
        parts.append(rows)
        rights.append(weights[joint] * factor[:, -1])
    return np.vstack(parts), np.concatenate(rights)


def weighted_rows(evidence: Evidence, weights: FloatArray) -> FloatArray:
    """Return all joints' weighted factors as rows over all parameters, the torque last, (n, n_b + 1)."""
    return np.column_stack(stacked(evidence, evidence.total, weights))


def joint_residuals(evidence: Evidence, values: FloatArray) -> FloatArray:
    """Return the root mean square residual of each joint's equations, (n_v,) [Nm or N]."""
    total = evidence.total
    squares = [
        np.sum((factor[:, :-1] @ values[support] - factor[:, -1]) ** 2)
        for support, factor in zip(evidence.supports, total.factors, strict=True)
    ]
    return np.sqrt(np.array(squares) / evidence.n_t)


def joint_torques(evidence: Evidence) -> FloatArray:
    """Return the root mean square torque of each joint, (n_v,) [Nm or N]."""
    squares = [np.sum(factor[:, -1] ** 2) for factor in evidence.total.factors]
    return np.sqrt(np.array(squares) / evidence.n_t)


def honest_covariance(
    evidence: Evidence, weights: FloatArray, values: FloatArray, *, ridge: float, variance: float | None = None
) -> FloatArray:
    """Return the covariance of the parameters, (n_b, n_b); see the head of this file.

    Parameters
    ----------
    variance : of the weighted residuals; the evidence's own by default
    """
    matrix, rhs = stacked(evidence, evidence.total, weights)
    scale = np.linalg.norm(matrix, axis=0)
    _, singular, right = np.linalg.svd(np.linalg.qr(matrix / scale, mode="r"), full_matrices=False)
    damped = np.sqrt(singular**2 + ridge**2)
    damped = np.maximum(damped, RANK * damped[0])
    root = right.T / damped  # A'A = S (root root')^-1 S with the column scales S
    if variance is None:
        freedom = max(1, evidence.n_v * evidence.n_t - evidence.n_b)
        variance = float(np.sum((matrix @ values - rhs) ** 2)) / freedom
    white = variance * (root @ root.T) / np.outer(scale, scale)
    groups = time_groups(evidence)
    if len(groups) == 1:
        return np.asarray(white)
    return widened(white, block_moves(evidence, groups, weights, values, root=root / scale[:, None]))


def widened(white: FloatArray, moves: FloatArray) -> FloatArray:
    """Return the covariance with the jackknife's variances, never less than the white ones, and white correlations.

    Parameters
    ----------
    white : (n_b, n_b) covariance that independent residuals would give
    moves : (n_groups, n_b) how far the solution moves when each group of time is left out
    """
    count = len(moves)
    spread = np.maximum(np.diag(white), (count - 1) / count * np.sum(moves**2, axis=0))
    inflation = np.sqrt(spread / np.diag(white))
    return np.asarray(white * np.outer(inflation, inflation))


def time_groups(evidence: Evidence) -> tuple[Block, ...]:
    """Return the blocks of time merged to at most sixteen: what the jackknife leaves out one at a time."""
    return evidence.merged_blocks(MOST_GROUPS)


def number_of_groups(evidence: Evidence) -> int:
    """Return how many groups of time there are, without making them."""
    count = len(evidence.blocks)
    while count > MOST_GROUPS:
        count = (count + 1) // 2
    return count


def block_moves(
    evidence: Evidence, groups: tuple[Block, ...], weights: FloatArray, values: FloatArray, *, root: FloatArray
) -> FloatArray:
    """Return how far the solution moves when each group is left out, (n_groups, n_b).

    Parameters
    ----------
    root : (n_b, n_b) a root of the inverse of what the squared error bends by: `root root' = (A'A)^-1`
    """
    moves = []
    for block in groups:
        matrix, rhs = stacked(evidence, block, weights)
        turned = matrix @ root
        moves.append(-root @ freed(turned.T @ turned, turned.T @ (rhs - matrix @ values)))
    return np.array(moves)


def freed(held: FloatArray, score: FloatArray) -> FloatArray:
    """Return `(E - held)^-1 score`, with eigenvalues of `E - held` below 1e-3 raised to that."""
    free = np.eye(len(held)) - held
    try:
        np.linalg.cholesky(free - _LEAST_FREE * np.eye(len(held)))
    except np.linalg.LinAlgError:
        sizes, axes = np.linalg.eigh(free)
        return np.asarray(axes @ ((axes.T @ score) / np.maximum(sizes, _LEAST_FREE)))
    return np.asarray(np.linalg.solve(free, score))
