"""The filter that position and torque share on their way in: a causal low-pass of second order, with its derivatives.

    y'' = w^2 (u - y) - sqrt(2) w y',   w = 2 pi cutoff        (Butterworth)
Between samples u is taken as straight, for which the step `x+ = Phi x + G0 u + G1 u+`, x = (y, y'), is exact; so y, y'
and y'' are those of one filtered position, and torque behind the same filter is late by the same time, 0.23 / cutoff.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from tauhat.arrays import FloatArray, read_only
from tauhat.errors import SensingError

_DAMPING = np.sqrt(2.0)
HIGHEST = 0.45  # of the sample rate: a filter nearer to half of it is none


@dataclass(frozen=True, slots=True, kw_only=True)
class CausalFilter:
    """A low-pass at one sample rate.

    cutoff : [Hz], at most 0.45 of the rate
    step : between samples [s]
    """

    cutoff: float
    step: float

    def __post_init__(self) -> None:
        if not 0.0 < self.step < np.inf:
            raise SensingError("time between samples", expected="above zero", got=f"{self.step} s")
        if not 0.0 < self.cutoff <= HIGHEST / self.step:
            raise SensingError(
                "cut-off of the filter", expected=f"0 to {HIGHEST / self.step:.4g} Hz at {1.0 / self.step:.4g} Hz",
                got=f"{self.cutoff:g} Hz", remedy="a lower cut-off, or a log of a higher rate",
            )  # fmt: skip

    @property
    def stiffness(self) -> float:
        """`w^2` [1/s^2]."""
        return float((2.0 * np.pi * self.cutoff) ** 2)

    @property
    def damping(self) -> float:
        """`sqrt(2) w` [1/s]."""
        return float(_DAMPING * 2.0 * np.pi * self.cutoff)

    @property
    def numbers(self) -> FloatArray:
        """Phi row by row, G0, G1, stiffness and damping, (10,), as the kernel reads them."""
        whole = np.zeros((4, 4))  # d/ds of y, y', u, slope of u
        whole[0, 1] = 1.0
        whole[1, :3] = -self.stiffness, -self.damping, self.stiffness
        whole[2, 3] = 1.0
        over = expm(whole * self.step)
        later = over[:2, 3] / self.step
        return read_only(
            np.array([*over[:2, :2].ravel(), *(over[:2, 2] - later), *later, self.stiffness, self.damping])
        )
