"""Comparison with a known truth: what only a simulated experiment can tell about an estimate."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray, read_only
from tauhat.dynamics.model import TorqueModel
from tauhat.estimation.estimate import Estimate
from tauhat.recordings.recording import Recording
from tauhat.simulation.experiment import Truth
from tauhat.simulation.parameters import TrueParameters
from tauhat.verification.prediction import predict_recording

CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TruthComparison:
    """How far an estimate is from the truth behind a simulated recording.

    values : (n_b,) true base parameters
    inside : (n_b,) whether the truth lies in the estimate's 95 % interval
    relative_rms : norm of the error over norm of the true, noise-free torque, all joints stacked, through the filters
        of the estimate without its delay: the truth has none
    joints : the same joint by joint
    """

    values: FloatArray
    inside: NDArray[np.bool_]
    relative_rms: float
    joints: tuple[float, ...]

    @property
    def share_inside(self) -> float:
        """Share of the base parameters whose 95 % interval holds the truth."""
        return float(self.inside.mean())

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "relative_rms": self.relative_rms,
            "joints": list(self.joints),
            "inside_95": int(self.inside.sum()),
            "base_parameters": int(self.inside.size),
            "share_inside_95": self.share_inside,
        }


def standard_parameters(model: TorqueModel, truth: TrueParameters) -> FloatArray:
    """Return the true values of the model's standard parameters, (n_p,).

    Raises
    ------
    SimulationError
        when the model has a parameter that the simulation knows nothing of.
    """
    return np.array([truth.value(parameter.symbol, parameter.joint) for parameter in model.parameters])


def compare_with_truth(
    estimate: Estimate, truth: Truth, *, torque_side: Literal["motor", "link"] = "motor"
) -> TruthComparison:
    """Return how far the estimate's parameters, and its torque along a motion, are from the truth.

    Parameters
    ----------
    truth : of a recording, best one that was not fitted
    torque_side : where the torque of the fitted recordings was measured, as in `SensorErrors`: behind the gear there is
        no friction of the drive and no rotor. Both are torques of the joint [Nm or N]
    """
    motors = torque_side == "motor"
    plant = truth.parameters if motors else truth.parameters.behind_gear()
    values = estimate.base.projection @ standard_parameters(estimate.model, plant)
    at_once = replace(estimate.processing, delay=0.0)
    recording = _noise_free(estimate, truth, truth.tau if motors else truth.gear_torque)
    prediction = predict_recording(estimate, recording, processing=at_once)
    return TruthComparison(
        values=read_only(values),
        inside=read_only(np.abs(estimate.values - values) <= estimate.half_intervals(confidence=CONFIDENCE)),
        relative_rms=prediction.relative_rms,
        joints=tuple(joint.relative_rms for joint in prediction.joints),
    )


def _noise_free(estimate: Estimate, truth: Truth, tau: FloatArray) -> Recording:
    """Return the recording that perfect sensors would have made."""
    return Recording(
        t=truth.reference.t,
        q=truth.q,
        dq=truth.dq,
        tau=tau,
        joint_names=estimate.robot.joint_names,
        name="truth",
    )
