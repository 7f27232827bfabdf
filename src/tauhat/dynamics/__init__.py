"""Batched rigid-body dynamics, terms, torque models and base parameters."""

from tauhat.dynamics.base import BaseParameters, base_parameters, random_motion
from tauhat.dynamics.model import PLAIN_TERMS, TERMS, TorqueModel, torque_model
from tauhat.dynamics.motion import Motion, motion_from_rows
from tauhat.dynamics.rigid_body import bias_torque, gravity_torque, inverse_dynamics, mass_matrix, regressor
from tauhat.dynamics.terms import Coulomb, Inertia, Offset, Parameter, RotorInertia, Term, Viscous

__all__ = [
    "PLAIN_TERMS",
    "TERMS",
    "BaseParameters",
    "Coulomb",
    "Inertia",
    "Motion",
    "Offset",
    "Parameter",
    "RotorInertia",
    "Term",
    "TorqueModel",
    "Viscous",
    "base_parameters",
    "bias_torque",
    "gravity_torque",
    "inverse_dynamics",
    "mass_matrix",
    "motion_from_rows",
    "random_motion",
    "regressor",
    "torque_model",
]
