"""Passive laws of the plant: friction of every kind the library identifies, shared motors, springs."""

from tauhat.simulation.laws.law import JointLaw, JointState, PassiveLaw
from tauhat.simulation.laws.load import LoadedBristles, LoadedCoulomb
from tauhat.simulation.laws.presliding import Bristles
from tauhat.simulation.laws.shared_drive import SharedDrive
from tauhat.simulation.laws.speed_laws import (
    CubeRootDrag,
    DirectionalFriction,
    DirectionalViscous,
    PolynomialDrag,
    SmoothCoulomb,
    StribeckBump,
)
from tauhat.simulation.laws.springs import BalancingSpring, GasCylinder
from tauhat.simulation.laws.table import LAWS, law_from_dict

__all__ = [
    "LAWS",
    "BalancingSpring",
    "Bristles",
    "CubeRootDrag",
    "DirectionalFriction",
    "DirectionalViscous",
    "GasCylinder",
    "JointLaw",
    "JointState",
    "LoadedBristles",
    "LoadedCoulomb",
    "PassiveLaw",
    "PolynomialDrag",
    "SharedDrive",
    "SmoothCoulomb",
    "StribeckBump",
    "law_from_dict",
]
