"""Losses that grow slower than the square: what a large residual counts in a reweighted fit.

With `u` a residual over its scale, `rho` the loss and `psi = rho'`: a weighted least-squares fit with weights
`w(u) = psi(u) / u`, repeated, has the minimum of `sum rho(u)` as its fixed point. Thresholds give 95 % of the least
squares' efficiency on normal residuals.

Source: Huber, "Robust estimation of a location parameter", 1964; Beaton, Tukey, "The fitting of power series", 1974;
Holland, Welsch, "Robust regression using iteratively reweighted least-squares", 1977 (thresholds).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ModelError


@dataclass(frozen=True, slots=True, kw_only=True)
class Loss(ABC):
    """A loss of scaled residuals.

    threshold : scaled residual from which on it counts less than its square
    """

    threshold: float

    def __post_init__(self) -> None:
        if not 0.0 < self.threshold < np.inf:
            raise ModelError("the threshold of a loss must be positive", got=self.threshold)

    @property
    @abstractmethod
    def convex(self) -> bool:
        """Whether there is one minimum only, wherever one starts."""

    @abstractmethod
    def loss(self, scaled: FloatArray) -> FloatArray:
        """Return rho(u), `u^2 / 2` for small residuals."""

    @abstractmethod
    def weight(self, scaled: FloatArray) -> FloatArray:
        """Return w(u) = rho'(u) / u, one at zero."""

    @abstractmethod
    def bend(self, scaled: FloatArray) -> FloatArray:
        """Return rho''(u), one at zero: how much a residual holds the fit where it is."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Huber(Loss):
    """Quadratic up to the threshold k, linear behind: `w = min(1, k / |u|)`."""

    threshold: float = 1.345

    @property
    def convex(self) -> bool:
        """Whether there is one minimum only: yes."""
        return True

    def loss(self, scaled: FloatArray) -> FloatArray:
        """Return `u^2 / 2` inside, `k |u| - k^2 / 2` outside."""
        size = np.abs(scaled)
        return np.where(size <= self.threshold, 0.5 * size**2, self.threshold * (size - 0.5 * self.threshold))

    def weight(self, scaled: FloatArray) -> FloatArray:
        """Return `min(1, k / |u|)`."""
        return np.asarray(self.threshold / np.maximum(np.abs(scaled), self.threshold))

    def bend(self, scaled: FloatArray) -> FloatArray:
        """Return 1 inside, 0 outside."""
        return (np.abs(scaled) <= self.threshold).astype(np.float64)


@dataclass(frozen=True, slots=True, kw_only=True)
class Bisquare(Loss):
    """Tukey's: residuals beyond the threshold c count nothing, `w = (1 - (u/c)^2)^2` inside."""

    threshold: float = 4.685

    @property
    def convex(self) -> bool:
        """Whether there is one minimum only: no."""
        return False

    def loss(self, scaled: FloatArray) -> FloatArray:
        """Return `c^2/6 (1 - (1 - (u/c)^2)^3)`, constant outside."""
        return self.threshold**2 / 6.0 * (1.0 - self._inside(scaled) ** 3)

    def weight(self, scaled: FloatArray) -> FloatArray:
        """Return `(1 - (u/c)^2)^2`, zero outside."""
        return np.asarray(self._inside(scaled) ** 2)

    def bend(self, scaled: FloatArray) -> FloatArray:
        """Return `(1 - (u/c)^2) (1 - 5 (u/c)^2)`, zero outside."""
        inside = self._inside(scaled)
        return np.asarray(inside * (5.0 * inside - 4.0))

    def _inside(self, scaled: FloatArray) -> FloatArray:
        return np.maximum(1.0 - (scaled / self.threshold) ** 2, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Cauchy(Loss):
    """The likelihood of Cauchy's distribution: `w = 1 / (1 + (u/c)^2)`, nothing is dropped altogether."""

    threshold: float = 2.385

    @property
    def convex(self) -> bool:
        """Whether there is one minimum only: no."""
        return False

    def loss(self, scaled: FloatArray) -> FloatArray:
        """Return `c^2/2 log(1 + (u/c)^2)`."""
        return np.asarray(0.5 * self.threshold**2 * np.log1p((scaled / self.threshold) ** 2))

    def weight(self, scaled: FloatArray) -> FloatArray:
        """Return `1 / (1 + (u/c)^2)`."""
        return np.asarray(1.0 / (1.0 + (scaled / self.threshold) ** 2))

    def bend(self, scaled: FloatArray) -> FloatArray:
        """Return `(1 - (u/c)^2) / (1 + (u/c)^2)^2`."""
        square = (scaled / self.threshold) ** 2
        return np.asarray((1.0 - square) / (1.0 + square) ** 2)
