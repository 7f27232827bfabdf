"""Gradient design: exact gradients through the regressor's adjoint, every iterate inside the joint limits.

Two stages. (1) A soft gauge map sends any point inside: each joint's coefficients are divided by
`s = (1 + sum |r|^p)^(1/p)`, which is above the largest |r|; the criterion of the image is minimised without constraints
by L-BFGS while the criterion gets sharper. (2) The map keeps a distance from the limits; a logarithmic barrier lets the
motion use them fully. A criterion that does not get sharper needs one run of the first stage.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeAlias

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.excitation.barrier import Barrier, descend
from tauhat.excitation.criteria import ConditionNumber, Criterion, EOptimal, Mixed
from tauhat.excitation.guard import Guard
from tauhat.excitation.information import Information
from tauhat.excitation.space import FourierSpace, SampledSpace

SAMPLES = 200  # per period while optimising; on more the criterion changes by about one per cent
LIMIT_SAMPLES = 100  # per period at which limits are held while optimising; the result is shrunk exactly
_MAP_POWER = 40.0
_INSIDE = 0.99  # where the barrier starts, in parts of the limits
_ITERATIONS = 150

_Walls: TypeAlias = tuple[FloatArray, FloatArray]  # joint limits `|rest + rows x| <= 1`: rows and rest


@dataclass(frozen=True, slots=True, kw_only=True)
class Schedule:
    """How a criterion is approached.

    powers : of the smooth criterion, one run of L-BFGS each
    barriers : weight of the barrier in units of the criterion, and power of the criterion, one run of BFGS each
    """

    powers: tuple[float, ...]
    barriers: tuple[tuple[float, float], ...]


_SHARPENING = Schedule(powers=(4.0, 16.0), barriers=((1e-3, 16.0), (1e-4, 64.0), (2e-5, 64.0)))
_FIXED = Schedule(powers=(1.0,), barriers=((3e-4, 1.0), (3e-5, 1.0)))


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
    if isinstance(criterion, ConditionNumber | EOptimal | Mixed):
        return replace(criterion, power=power)
    return criterion


def polish(
    information: Information,
    space: FourierSpace,
    start: FloatArray,
    *,
    criterion: Criterion,
    samples: int = SAMPLES,
    guard: Guard | None = None,
) -> tuple[FloatArray, int]:
    """Return a better point inside the limits, and the number of evaluations it took.

    Parameters
    ----------
    start : (n_v, 2 n_h - 1), inside or outside the limits
    samples : per period
    guard : keeps limits of several joints at once, tightened where they were exceeded between the samples
    """
    objective = Objective(information=information, grid=space.grid(samples))
    coarse = space.grid(LIMIT_SAMPLES)
    walls = (coarse.rows(), coarse.rest())
    schedule = schedule_of(criterion)
    x, evaluations = _INSIDE * space.shrunk(start), 0
    for power in schedule.powers:
        x, count = _softly(objective, walls, x, sharpened(criterion, power))
        evaluations += count
    y = _INSIDE * space.shrunk(soft_map(*walls, x)[0])
    size = criterion.size(information.n)
    stages = [(weight * size, sharpened(criterion, power)) for weight, power in schedule.barriers]
    y, count = _with_barriers(objective, walls, _entered(objective, guard, y, stages[0][1]), stages, guard)
    evaluations += count
    if guard is None:
        return space.shrunk(y), evaluations
    if not guard.holds(y):
        guard = guard.tightened(y)
        y, count = _with_barriers(objective, walls, _entered(objective, guard, y, stages[-1][1]), stages[-1:], guard)
        evaluations += count
    return guard.settled(y), evaluations


def schedule_of(criterion: Criterion) -> Schedule:
    """Return how a criterion is approached: those with a power in steps, the others at once."""
    return _FIXED if sharpened(criterion, 1.0) is criterion else _SHARPENING


def _entered(objective: Objective, guard: Guard | None, y: FloatArray, criterion: Criterion) -> FloatArray:
    """Return the point, or the best of those it becomes when shrunk towards each pose until it is inside the guard."""
    if guard is None:
        return y
    return min(guard.starts(y), key=lambda point: objective.at(point, criterion)[0])


def _with_barriers(
    objective: Objective, walls: _Walls, y: FloatArray, stages: list[tuple[float, Criterion]], guard: Guard | None
) -> tuple[FloatArray, int]:
    evaluations = 0
    for weight, criterion in stages:
        barrier = Barrier(rows=walls[0], rest=walls[1], weight=weight, guard=guard)
        y, count = descend(partial(objective.at, criterion=criterion), barrier, y, iterations=_ITERATIONS)
        evaluations += count
    return y, evaluations


def soft_map(
    rows: FloatArray, rest: FloatArray, x: FloatArray
) -> tuple[FloatArray, Callable[[FloatArray], FloatArray]]:
    """Return the image of a point strictly inside the limits on the grid, and the map's pullback of gradients.

    Parameters
    ----------
    rows, rest : (n_v, n_r, n_x), (n_v, n_r) limits `|rest + rows x| <= 1`; what counts is the part of the way from the
        rest to the limit on either side
    """
    used = np.einsum("jrk,jk->jr", rows, x)
    side = np.sign(used) / (1.0 - np.sign(used) * rest)
    size = side * used
    largest = np.maximum(size.max(axis=1), 1.0)
    total = np.sum((size / largest[:, None]) ** _MAP_POWER, axis=1) + largest**-_MAP_POWER
    gauge = largest * total ** (1.0 / _MAP_POWER)
    slope = np.einsum("jrk,jr->jk", rows, side * (size / gauge[:, None]) ** (_MAP_POWER - 1.0))

    def pull(gradient: FloatArray) -> FloatArray:
        along = np.sum(gradient * x, axis=1) / gauge**2
        return np.asarray(gradient / gauge[:, None] - along[:, None] * slope)

    return x / gauge[:, None], pull


def _softly(objective: Objective, walls: _Walls, x: FloatArray, criterion: Criterion) -> tuple[FloatArray, int]:
    from scipy.optimize import minimize

    def mapped(flat: FloatArray) -> tuple[float, FloatArray]:
        image, pull = soft_map(*walls, flat.reshape(x.shape))
        value, gradient = objective.at(image, criterion)
        return value, pull(gradient).ravel()

    options = {"maxiter": _ITERATIONS, "maxcor": 30}
    found = minimize(mapped, x.ravel(), jac=True, method="L-BFGS-B", options=options)
    return np.asarray(found.x).reshape(x.shape), int(found.nfev)
