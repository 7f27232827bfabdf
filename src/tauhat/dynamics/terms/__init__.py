"""Terms: physical effects that add to a joint's torque and are linear in their parameters."""

from tauhat.dynamics.terms.bank import Bank
from tauhat.dynamics.terms.drives import GasSpring, RotorInertia, Spring
from tauhat.dynamics.terms.friction import (
    Asymmetric,
    Coulomb,
    CubeRoot,
    Offset,
    PolynomialFriction,
    Stribeck,
    Viscous,
    ViscousAsymmetry,
)
from tauhat.dynamics.terms.inertia import INERTIAL_SYMBOLS, Inertia
from tauhat.dynamics.terms.joint_term import JointTerm, ShapedTerm
from tauhat.dynamics.terms.load import LoadCoulomb, LoadDahl
from tauhat.dynamics.terms.presliding import Dahl
from tauhat.dynamics.terms.shaped import Shaped
from tauhat.dynamics.terms.shared_motors import Coupling, CouplingDahl
from tauhat.dynamics.terms.simplified import InertiaWithoutProducts
from tauhat.dynamics.terms.term import Facts, Parameter, Term
from tauhat.dynamics.terms.thermal import Thermal, ThermalMeasured

__all__ = [
    "INERTIAL_SYMBOLS",
    "Asymmetric",
    "Bank",
    "Coulomb",
    "Coupling",
    "CouplingDahl",
    "CubeRoot",
    "Dahl",
    "Facts",
    "GasSpring",
    "Inertia",
    "InertiaWithoutProducts",
    "JointTerm",
    "LoadCoulomb",
    "LoadDahl",
    "Offset",
    "Parameter",
    "PolynomialFriction",
    "RotorInertia",
    "Shaped",
    "ShapedTerm",
    "Spring",
    "Stribeck",
    "Term",
    "Thermal",
    "ThermalMeasured",
    "Viscous",
    "ViscousAsymmetry",
]
