"""Comparison with a known truth: what only a simulated experiment can tell about an estimate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray, read_only
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.terms import INERTIAL_SYMBOLS
from tauhat.errors import ModelError
from tauhat.estimation.estimate import Estimate
from tauhat.simulation.experiment import Truth
from tauhat.simulation.parameters import TrueParameters

CONFIDENCE = 0.95
_DRIVE_SYMBOLS: Mapping[str, str] = {"Ia": "rotor", "Fv": "viscous", "Fc": "coulomb", "To": "offset"}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TruthComparison:
    """How far an estimate is from the truth behind a simulated recording.

    values : (n_b,) true base parameters
    inside : (n_b,) whether the truth lies in the estimate's 95 % interval
    relative_rms : norm of the error over norm of the true, noise-free torque, all joints stacked
    joints : (n_v,) the same joint by joint
    """

    values: FloatArray
    inside: NDArray[np.bool_]
    relative_rms: float
    joints: FloatArray

    @property
    def share_inside(self) -> float:
        """Share of the base parameters whose 95 % interval holds the truth."""
        return float(self.inside.mean())

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "relative_rms": self.relative_rms,
            "joints": self.joints.tolist(),
            "inside_95": int(self.inside.sum()),
            "base_parameters": int(self.inside.size),
            "share_inside_95": self.share_inside,
        }


def standard_parameters(model: TorqueModel, truth: TrueParameters) -> FloatArray:
    """Return the true values of the model's standard parameters, (n_p,).

    Raises
    ------
    ModelError
        when the model has a parameter that the simulation knows nothing of.
    """
    return np.array([_true_value(truth, parameter.symbol, parameter.joint) for parameter in model.parameters])


def _true_value(truth: TrueParameters, symbol: str, joint: int) -> float:
    if symbol in INERTIAL_SYMBOLS:
        return float(truth.inertia[joint, INERTIAL_SYMBOLS.index(symbol)])
    if symbol in _DRIVE_SYMBOLS:
        return float(getattr(truth, _DRIVE_SYMBOLS[symbol])[joint])
    raise ModelError("the simulation has no such parameter", got=symbol)


def compare_with_truth(estimate: Estimate, truth: Truth) -> TruthComparison:
    """Return how far the estimate's parameters, and its torque along a motion, are from the truth.

    Parameters
    ----------
    truth : of a recording, best one that was not fitted
    """
    from scipy.special import stdtrit

    values = estimate.base.projection @ standard_parameters(estimate.model, truth.parameters)
    reach = float(stdtrit(max(1, estimate.degrees), 0.5 + 0.5 * CONFIDENCE))
    error = estimate.predict(truth.q, truth.dq, truth.ddq) - truth.tau
    size = np.linalg.norm(truth.tau, axis=0)
    return TruthComparison(
        values=read_only(values),
        inside=read_only(np.abs(estimate.values - values) <= reach * estimate.standard_errors),
        relative_rms=float(np.linalg.norm(error) / np.linalg.norm(truth.tau)),
        joints=read_only(np.linalg.norm(error, axis=0) / np.where(size > 0, size, np.inf)),
    )
