"""The two forms in which a filter carries its covariance: the matrix itself, or its triangular square root.

Both take the paired columns of `spreading` and give, in exact arithmetic, the same filter. The plain form subtracts,
`P - K P_y K'`, and can lose positive definiteness to rounding, which its next Cholesky factor notices. The square-root
form only turns columns into a triangle and cannot:

    [[N, C], [0, D]] Q = [[S_y, 0], [G, S]],   K = G S_y^-1

Source: van der Merwe, Wan, "The square-root unscented Kalman filter", 2001; Kailath, Sayed, Hassibi, "Linear
estimation", 2000, ch. 12 (array algorithms).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.estimation.filters.spreading import Spread


class Gain(NamedTuple):
    """A correction: what is kept of the covariance, the gain (n_x, n_y), and the innovation's root (n_y, n_y)."""

    kept: FloatArray
    gain: FloatArray
    root: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class CovarianceForm(ABC):
    """What a filter keeps of its covariance, `kept` (n_x, n_x)."""

    @abstractmethod
    def start(self, covariance: FloatArray) -> FloatArray:
        """Return what is kept of a covariance; raise LinAlgError when it is not positive."""

    @abstractmethod
    def root(self, kept: FloatArray) -> FloatArray:
        """Return the lower triangular root; raise LinAlgError when there is none."""

    @abstractmethod
    def covariance(self, kept: FloatArray) -> FloatArray:
        """Return the covariance."""

    @abstractmethod
    def scaled(self, kept: FloatArray, factor: float) -> FloatArray:
        """Return what is kept of the covariance times `factor`."""

    @abstractmethod
    def predicted(self, value: FloatArray, noise: FloatArray) -> FloatArray:
        """Return what is kept of `C C' + N N'`."""

    @abstractmethod
    def corrected(self, kept: FloatArray, spread: Spread, noise: FloatArray) -> Gain:
        """Return the correction by a measurement with noise `N N'`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlainCovariance(CovarianceForm):
    """The covariance itself."""

    def start(self, covariance: FloatArray) -> FloatArray:
        """Return a copy, after a look whether it is positive."""
        np.linalg.cholesky(covariance)
        return covariance.copy()

    def root(self, kept: FloatArray) -> FloatArray:
        """Return the Cholesky factor."""
        return np.asarray(np.linalg.cholesky(kept))

    def covariance(self, kept: FloatArray) -> FloatArray:
        """Return it as it is."""
        return kept.copy()

    def scaled(self, kept: FloatArray, factor: float) -> FloatArray:
        """Return the product."""
        return kept * factor

    def predicted(self, value: FloatArray, noise: FloatArray) -> FloatArray:
        """Return the sum."""
        return np.asarray(value @ value.T + noise @ noise.T)

    def corrected(self, kept: FloatArray, spread: Spread, noise: FloatArray) -> Gain:
        """Return the textbook's correction."""
        root = np.linalg.cholesky(spread.value @ spread.value.T + noise @ noise.T)
        turned = np.linalg.solve(root, spread.value @ spread.argument.T)
        gain = np.linalg.solve(root.T, turned).T
        left = kept - turned.T @ turned
        return Gain(0.5 * (left + left.T), gain, np.asarray(root))


@dataclass(frozen=True, slots=True, kw_only=True)
class SquareRoot(CovarianceForm):
    """The lower triangular root of the covariance, with a positive diagonal."""

    def start(self, covariance: FloatArray) -> FloatArray:
        """Return the Cholesky factor."""
        return np.asarray(np.linalg.cholesky(covariance))

    def root(self, kept: FloatArray) -> FloatArray:
        """Return it as it is."""
        return kept

    def covariance(self, kept: FloatArray) -> FloatArray:
        """Return the square."""
        return np.asarray(kept @ kept.T)

    def scaled(self, kept: FloatArray, factor: float) -> FloatArray:
        """Return the product with the root of the factor."""
        return np.asarray(kept * np.sqrt(factor))

    def predicted(self, value: FloatArray, noise: FloatArray) -> FloatArray:
        """Return the triangle of all columns."""
        return _triangle(np.hstack([value, noise]))

    def corrected(self, kept: FloatArray, spread: Spread, noise: FloatArray) -> Gain:
        """Return the correction by one triangle of measurement and state."""
        n_y = spread.mean.size
        upper = np.hstack([noise, spread.value])
        lower = np.hstack([np.zeros((kept.shape[0], noise.shape[1])), spread.argument])
        whole = _triangle(np.vstack([upper, lower]))
        root = whole[:n_y, :n_y]
        if not np.diag(root).min() > 0.0:
            raise np.linalg.LinAlgError("the innovation has no variance")
        gain = np.linalg.solve(root.T, whole[n_y:, :n_y].T).T
        return Gain(np.ascontiguousarray(whole[n_y:, n_y:]), np.asarray(gain, dtype=np.float64), root)


def _triangle(columns: FloatArray) -> FloatArray:
    """Return the lower triangle with the same square and a positive diagonal."""
    triangle = np.asarray(np.linalg.qr(columns.T, mode="r")).T
    return np.asarray(triangle * np.where(np.diag(triangle) < 0.0, -1.0, 1.0))
