"""The objective of a consistent fit: its value, and the bound from below that multipliers of the constraints give.

Weak duality: with multipliers z in the dual cone of `B u + c in K`, no feasible u has a lower objective than
`min over all u of  f(u) - z.(B u + c)`. Both pulls leave that minimum in closed form, so the bound is a few lines of
linear algebra and does not trust the solver that proposed z.

Source: Boyd, Vandenberghe, "Convex optimization", 2004, ch. 5.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray, read_only
from tauhat.estimation.consistency_problem import ConsistencyProblem
from tauhat.estimation.physical_constraints import EntropicPull
from tauhat.estimation.pseudo_inertia import SIZE, stacked, unstacked


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Objective(ABC):
    """`|T u - t|^2 / 2 + linear.u - sum_k logs_k log det X_k + constant`.

    rows : (n_r, n_u + 1) the rows [T t]
    linear : (n_u,)
    logs : (n_links,), or empty without log det
    constant : what does not depend on u
    """

    rows: FloatArray
    linear: FloatArray
    logs: FloatArray
    constant: float

    def __post_init__(self) -> None:
        for array in (self.rows, self.linear, self.logs):
            read_only(array)

    def value(self, coordinates: FloatArray) -> float:
        """Return the objective."""
        rest = self.rows[:, :-1] @ coordinates - self.rows[:, -1]
        shapes = unstacked(coordinates[: SIZE * self.logs.size].reshape(-1, SIZE))
        return float(
            0.5 * rest @ rest + self.linear @ coordinates - self.logs @ _log_determinants(shapes) + self.constant
        )

    @abstractmethod
    def bound(self, turned: FloatArray, shift: float, residual: FloatArray) -> float:
        """Return what no feasible coordinates go below.

        Parameters
        ----------
        turned, shift : `B' z` (n_u,) and `z.c` of multipliers z in the dual cone
        residual : (n_r,) multipliers of `r = T u - t`
        """


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GaussianObjective(Objective):
    """T is square and regular: `min = -|w|^2 / 2 - w.t - z.c + constant` with `w = T^-T B' z`."""

    def bound(self, turned: FloatArray, shift: float, residual: FloatArray) -> float:  # noqa: ARG002
        """Return the bound; the best multipliers of the residual are known, any given are not needed."""
        from scipy.linalg import solve_triangular

        turn = solve_triangular(self.rows[:, :-1], turned, trans="T")
        return float(-0.5 * turn @ turn - turn @ self.rows[:, -1] - shift + self.constant)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EntropicObjective(Objective):
    """With multipliers v of `T u - t` the links separate: `min tr(K X) - a log det X = a (4 + log det(K / a))`.

    `K = T' v + linear - B' z`. The rows of the other parameters' pull come last, one each and diagonal; their v follow
    from K = 0 there.
    """

    def bound(self, turned: FloatArray, shift: float, residual: FloatArray) -> float:
        """Return the bound; -inf where K is not positive."""
        inertial, n_rows = SIZE * self.logs.size, self.rows.shape[0]
        fitted = n_rows - (self.linear.size - inertial)
        rows, torque = self.rows[:, :-1], self.rows[:, -1]
        multipliers = residual.copy()
        lacking = turned - rows[:fitted].T @ multipliers[:fitted] - self.linear
        multipliers[fitted:] = lacking[inertial:] / np.diag(rows[fitted:, inertial:])
        if not self.logs.size:
            logs = 0.0
        else:
            slopes = unstacked(-lacking[:inertial].reshape(-1, SIZE)) / self.logs[:, None, None]
            logs = float(self.logs @ (4.0 + _log_determinants(slopes)))
        return float(-0.5 * multipliers @ multipliers - multipliers @ torque - shift + logs + self.constant)


def objective_of(problem: ConsistencyProblem) -> Objective:
    """Return the objective of a problem."""
    root = np.sqrt(problem.precision)
    nominal = problem.coordinates.nominal
    pulled = np.column_stack([np.diag(root), root * nominal])
    if isinstance(problem.pull, EntropicPull):
        return _entropic(problem, pulled)
    triangle = np.asarray(np.linalg.qr(np.vstack([problem.fit, pulled]), mode="r"))
    n_u = nominal.size
    return GaussianObjective(
        rows=triangle[:n_u],
        linear=np.zeros(n_u),
        logs=np.zeros(0),
        constant=0.5 * float(np.sum(triangle[n_u:, -1] ** 2)),
    )


def _entropic(problem: ConsistencyProblem, pulled: FloatArray) -> EntropicObjective:
    n_links = problem.coordinates.n_links
    inertial = SIZE * n_links
    shapes = unstacked(problem.coordinates.nominal[:inertial].reshape(-1, SIZE))
    weights = problem.precision[:inertial:SIZE].copy()
    linear = np.zeros(problem.coordinates.n_u)
    inverses = np.asarray(np.linalg.solve(shapes, np.eye(4)), dtype=np.float64)
    linear[:inertial] = (weights[:, None] * stacked(inverses)).ravel()
    return EntropicObjective(
        rows=np.vstack([problem.fit, pulled[inertial:]]),
        linear=linear,
        logs=weights,
        constant=float(weights @ (_log_determinants(shapes) - 4.0)),
    )


def _log_determinants(symmetric: FloatArray) -> FloatArray:
    """Return log det of positive definite matrices, -inf for others."""
    values = np.linalg.eigvalsh(symmetric)
    positive = (values > 0.0).all(axis=-1)
    return np.where(positive, np.log(np.where(values > 0.0, values, 1.0)).sum(axis=-1), -np.inf)
