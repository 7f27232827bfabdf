"""How a Gaussian passes through a function: by slopes, by sigma points, or by divided differences.

Every way gives the same two matrices of paired columns, from which both forms of the covariance are made:
`C C'` is the covariance of the function's value and `D C'` that of the argument with it, while `D D'` is the
argument's own covariance. With the root S of that, `P = S S'`, and s_k its columns:

    extended            C = J S, by slopes along s_k               D = S
    unscented           C = (f(x_k) - f(x)) / (sqrt(2) a),  x_k = x +- a s_k             D = (x_k - x) / (sqrt(2) a)
    central difference  C = [(f+ - f-) / 2h, sqrt(h^2 - 1) (f+ + f- - 2 f) / 2h^2],  f+- = f(x +- h s_k),  D = [S, 0]

Source: Julier, Uhlmann, "Unscented filtering and nonlinear estimation", 2004; Norgaard, Poulsen, Ravn, "New
developments in state estimation for nonlinear systems", 2000.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ModelError

BatchFunction = Callable[[FloatArray], FloatArray]  # (n_points, n_x) -> (n_points, n_y)
_SLOPE = 1e-2  # how far, in standard deviations, the slopes of the extended filter are taken


class Spread(NamedTuple):
    """A Gaussian behind a function: mean (n_y,), paired columns of value (n_y, k) and argument (n_x, k)."""

    mean: FloatArray
    value: FloatArray
    argument: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Spreading(ABC):
    """A way for a Gaussian to pass through a function."""

    @abstractmethod
    def through(self, function: BatchFunction, mean: FloatArray, root: FloatArray) -> Spread:
        """Return the Gaussian behind `function`, which takes and returns points by rows.

        Parameters
        ----------
        mean : (n_x,)
        root : (n_x, n_x) S of the covariance `S S'`
        """

    @abstractmethod
    def narrower(self) -> Spreading:
        """Return the same way with points half as far from the mean."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Extended(Spreading):
    """By the function's slopes at the mean: exact for linear functions, blind to curvature.

    The slopes are taken along the columns of the root, so that every parameter is moved by a part of its own
    uncertainty.
    """

    def through(self, function: BatchFunction, mean: FloatArray, root: FloatArray) -> Spread:
        """Return the value at the mean and the columns `J S`."""
        moved = _SLOPE * root.T
        values = function(np.vstack([mean, mean + moved, mean - moved]))
        up, down = values[1 : 1 + mean.size], values[1 + mean.size :]
        return Spread(values[0], (up - down).T / (2.0 * _SLOPE), root)

    def narrower(self) -> Spreading:
        """Return itself: its points are close as they are."""
        return self


@dataclass(frozen=True, slots=True, kw_only=True)
class Unscented(Spreading):
    """By sigma points on both sides of the mean along every column of the root.

    The distance does not grow with the number of states, so that with many parameters no point is beyond what physics
    allows; the centre's weight in the mean, `1 - n / reach^2`, may then be negative. The covariance is therefore taken
    about the centre's value, not about the mean, and cannot lose its sign (Julier and Uhlmann's modified form).

    reach : of the points [standard deviations]; sqrt(3) matches the fourth moment of a Gaussian
    """

    reach: float = 3.0**0.5

    def __post_init__(self) -> None:
        if not 0.0 < self.reach < np.inf:
            raise ModelError("reach of the sigma points", expected="a positive number", got=self.reach)

    def through(self, function: BatchFunction, mean: FloatArray, root: FloatArray) -> Spread:
        """Return the weighted mean of the points' values and their weighted distances from the centre's."""
        moved = self.reach * np.vstack([root.T, -root.T])
        values = function(np.vstack([mean, mean + moved]))
        away = values[1:] - values[0]
        weight = 0.5 / self.reach**2
        return Spread(values[0] + weight * away.sum(axis=0), np.sqrt(weight) * away.T, np.sqrt(weight) * moved.T)

    def narrower(self) -> Spreading:
        """Return the points at half the reach."""
        return Unscented(reach=0.5 * self.reach)


@dataclass(frozen=True, slots=True, kw_only=True)
class CentralDifference(Spreading):
    """By divided differences of first and second order, which see slope and curvature.

    step : of the differences [standard deviations]; sqrt(3) matches the fourth moment of a Gaussian. Below one the
        curvature is in the mean alone
    """

    step: float = 3.0**0.5

    def __post_init__(self) -> None:
        if not 0.0 < self.step < np.inf:
            raise ModelError("step of the central differences", expected="a positive number", got=self.step)

    def through(self, function: BatchFunction, mean: FloatArray, root: FloatArray) -> Spread:
        """Return the mean corrected for curvature, and the columns of slope and curvature."""
        n, h = mean.size, self.step
        values = function(np.vstack([mean, mean + h * root.T, mean - h * root.T]))
        middle, up, down = values[0], values[1 : 1 + n], values[1 + n :]
        bend = up + down - 2.0 * middle
        slopes = (up - down).T / (2.0 * h)
        bends = np.sqrt(max(h**2 - 1.0, 0.0)) / (2.0 * h**2) * bend.T
        argument = np.hstack([root, np.zeros_like(root)])
        return Spread(middle + bend.sum(axis=0) / (2.0 * h**2), np.hstack([slopes, bends]), argument)

    def narrower(self) -> Spreading:
        """Return the differences over half the step."""
        return CentralDifference(step=0.5 * self.step)
