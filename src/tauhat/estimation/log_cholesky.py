"""The same consistent fit by damped Gauss-Newton on parameters that are physical whatever their values.

The scaled pseudo-inertia of every link is written `X = U U'` with an upper triangle whose diagonal is exponential,

    U = exp(a) [[exp(d1), s12, s13, t1], [0, exp(d2), s23, t2], [0, 0, exp(d3), t3], [0, 0, 0, 1]],

ten free numbers (a, d1, d2, d3, s12, s23, s13, t1, t2, t3) a link; bounded others are their bound plus an exponential.
No constraint is left, and no convexity: it is the second opinion on the convex program where the optimum is interior.

Source: Rucker, Wensing, "Smooth parameterization of rigid-body inertia", 2022.
"""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ModelError
from tauhat.estimation.consistency_objective import objective_of
from tauhat.estimation.consistency_problem import ConsistencyProblem
from tauhat.estimation.physical_constraints import GaussianPull
from tauhat.estimation.pseudo_inertia import SIZE, stacked, unstacked

_PLACES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))  # s12, s23, s13, t1, t2, t3
_SMALL = 1e-3  # start of a bounded parameter above its bound, where the nominal one is at or below it
_MOST_STEPS = 300
_STOP = 1e-15


def log_cholesky_fit(problem: ConsistencyProblem) -> FloatArray:
    """Return the coordinates (n_u,) of the best fit, found from the nominal robot; bounds on links are not kept.

    Raises
    ------
    ModelError
        when the pull is not Gaussian: only that is a sum of squares; or when the model takes inertias as zero.
    """
    from scipy.optimize import least_squares

    if not isinstance(problem.pull, GaussianPull) or problem.coordinates.absent.size:
        raise ModelError("log-Cholesky parameters need all ten parameters a link and a Gaussian pull")
    rows = objective_of(problem).rows
    triangle, torque = rows[:, :-1], rows[:, -1]
    lower = _lower_bounds(problem)
    links = problem.coordinates.n_links
    found = least_squares(
        lambda free: triangle @ _coordinates(free, links, lower) - torque,
        _start(problem, lower),
        jac=lambda free: triangle @ _jacobian(free, links, lower),
        method="lm",
        x_scale="jac",
        ftol=_STOP,
        xtol=_STOP,
        gtol=_STOP,
        max_nfev=_MOST_STEPS,
    )
    return _coordinates(found.x, links, lower)


def shape_of(free: FloatArray) -> FloatArray:
    """Return X (4, 4) of a link's ten log-Cholesky parameters; positive definite for all of them."""
    triangle = _triangle(free)
    return triangle @ triangle.T


def log_cholesky_of(shape: FloatArray) -> FloatArray:
    """Return the ten log-Cholesky parameters of a positive definite X (4, 4): the inverse of `shape_of`."""
    turned = np.linalg.cholesky(shape[::-1, ::-1])[::-1, ::-1]
    scale = turned[3, 3]
    sides = [turned[place] / scale for place in _PLACES]
    return np.array([np.log(scale), *np.log(np.diag(turned)[:3] / scale), *sides])


def _triangle(free: FloatArray) -> FloatArray:
    triangle = np.diag([*np.exp(free[1:4]), 1.0])
    for value, place in zip(free[4:], _PLACES, strict=True):
        triangle[place] = value
    return np.asarray(np.exp(free[0]) * triangle)


def _lower_bounds(problem: ConsistencyProblem) -> FloatArray:
    """Return the bounds of the coordinates that are not inertial, -inf where there are none."""
    lower = np.full(problem.coordinates.n_u, -np.inf)
    for row in problem.rows:
        if row.cone == "nonnegative" and row.link < 0:
            lower[int(np.argmax(row.matrix[0]))] = -float(row.offset[0])
    return lower[SIZE * problem.coordinates.n_links :]


def _start(problem: ConsistencyProblem, lower: FloatArray) -> FloatArray:
    nominal, inertial = problem.coordinates.nominal, SIZE * problem.coordinates.n_links
    shapes = [log_cholesky_of(shape) for shape in unstacked(nominal[:inertial].reshape(-1, SIZE))]
    others = nominal[inertial:]
    bounded = np.isfinite(lower)
    above = np.where(bounded, np.maximum(others - np.where(bounded, lower, 0.0), _SMALL), 1.0)
    return np.concatenate([*shapes, np.where(bounded, np.log(above), others)])


def _coordinates(free: FloatArray, links: int, lower: FloatArray) -> FloatArray:
    shapes = [stacked(shape_of(part)) for part in free[: SIZE * links].reshape(-1, SIZE)]
    others, bounded = free[SIZE * links :], np.isfinite(lower)
    values = np.where(bounded, lower + np.exp(np.where(bounded, others, 0.0)), others)
    return np.concatenate([*shapes, values])


def _jacobian(free: FloatArray, links: int, lower: FloatArray) -> FloatArray:
    """Return the derivatives of the coordinates, (n_u, n_u): `dX = dU U' + U dU'`."""
    others, bounded = free[SIZE * links :], np.isfinite(lower)
    jacobian = np.diag(
        np.concatenate([np.zeros(SIZE * links), np.where(bounded, np.exp(np.where(bounded, others, 0.0)), 1.0)])
    )
    for link in range(links):
        block = slice(SIZE * link, SIZE * link + SIZE)
        triangle = _triangle(free[block])
        changes = np.zeros((SIZE, 4, 4))
        changes[0] = triangle
        for k in range(3):
            changes[1 + k, k, k] = triangle[k, k]
        for k, place in enumerate(_PLACES):
            changes[4 + k][place] = triangle[3, 3]
        half = changes @ triangle.T
        jacobian[block, block] = stacked(half + np.swapaxes(half, 1, 2)).T
    return jacobian
