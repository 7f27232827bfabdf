"""Gradient design: exact gradients through the regressor's adjoint, every iterate inside the joint limits.

Two stages. (1) A soft gauge map sends any point inside: each joint's coefficients are divided by
`s = (1 + sum |r|^p)^(1/p)`, which is above the largest |r|; the criterion of the image is minimised without constraints
by L-BFGS while the criterion gets sharper. (2) The map keeps a distance from the limits; a logarithmic barrier lets the
motion use them fully, minimised by BFGS that starts from the barrier's own Hessian.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.excitation.criteria import ConditionNumber, Criterion, Mixed
from tauhat.excitation.information import Information
from tauhat.excitation.space import FourierSpace, SampledSpace

SAMPLES = 200  # per period while optimising; on more the criterion changes by about one per cent
LIMIT_SAMPLES = 100  # per period at which limits are held while optimising; the result is shrunk exactly
_SHARPNESS = (4.0, 16.0, 64.0)  # powers of the smooth criteria, one run of L-BFGS each
_BARRIERS = ((1e-3, 16.0), (1e-4, 64.0), (2e-5, 64.0))  # weight of the barrier, power of the criterion
_MAP_POWER = 40.0
_INSIDE = 0.999  # where the barrier starts, in parts of the limits
_ITERATIONS = 150


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Objective:
    """A criterion of the motion at a point, with its gradient.

    information : which columns count
    grid : times at which the motion is looked at
    """

    information: Information
    grid: SampledSpace

    def at(self, x: FloatArray, criterion: Criterion) -> tuple[float, FloatArray]:
        """Return value and gradient, (n_v, 2 n_h - 1)."""
        value, gradient = self.information.evaluate(self.grid.motion(x), criterion)
        return value, self.grid.pull(gradient)


def sharpened(criterion: Criterion, power: float) -> Criterion:
    """Return the criterion with another power of its p-norm; those without one stay."""
    if isinstance(criterion, Mixed):
        return Mixed(power=power, weight=criterion.weight)
    if isinstance(criterion, ConditionNumber):
        return ConditionNumber(power=power)
    return criterion


def polish(
    information: Information, space: FourierSpace, start: FloatArray, *, criterion: Criterion, samples: int = SAMPLES
) -> tuple[FloatArray, int]:
    """Return a better point inside the limits, and the number of evaluations it took.

    Parameters
    ----------
    start : (n_v, 2 n_h - 1), inside or outside the limits
    samples : per period
    """
    objective = Objective(information=information, grid=space.grid(samples))
    rows = space.grid(LIMIT_SAMPLES).rows()
    x, evaluations = start.reshape(space.shape), 0
    for power in _SHARPNESS:
        x, count = _softly(objective, rows, x, sharpened(criterion, power))
        evaluations += count
    inside, _ = soft_map(rows, x)
    y = _INSIDE * space.shrunk(inside)
    for weight, power in _BARRIERS:
        y, count = _with_barrier(objective, rows, y, sharpened(criterion, power), weight=weight)
        evaluations += count
    return space.shrunk(y), evaluations


def soft_map(rows: FloatArray, x: FloatArray) -> tuple[FloatArray, Callable[[FloatArray], FloatArray]]:
    """Return the image of a point strictly inside the limits on the grid, and the map's pullback of gradients."""
    used = np.einsum("jrk,jk->jr", rows, x)
    size = np.abs(used)
    largest = np.maximum(size.max(axis=1), 1.0)
    total = np.sum((size / largest[:, None]) ** _MAP_POWER, axis=1) + largest**-_MAP_POWER
    gauge = largest * total ** (1.0 / _MAP_POWER)
    slope = np.einsum("jrk,jr->jk", rows, np.sign(used) * (size / gauge[:, None]) ** (_MAP_POWER - 1.0))

    def pull(gradient: FloatArray) -> FloatArray:
        along = np.sum(gradient * x, axis=1) / gauge**2
        return np.asarray(gradient / gauge[:, None] - along[:, None] * slope)

    return x / gauge[:, None], pull


def _softly(objective: Objective, rows: FloatArray, x: FloatArray, criterion: Criterion) -> tuple[FloatArray, int]:
    from scipy.optimize import minimize

    def mapped(flat: FloatArray) -> tuple[float, FloatArray]:
        image, pull = soft_map(rows, flat.reshape(x.shape))
        value, gradient = objective.at(image, criterion)
        return value, pull(gradient).ravel()

    options = {"maxiter": _ITERATIONS, "maxcor": 30}
    found = minimize(mapped, x.ravel(), jac=True, method="L-BFGS-B", options=options)
    return np.asarray(found.x).reshape(x.shape), int(found.nfev)


def _with_barrier(
    objective: Objective, rows: FloatArray, y: FloatArray, criterion: Criterion, *, weight: float
) -> tuple[FloatArray, int]:
    from scipy.optimize import minimize

    def guarded(flat: FloatArray) -> tuple[float, FloatArray]:
        point = flat.reshape(y.shape)
        used = np.einsum("jrk,jk->jr", rows, point)
        if np.abs(used).max() >= 1.0:
            return np.inf, np.zeros_like(flat)
        value, gradient = objective.at(point, criterion)
        room = 1.0 - used**2
        gradient = gradient + weight * np.einsum("jrk,jr->jk", rows, 2.0 * used / room)
        return value - weight * float(np.log(room).sum()), gradient.ravel()

    options = {"maxiter": _ITERATIONS, "hess_inv0": _inverse_barrier_hessian(rows, y)}
    found = minimize(guarded, y.ravel(), jac=True, method="BFGS", options=options)
    return np.asarray(found.x).reshape(y.shape), int(found.nfev)


def _inverse_barrier_hessian(rows: FloatArray, y: FloatArray) -> FloatArray:
    """Return a first guess of the inverse Hessian, block by joint: the barrier's own, with a floor."""
    used = np.einsum("jrk,jk->jr", rows, y)
    bend = 2.0 * (1.0 + used**2) / (1.0 - used**2) ** 2
    size = y.shape[1]
    blocks = np.einsum("jrk,jr,jrl->jkl", rows, bend, rows)
    floor = 0.05 * np.trace(blocks, axis1=1, axis2=2).sum() / y.size
    whole = np.zeros((y.size, y.size))
    for joint, block in enumerate(blocks):
        part = slice(joint * size, (joint + 1) * size)
        whole[part, part] = np.linalg.solve(block + floor * np.eye(size), np.eye(size))
    return 0.5 * (whole + whole.T) * 1e3
