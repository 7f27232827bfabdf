"""Batched rigid-body dynamics, terms, torque models and base parameters."""

from tauhat.dynamics.barycentric import BarycentricParameters, barycentric_parameters
from tauhat.dynamics.base import BaseParameters, base_parameters, random_motion
from tauhat.dynamics.closed_form_base import closed_form_base
from tauhat.dynamics.forward import Masses, forward_dynamics, rotor_mass_matrix
from tauhat.dynamics.model import PLAIN_TERMS, ROBUST_TERMS, TERMS, TorqueModel, torque_model
from tauhat.dynamics.model_file import load_model
from tauhat.dynamics.motion import Motion, motion_from_rows
from tauhat.dynamics.rigid_body import bias_torque, gravity_torque, inverse_dynamics, mass_matrix, regressor
from tauhat.dynamics.small_terms import without_small_terms
from tauhat.dynamics.terms import Coulomb, Inertia, Offset, Parameter, RotorInertia, Term, Viscous
from tauhat.dynamics.terms.simplified import InertiaWithoutProducts

__all__ = [
    "PLAIN_TERMS",
    "ROBUST_TERMS",
    "TERMS",
    "BarycentricParameters",
    "BaseParameters",
    "Coulomb",
    "Inertia",
    "InertiaWithoutProducts",
    "Masses",
    "Motion",
    "Offset",
    "Parameter",
    "RotorInertia",
    "Term",
    "TorqueModel",
    "Viscous",
    "barycentric_parameters",
    "base_parameters",
    "bias_torque",
    "closed_form_base",
    "forward_dynamics",
    "gravity_torque",
    "inverse_dynamics",
    "load_model",
    "mass_matrix",
    "motion_from_rows",
    "random_motion",
    "regressor",
    "rotor_mass_matrix",
    "torque_model",
    "without_small_terms",
]
