"""A force as an arrow and its error as an ellipsoid: what a scene draws, and what it has to leave out."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray

SURE_IN_SPACE = 2.7955  # standard errors that hold 95 % of a normal error in three dimensions: root of 7.8147
SURE_ON_LINE = 1.95996  # and in one
_STEPS = (1.0, 2.0, 5.0, 10.0)
_THIN = 1e-3  # smallest half-axis that is drawn, in parts of the largest allowed
_ROUNDING = 1e-9
_SMALLER = 0.35  # of a scale: below the step from 5 to 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ErrorEllipsoid:
    """Where the force is with 95 % probability, around its measured value.

    axes : (3, 3) a rotation, unit directions in columns
    half : (3,) half-axes [N], ascending
    drawn : (3,) half-axes as drawn [N]: cut off where the joints tell too little
    """

    axes: FloatArray
    half: FloatArray
    drawn: FloatArray

    @property
    def widest(self) -> float:
        """Largest half-axis [N]."""
        return float(self.half[-1])

    @property
    def bar(self) -> float:
        """Error bar along the largest half-axis alone, 95 % of a normal error in one dimension [N]."""
        return self.widest * SURE_ON_LINE / SURE_IN_SPACE

    @property
    def cut(self) -> FloatArray:
        """Directions along which it is cut off, (n, 3)."""
        return np.asarray(self.axes.T[self.half > self.drawn * (1.0 + _ROUNDING)])


def error_ellipsoid(covariance: FloatArray, *, largest: float) -> ErrorEllipsoid:
    """Return the 95 % ellipsoid of a force, by the eigenvectors of its covariance.

    Parameters
    ----------
    covariance : (3, 3) [N^2]; directions of zero variance are flat
    largest : half-axis beyond which it is cut off [N]
    """
    shares, axes = np.linalg.eigh(0.5 * (covariance + covariance.T))
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] *= -1.0
    half = SURE_IN_SPACE * np.sqrt(np.maximum(shares, 0.0))
    return ErrorEllipsoid(axes=axes, half=half, drawn=np.clip(half, _THIN * largest, largest))


def full_scale(largest: float, *, least: float, current: float = 0.0) -> float:
    """Return the smallest of 1, 2, 5, 10, 20 ... that is no smaller than a value, and than `least`.

    Parameters
    ----------
    current : the scale so far, which stays until the value is clearly smaller, so that nothing flickers
    """
    value = max(largest, least)
    if _SMALLER * current < value <= current:
        return current
    decade = 10.0 ** math.floor(math.log10(value))
    return next(step * decade for step in _STEPS if step * decade >= value * (1.0 - _ROUNDING))


def direction_text(direction: FloatArray) -> str:
    """Return a direction in words where it is nearly an axis, else as three numbers; its sign says nothing."""
    main = int(np.argmax(np.abs(direction)))
    if abs(direction[main]) > 0.97:
        return "xyz"[main]
    turned = np.round(direction * np.sign(direction[main]), 1) + 0.0  # no minus before a zero
    return f"({', '.join(f'{value:+.1f}' for value in turned)})"
