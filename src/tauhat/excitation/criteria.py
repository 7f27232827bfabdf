"""Criteria of how well a motion identifies: functions of the spectrum of the information matrix, with their slopes.

`M = (1/N) sum A'A` over samples and joints, columns scaled by constants. All criteria depend on M through its
eigenvalues alone, so their gradient is `G = U diag(phi'(lambda)) U'`. Smaller is better.

Source: Pukelsheim, "Optimal design of experiments", 1993.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ExcitationError

FLOOR = (
    1e-14  # eigenvalues below this part of the largest are lifted to it: a motion that misses a column is only very bad
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Criterion(ABC):
    """A figure of merit of an information matrix; smaller is better."""

    key: ClassVar[str]

    @abstractmethod
    def of_spectrum(self, eigenvalues: FloatArray) -> tuple[float, FloatArray]:
        """Return the value and its derivative with respect to each eigenvalue, (n,)."""

    def evaluate(self, information: FloatArray) -> tuple[float, FloatArray]:
        """Return the value and its gradient with respect to the symmetric matrix, (n, n)."""
        eigenvalues, axes = np.linalg.eigh(information)
        value, slope = self.of_lifted(eigenvalues)
        return value, np.asarray((axes * slope) @ axes.T)

    def of_lifted(self, eigenvalues: FloatArray) -> tuple[float, FloatArray]:
        """Return value and slope with the smallest eigenvalues lifted to `FLOOR` times the largest."""
        return self.of_spectrum(np.maximum(eigenvalues, FLOOR * eigenvalues[-1]))

    def size(self, n: int) -> float:  # noqa: ARG002 - for those that grow with it
        """Return how much the criterion changes, for n columns, where all eigenvalues change by a factor e."""
        return 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ConditionNumber(Criterion):
    """Logarithm of the condition number of the regressor, smoothed by p-norms of the spectrum.

    `f = (ln sum l^p + ln sum l^-p) / 2p`, which tends to `ln cond(A) = 0.5 ln(l_max / l_min)` as p grows.
    """

    key: ClassVar[str] = "condition"
    power: float = 16.0

    def __post_init__(self) -> None:
        if not 1.0 <= self.power < np.inf:
            raise ExcitationError("power of the smooth condition number", expected=">= 1", got=self.power)

    def of_spectrum(self, eigenvalues: FloatArray) -> tuple[float, FloatArray]:
        """Return value and slope."""
        p = self.power
        high = p * (np.log(eigenvalues) - np.log(eigenvalues[-1]))
        low = -p * (np.log(eigenvalues) - np.log(eigenvalues[0]))
        top, bottom = np.exp(high), np.exp(low)
        value = (np.log(top.sum()) + np.log(bottom.sum())) / (2.0 * p)
        value += 0.5 * (np.log(eigenvalues[-1]) - np.log(eigenvalues[0]))
        slope = 0.5 * (top / top.sum() - bottom / bottom.sum()) / eigenvalues
        return float(value), np.asarray(slope)


@dataclass(frozen=True, slots=True, kw_only=True)
class DOptimal(Criterion):
    """`-ln det M`: the volume of the confidence ellipsoid."""

    key: ClassVar[str] = "d"

    def of_spectrum(self, eigenvalues: FloatArray) -> tuple[float, FloatArray]:
        """Return value and slope."""
        return -float(np.log(eigenvalues).sum()), -1.0 / eigenvalues

    def size(self, n: int) -> float:
        """Return the number of columns: each adds its own logarithm."""
        return float(n)


@dataclass(frozen=True, slots=True, kw_only=True)
class AOptimal(Criterion):
    """`ln trace M^-1`: the mean variance of the scaled parameters."""

    key: ClassVar[str] = "a"

    def of_spectrum(self, eigenvalues: FloatArray) -> tuple[float, FloatArray]:
        """Return value and slope."""
        total = float((1.0 / eigenvalues).sum())
        return float(np.log(total)), -1.0 / (eigenvalues**2 * total)


@dataclass(frozen=True, slots=True, kw_only=True)
class EOptimal(Criterion):
    """`-ln l_min`, smoothed by a p-norm: the least certain combination of parameters."""

    key: ClassVar[str] = "e"
    power: float = 16.0

    def of_spectrum(self, eigenvalues: FloatArray) -> tuple[float, FloatArray]:
        """Return value and slope."""
        weight = np.exp(-self.power * (np.log(eigenvalues) - np.log(eigenvalues[0])))
        value = np.log(weight.sum()) / self.power - np.log(eigenvalues[0])
        return float(value), np.asarray(-weight / (weight.sum() * eigenvalues))


@dataclass(frozen=True, slots=True, kw_only=True)
class Mixed(Criterion):
    """Smooth condition number minus `weight / n ln det M`: well conditioned and informative; the default.

    A condition number alone does not ask for large signals; a little of D-optimality buys a quarter less standard error
    for a few per cent of condition.
    """

    key: ClassVar[str] = "mixed"
    power: float = 16.0
    weight: float = 0.3

    def of_spectrum(self, eigenvalues: FloatArray) -> tuple[float, FloatArray]:
        """Return value and slope."""
        condition, slope = ConditionNumber(power=self.power).of_spectrum(eigenvalues)
        volume, volume_slope = DOptimal().of_spectrum(eigenvalues)
        share = self.weight / eigenvalues.size
        return condition + share * volume, slope + share * volume_slope


CRITERIA: dict[str, type[Criterion]] = {
    kind.key: kind for kind in (Mixed, ConditionNumber, DOptimal, AOptimal, EOptimal)
}
"""Every criterion by its name."""


def criterion_named(key: str) -> Criterion:
    """Return the criterion of this name in its default settings.

    Raises
    ------
    ExcitationError
        when there is none.
    """
    if key not in CRITERIA:
        raise ExcitationError("unknown criterion", expected=", ".join(CRITERIA), got=key)
    return CRITERIA[key]()
