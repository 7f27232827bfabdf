"""The identified model as a controller takes it: its torque, one state at a time."""

from __future__ import annotations

from tauhat.control.model_torque import ModelTorque, model_torque
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.rotor_load import standard_with_rotors


def identified_torque(estimate: Estimate) -> ModelTorque:
    """Return the torque of an estimate, with all its terms, for feedforward and computed torque.

    Friction that the fit made with a plain sign gets one that turns within 1e-3 rad/s or m/s. Friction that grows with
    the load is loaded by these links, as in simulation; `Estimate.predict` takes those of the pass before.

    Raises
    ------
    ModelError
        when a term has no value at a single state: friction that warms up.
    """
    return model_torque(estimate.model, standard_with_rotors(estimate.model, estimate.base, estimate.values))
