"""Maximum likelihood with noise that the joints share: iterated generalised least squares.

The residuals of all joints at one time are a normal vector of covariance C (n_v, n_v). Its likelihood is largest where

    x = argmin sum_t e_t' C^-1 e_t    and    C = mean_t e_t e_t',    e_t = tau_t - Y_t x

are both true; they are solved in turn. The evidence keeps each joint's factor only, so one pass over the rows collects
what two joints have in common: with the columns turned by the evidence's own triangle, `B_j = Y_j R^-1`, the products
`S_jk = sum_t [B_j tau_j]' [B_k tau_k]` are those of nearly orthonormal columns, and as well conditioned as C itself.

Source: Zellner, "An efficient method of estimating seemingly unrelated regressions", 1962; Oberhofer, Kmenta 1974
(iteration ends in maximum likelihood); for robots: Swevers et al., "Optimal robot excitation and identification", 1997.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ModelError
from tauhat.estimation.evidence import Evidence
from tauhat.estimation.least_squares import Estimator, Solved, WeightedLeastSquares, check_rows, diagnosed
from tauhat.estimation.problem import Problem
from tauhat.estimation.repeated_rows import RepeatedRows, repeated_rows
from tauhat.estimation.rows import Rows
from tauhat.estimation.solution import MOST_GROUPS, Solution, freed, stacked, widened

_RANK = 1e-10  # singular values below this part of the largest are taken as zero


class Products(NamedTuple):
    """What the rows of each group of time have in common.

    basis : (n_b, r) R^-1: the parameters are `basis @ y`
    groups : (n_groups, n_v, r + 1, n_v, r + 1)
    n_t : rows per joint
    """

    basis: FloatArray
    groups: FloatArray
    n_t: int


class Likeliest(NamedTuple):
    """Coordinates y (r,), covariance of the joints' noise (n_v, n_v) [Nm^2], passes, last change over the residual."""

    coordinates: FloatArray
    noise: FloatArray
    passes: int
    moved: float


@dataclass(frozen=True, slots=True, kw_only=True)
class MaximumLikelihood(Estimator):
    """Generalised least squares with the full covariance of the joints' noise, found along with the parameters.

    passes : at most
    tolerance : change of the torque, over its residual, at which it ends
    least : smallest eigenvalue of the noise's correlation, below which joints count as one
    """

    key: ClassVar[str] = "ml"
    passes: int = 50
    tolerance: float = 1e-6
    least: float = 1e-2

    def __post_init__(self) -> None:
        super(MaximumLikelihood, self).__post_init__()
        WeightedLeastSquares(passes=self.passes)
        for name in ("tolerance", "least"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise ModelError(f"{name} out of range", expected="0 to 1", got=getattr(self, name))
        if self.ridge:
            raise ModelError("maximum likelihood takes no ridge", got=self.ridge)

    def solve(self, evidence: Evidence) -> Solved:
        """Return the solution with noise that joints do not share: evidence alone does not say what they share."""
        return WeightedLeastSquares(power=1.0).solve(evidence)

    def fit_problem(self, problem: Problem) -> Solution:
        """Return the solution where parameters and covariance of the noise agree."""
        evidence = problem.evidence
        check_rows(evidence)
        start = self.solve(evidence)
        products = collected_products(repeated_rows(problem), _basis(evidence, start.weights))
        found = self.likeliest(products, start=np.diag(start.weights**-2.0))
        values = products.basis @ found.coordinates
        weights = np.diag(found.noise) ** -0.5
        return diagnosed(
            evidence,
            Solved(values, weights, found.passes),
            covariance=self._covariance(products, found),
            cause=self._cause(found),
            advice=self._advice(found.noise, problem.model.robot.joint_names),
        )

    def likeliest(self, products: Products, *, start: FloatArray) -> Likeliest:
        """Return parameters and covariance of the noise (n_v, n_v), from a first covariance on."""
        whole = products.groups.sum(axis=0)
        noise, coordinates, moved, done = start, np.zeros(products.basis.shape[1]), np.inf, 0
        while done < self.passes and moved > self.tolerance:
            gram = _weighted(whole, _precision(self._kept_regular(noise)))
            step = np.linalg.solve(gram[:-1, :-1], gram[:-1, -1]) - coordinates
            moved = float(np.sqrt(step @ gram[:-1, :-1] @ step / (products.n_t * len(noise))))
            coordinates = coordinates + step
            beside = np.append(-coordinates, 1.0)
            noise = np.einsum("a,jakb,b->jk", beside, whole, beside) / products.n_t
            done += 1
        return Likeliest(coordinates, self._kept_regular(noise), done, moved)

    def _kept_regular(self, noise: FloatArray) -> FloatArray:
        """Return the covariance with the eigenvalues of its correlation at least `least`."""
        sizes = np.sqrt(np.maximum(np.diag(noise), np.finfo(float).tiny))
        values, axes = np.linalg.eigh(noise / np.outer(sizes, sizes))
        raised = (axes * np.maximum(values, self.least)) @ axes.T
        return np.asarray(raised * np.outer(sizes, sizes))

    def _covariance(self, products: Products, found: Likeliest) -> FloatArray:
        """Return the covariance of the parameters: white, widened by leaving groups of time out."""
        precision = _precision(found.noise)
        parts = np.array([_weighted(group, precision) for group in products.groups])
        whole = parts.sum(axis=0)
        beside = np.append(-found.coordinates, 1.0)
        freedom = products.n_t * len(found.noise)
        variance = float(beside @ whole @ beside) / max(1, freedom - found.coordinates.size)
        sizes, axes = np.linalg.eigh(whole[:-1, :-1])
        root = axes / np.sqrt(np.maximum(sizes, _RANK * sizes[-1]))
        white = variance * products.basis @ root @ root.T @ products.basis.T
        if len(parts) == 1:
            return np.asarray(white)
        moves = [_move(part, beside, root) for part in parts]
        return widened(white, np.array(moves) @ products.basis.T)

    def _cause(self, found: Likeliest) -> str:
        ended = "converged" if found.moved <= self.tolerance else f"stopped after {found.passes} passes"
        return f"{ended}: the last pass moved the torque by {100 * found.moved:.2g} % of its residual"

    def _advice(self, noise: FloatArray, names: tuple[str, ...]) -> str:
        sizes = np.sqrt(np.diag(noise))
        shared = noise / np.outer(sizes, sizes) - np.eye(len(noise))
        first, second = np.unravel_index(int(np.abs(shared).argmax()), shared.shape)
        if len(noise) == 1 or abs(shared[first, second]) < 0.1:
            return "joints share no noise: wls with power 1 says the same"
        return f"most shared: {names[first]} and {names[second]}, correlation {shared[first, second]:.2f}"


def collected_products(rows: RepeatedRows, basis: FloatArray) -> Products:
    """Return the products of all rows, in at most 16 groups of time; one pass over the rows.

    Parameters
    ----------
    basis : (n_b, r) that makes the weighted columns orthonormal
    """
    n_t = rows.problem.evidence.n_t
    size = -(-n_t // MOST_GROUPS)
    n_v, width = len(rows.places), basis.shape[1] + 1
    groups = np.zeros((-(-n_t // size), n_v * width, n_v * width))
    done = 0
    for piece in rows:
        start = 0
        while start < piece.t.size:
            group = done // size
            stop = min(piece.t.size, start + (group + 1) * size - done)
            turned = _turned(rows, piece, basis, slice(start, stop))
            groups[group] += turned @ turned.T
            done += stop - start
            start = stop
    return Products(basis, groups.reshape(-1, n_v, width, n_v, width), n_t)


def _turned(rows: RepeatedRows, piece: Rows, basis: FloatArray, part: slice) -> FloatArray:
    """Return every joint's turned columns and torque over one stretch, (n_v (r + 1), n)."""
    parts = []
    for joint, place in enumerate(rows.places):
        parts.append(basis[place].T @ piece.columns[rows.layout.of_joint(joint), part])
        parts.append(piece.tau[joint : joint + 1, part])
    return np.concatenate(parts)


def _basis(evidence: Evidence, weights: FloatArray) -> FloatArray:
    """Return `R^-1` of the weighted columns, (n_b, r), without directions that they do not determine."""
    matrix, _ = stacked(evidence, evidence.total, weights)
    norms = np.linalg.norm(matrix, axis=0)
    scale = np.where(norms > 0.0, norms, np.inf)
    _, singular, right = np.linalg.svd(np.linalg.qr(matrix / scale, mode="r"), full_matrices=False)
    kept = singular > _RANK * singular[0]
    return np.asarray(right[kept].T / singular[kept] / scale[:, None])


def _precision(noise: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.solve(noise, np.eye(len(noise))), dtype=np.float64)


def _weighted(products: FloatArray, precision: FloatArray) -> FloatArray:
    """Return `sum_jk precision_jk S_jk`, (r + 1, r + 1)."""
    return np.asarray(np.einsum("jk,jakb->ab", precision, products, optimize=True))


def _move(part: FloatArray, beside: FloatArray, root: FloatArray) -> FloatArray:
    """Return how far the coordinates move when a group is left out."""
    return np.asarray(-root @ freed(root.T @ part[:-1, :-1] @ root, root.T @ (part[:-1] @ beside)))
