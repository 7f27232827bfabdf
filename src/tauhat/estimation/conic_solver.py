"""Solves the convex program of a consistent fit with an interior-point method, and checks the result with NumPy alone.

The solver sees `minimise |r|^2 / 2 + linear.u` with `r = T u - t` as variables of their own, so that no normal
equations are formed. The entropic pull adds `-log det X` of every link through a lower triangle Z with

    [[X, Z], [Z', diag Z]] >= 0,   log det X >= sum_k log Z_kk,

which is exact: one solve is enough, and no successive approximation has to converge.

Source: Goulart, Chen, "Clarabel: an interior-point solver for conic programs with quadratic objectives", 2024; log det:
Ben-Tal, Nemirovski, "Lectures on modern convex optimization", 2001.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.estimation.consistency_objective import Objective
from tauhat.estimation.consistency_problem import ConeRows
from tauhat.estimation.pseudo_inertia import SIZE, stacked, unstacked

TOLERANCE = 1e-8  # of the interior-point method: gap and residuals, relative
_MOST_STEPS = 100
_FELT = 1e-2  # multiplier below which a constraint does not matter: squared standard deviations a unit
_WIDE = 8  # the log det of a four by four matrix is a condition on an eight by eight one
_LOWER = tuple((row, column) for column in range(4) for row in range(column, 4))


class ConicResult(NamedTuple):
    """What the interior-point method returned.

    coordinates : (n_u,)
    residual : (n_r,) multipliers of `r = T u - t`, at the optimum r itself
    multipliers : per constraint, nearly in its dual cone
    status, iterations : of the solver, in its words
    """

    coordinates: FloatArray
    residual: FloatArray
    multipliers: tuple[FloatArray, ...]
    status: str
    iterations: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Certificate:
    """The proof of a solution: half the squared error plus the pull, in standard deviations of the residual.

    primal : of the solution
    dual : what no feasible parameters go below
    violation : largest breach of any constraint, in coordinates of the order of one
    status, iterations : of the interior-point method
    """

    primal: float
    dual: float
    violation: float
    status: str
    iterations: int

    @property
    def gap(self) -> float:
        """How much better than the solution anything could be."""
        return self.primal - self.dual


def solve_conic(objective: Objective, rows: tuple[ConeRows, ...], *, unit: float = 1.0) -> ConicResult:
    """Return what the interior-point method finds for an objective under the constraints `rows`.

    Parameters
    ----------
    unit : the solver sees the objective times its square; with the pull's deviation the pull has curvature one, and
        what only the pull decides is found as exactly as the rest
    """
    import clarabel
    from scipy.sparse import csc_matrix, diags

    matrix, offset, cones = _standard_form(objective, rows, unit)
    n_r, n_u = objective.rows.shape[0], objective.linear.size
    linear, curvature = np.zeros(matrix.shape[1]), np.zeros(matrix.shape[1])
    linear[:n_u], curvature[n_u : n_u + n_r] = unit**2 * objective.linear, 1.0
    linear[linear.size - 4 * objective.logs.size :] = -(unit**2) * np.repeat(objective.logs, 4)
    settings = clarabel.DefaultSettings()
    settings.verbose, settings.max_iter, settings.max_threads = False, _MOST_STEPS, 1
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = TOLERANCE
    found = clarabel.DefaultSolver(
        csc_matrix(diags(curvature)), linear, csc_matrix(matrix), offset, cones, settings
    ).solve()
    ends = np.cumsum([n_r, *(row.offset.size for row in rows)])
    residual, *multipliers = np.split(np.array(found.z), ends)[: len(rows) + 1]
    return ConicResult(
        coordinates=np.array(found.x)[:n_u],
        residual=residual / unit,
        multipliers=tuple(multiplier / unit**2 for multiplier in multipliers),
        status=str(found.status),
        iterations=int(found.iterations),
    )


def _standard_form(
    objective: Objective, rows: tuple[ConeRows, ...], unit: float
) -> tuple[FloatArray, FloatArray, list[Any]]:
    """Return A, b and the cones of `A v + s = b`, `s in K`, over `v = (u, r)` and, with log det, Z and its logs."""
    import clarabel

    n_r, n_u, links = objective.rows.shape[0], objective.linear.size, objective.logs.size
    logs = [piece for link in range(links) for piece in _log_pieces(link, links, n_u + n_r)]
    offset = np.concatenate(
        [unit * objective.rows[:, -1], *(row.offset for row in rows), *(offset for _, offset, _ in logs)]
    )
    matrix = np.zeros((offset.size, n_u + n_r + (SIZE + 4) * links))
    matrix[:n_r, :n_u], matrix[:n_r, n_u : n_u + n_r] = unit * objective.rows[:, :-1], -np.eye(n_r)
    last = n_r
    for part in (*(row.matrix for row in rows), *(part for part, _, _ in logs)):
        first, last = last, last + part.shape[0]
        matrix[first:last, : part.shape[1]] = -part
    cones = [clarabel.ZeroConeT(n_r), *(_cone(row) for row in rows), *(cone for _, _, cone in logs)]
    return matrix, offset, cones


def _cone(row: ConeRows) -> Any:
    import clarabel

    size = row.offset.size
    if row.cone == "semidefinite":
        return clarabel.PSDTriangleConeT(round((np.sqrt(8 * size + 1) - 1) / 2))
    kinds = {
        "zero": clarabel.ZeroConeT,
        "nonnegative": clarabel.NonnegativeConeT,
        "second order": clarabel.SecondOrderConeT,
    }
    return kinds[row.cone](size)


def _log_pieces(link: int, links: int, start: int) -> list[tuple[FloatArray, FloatArray, Any]]:
    """Return the conditions that make `sum_k t_k` no more than log det X of one link; Z and t stand behind `start`."""
    import clarabel

    first, last = start + SIZE * link, start + SIZE * links + 4 * link
    size = start + (SIZE + 4) * links
    place = {pair: first + index for index, pair in enumerate(_LOWER)}
    wide = np.zeros((_WIDE * (_WIDE + 1) // 2, size))
    wide[:SIZE, SIZE * link : SIZE * link + SIZE] = np.eye(SIZE)
    for row, column in _LOWER:
        wide[_upper(row, 4 + column), place[row, column]] = np.sqrt(2.0)
    pieces: list[tuple[FloatArray, FloatArray, Any]] = []
    for k in range(4):
        wide[_upper(4 + k, 4 + k), place[k, k]] = 1.0
        logarithm = np.zeros((3, size))
        logarithm[0, last + k] = logarithm[2, place[k, k]] = 1.0
        pieces.append((logarithm, np.array([0.0, 1.0, 0.0]), clarabel.ExponentialConeT()))
    return [(wide, np.zeros(wide.shape[0]), clarabel.PSDTriangleConeT(_WIDE)), *pieces]


def _upper(row: int, column: int) -> int:
    """Return the place of an entry of the upper triangle, column by column."""
    return column * (column + 1) // 2 + row


def certificate(
    objective: Objective, rows: tuple[ConeRows, ...], result: ConicResult, coordinates: FloatArray
) -> Certificate:
    """Return the proof of `coordinates` from a solver's multipliers, which are first projected onto the dual cone."""
    turned, shift, violation = np.zeros(objective.linear.size), 0.0, 0.0
    for row, multiplier in zip(rows, result.multipliers, strict=True):
        inside = _projected(row, multiplier)
        turned += row.matrix.T @ inside
        shift += float(row.offset @ inside)
        value = row.matrix @ coordinates + row.offset
        reached = np.zeros_like(value) if row.cone == "zero" else _projected(row, value)
        violation = max(violation, float(np.linalg.norm(value - reached)))
    return Certificate(
        primal=objective.value(coordinates),
        dual=objective.bound(turned, shift, result.residual),
        violation=violation,
        status=result.status,
        iterations=result.iterations,
    )


def binding(rows: tuple[ConeRows, ...], result: ConicResult) -> tuple[ConeRows, ...]:
    """Return the constraints that hold the fit back, by falling multiplier: squared error per unit of the bound."""
    sizes = [float(np.linalg.norm(_projected(row, value))) for row, value in zip(rows, result.multipliers, strict=True)]
    order = sorted(range(len(rows)), key=lambda index: -sizes[index])
    return tuple(rows[index] for index in order if sizes[index] > _FELT)


def _projected(row: ConeRows, value: FloatArray) -> FloatArray:
    """Return the nearest point of the dual cone; all cones but `zero` are their own dual."""
    if row.cone == "zero":
        return value
    if row.cone == "nonnegative":
        return np.maximum(value, 0.0)
    if row.cone == "second order":
        return _projected_to_second_order(value)
    values, axes = np.linalg.eigh(unstacked(value))
    return stacked((axes * np.maximum(values, 0.0)) @ axes.T)


def _projected_to_second_order(value: FloatArray) -> FloatArray:
    head, length = float(value[0]), float(np.linalg.norm(value[1:]))
    if length <= head:
        return value
    if length <= -head:
        return np.zeros_like(value)
    mean = 0.5 * (head + length)
    return np.asarray(np.concatenate([[mean], mean / length * value[1:]]))
