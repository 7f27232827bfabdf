"""Descent inside joint limits: a logarithmic barrier, and a damped BFGS that never steps across a limit.

A point keeps its limits when `|r| < 1`, `r = r0 + R x`; the barrier `-w sum ln(1 - r^2)` grows without bound towards
them. BFGS starts from the barrier's own Hessian, which scales the variables as the limits do.

Source: Nocedal, Wright, "Numerical Optimization", 2006, chapters 6 and 19.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.excitation.guard import Guard

Function = Callable[[FloatArray], tuple[float, FloatArray]]

_TO_THE_LIMIT = 0.95  # longest step, in parts of the way to the nearest limit
_DECREASE = 1e-4  # part of the slope's promise that a step must keep
_SHORTER = 12  # times a step may be cut
_WINDOW = 10  # iterations over which progress is judged
_PROGRESS = 1e-6  # least relative decrease over the window


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Barrier:
    """The limits of all joints as a penalty that is finite inside them only.

    rows : R, (n_v, n_r, n_x) parts of the limits that a point uses
    rest : r0, (n_v, n_r) what the origin of the space uses of them
    weight : w, in units of the criterion
    guard : of the limits of several joints at once
    """

    rows: FloatArray
    weight: float
    rest: FloatArray = field(default_factory=lambda: np.zeros((1, 1)))
    guard: Guard | None = None

    def used(self, x: FloatArray) -> FloatArray:
        """Return r = r0 + R x of a point, (n_v, n_r)."""
        return np.asarray(self.rest + np.einsum("jrk,jk->jr", self.rows, x))

    def at(self, x: FloatArray) -> tuple[float, FloatArray]:
        """Return value and gradient, (n_v, n_x), at a point inside the joint limits; infinite outside the others."""
        used = self.used(x)
        room = 1.0 - used**2
        value, gradient = -float(np.log(room).sum()), np.einsum("jrk,jr->jk", self.rows, 2.0 * used / room)
        if self.guard is not None:
            grid = self.guard.grid
            more, push = self.guard.barrier(grid.motion(x))
            value, gradient = value + more, gradient + grid.pull(push)
        return self.weight * value, self.weight * gradient

    def longest(self, x: FloatArray, step: FloatArray) -> float:
        """Return how many times a step fits before a limit is met; infinite when none is."""
        used, change = self.used(x), self.used(step) - self.rest
        room = np.where(change > 0.0, 1.0 - used, 1.0 + used)
        tight = change != 0.0
        return float(np.min(room[tight] / np.abs(change[tight]), initial=np.inf))

    def inverse_hessian(self, x: FloatArray) -> FloatArray:
        """Return the inverse of the barrier's Hessian with a floor, (n_v n_x, n_v n_x)."""
        used = self.used(x)
        bend = 2.0 * (1.0 + used**2) / (1.0 - used**2) ** 2
        whole = np.zeros((x.size, x.size)) if self.guard is None else self.guard.bend(x)
        for joint, block in enumerate(np.einsum("jrk,jr,jrl->jkl", self.rows, bend, self.rows)):
            part = slice(joint * x.shape[1], (joint + 1) * x.shape[1])
            whole[part, part] += block
        floor = 0.05 * np.trace(whole) / x.size
        inverse = np.linalg.solve(self.weight * (whole + floor * np.eye(x.size)), np.eye(x.size))
        return np.asarray(0.5 * (inverse + inverse.T))


def descend(function: Function, barrier: Barrier, x: FloatArray, *, iterations: int) -> tuple[FloatArray, int]:
    """Return a point inside the limits with a lower `function + barrier`, and the number of evaluations.

    Parameters
    ----------
    function : value and gradient, (n_v, n_x), of a point
    x : (n_v, n_x), inside the limits
    """

    def total(point: FloatArray) -> tuple[float, FloatArray]:
        wall, push = barrier.at(point)
        if not np.isfinite(wall):
            return wall, push
        value, gradient = function(point)
        return value + wall, gradient + push

    value, gradient = total(x)
    inverse, evaluations, history = barrier.inverse_hessian(x), 1, [value]
    for _ in range(iterations):
        direction = -(inverse @ gradient.ravel()).reshape(x.shape)
        slope = float(np.sum(direction * gradient))
        length = min(1.0, _TO_THE_LIMIT * barrier.longest(x, direction))
        length, count, ahead = _accepted(total, x, direction, start=(value, slope, length))
        evaluations += count
        if ahead is None:
            break
        inverse = _updated(inverse, length * direction.ravel(), (ahead[1] - gradient).ravel())
        x, (value, gradient) = x + length * direction, ahead
        history.append(value)
        if len(history) > _WINDOW and history[-1 - _WINDOW] - value < _PROGRESS * max(1.0, abs(value)):
            break
    return x, evaluations


def _accepted(
    total: Function, x: FloatArray, direction: FloatArray, *, start: tuple[float, float, float]
) -> tuple[float, int, tuple[float, FloatArray] | None]:
    """Return a step length that lowers the function enough, the evaluations and what was found; None if no length does.

    Parameters
    ----------
    start : value at x, slope along the direction, first length
    """
    value, slope, length = start
    for count in range(1, _SHORTER + 1):
        ahead = total(x + length * direction)
        rise = ahead[0] - value - slope * length
        if ahead[0] <= value + _DECREASE * length * slope and slope < 0.0:
            return length, count, ahead
        length *= float(np.clip(-0.5 * slope * length / rise, 0.1, 0.5)) if 0.0 < rise < np.inf else 0.5
    return length, _SHORTER, None


def _updated(inverse: FloatArray, step: FloatArray, change: FloatArray) -> FloatArray:
    """Return the BFGS update of the inverse Hessian; unchanged where the curvature along the step is not positive."""
    curvature = float(step @ change)
    if curvature <= 1e-10 * float(np.linalg.norm(step) * np.linalg.norm(change)):
        return inverse
    pushed = inverse @ change
    cross = np.outer(pushed, step)
    scale = (curvature + float(change @ pushed)) / curvature**2
    return np.asarray(inverse + scale * np.outer(step, step) - (cross + cross.T) / curvature)
