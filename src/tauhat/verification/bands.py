"""Bands around a predicted torque: what the parameters' errors make of it, and what the model cannot say at all.

The covariance of an estimate tells how far the parameters may be off. It does not tell how far the torque of the real
robot is from any torque of this model: that is the residual of the fit, model error and noise together. The two are
stated apart, since more data narrows the first and only a better model the second.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from tauhat.arrays import FloatArray

CONFIDENCE = 0.95
NORMAL = 1.959963984540054  # half of a 95 % interval of the normal distribution, in deviations


@dataclass(frozen=True, slots=True, kw_only=True)
class PredictionBand:
    """The 95 % band of one joint's torque on one recording.

    parameters : half its width from the parameters' errors alone, root mean square [Nm or N]
    residual : half its width from the residual of the fit [Nm or N]
    covered_by_parameters : share of the rows in which the first holds the measured torque
    covered : share in which both together hold it, 0.95 where the recording is like the fitted ones
    """

    parameters: float
    residual: float
    covered_by_parameters: float
    covered: float

    def to_dict(self) -> dict[str, float]:
        """Return plain data."""
        return asdict(self)


def half_bands(parameters: FloatArray, level: FloatArray | float) -> FloatArray:
    """Return half the width of the whole band, `sqrt(parameters^2 + (1.96 level)^2)` [Nm or N].

    Parameters
    ----------
    parameters : half the width that the parameters' errors make [Nm or N]
    level : root mean square residual of the fit [Nm or N]
    """
    return np.asarray(np.hypot(parameters, NORMAL * np.asarray(level)))


def prediction_band(error: FloatArray, parameters: FloatArray, *, level: float) -> PredictionBand:
    """Return how wide a joint's band is and how often it holds.

    Parameters
    ----------
    error : (n,) measured less predicted torque [Nm or N]
    parameters : (n,) half the width that the parameters' errors make [Nm or N]
    level : root mean square residual of the fit [Nm or N]
    """
    size = np.abs(error)
    return PredictionBand(
        parameters=float(np.sqrt(np.mean(parameters**2))),
        residual=NORMAL * level,
        covered_by_parameters=float(np.mean(size <= parameters)),
        covered=float(np.mean(size <= half_bands(parameters, level))),
    )
