"""What other programs take: URDF, MuJoCo and C code of a model, robot programs that run a designed motion."""

from tauhat.export.ccode import c_prefix, ccode
from tauhat.export.drives import CoupledMotors, LoadedGasSpring
from tauhat.export.exported import ExportedText
from tauhat.export.friction import FrictionLaw
from tauhat.export.identified import model_parameters, standard_parameters
from tauhat.export.mjcf import mjcf
from tauhat.export.new_urdf import new_urdf
from tauhat.export.parameters import StandardParameters, check_parameters, plain_parameters
from tauhat.export.plain_friction import Approximation, PlainFriction
from tauhat.export.urdf import FilledUrdf, fill_urdf
from tauhat.export.urscript import ServoSettings, check_six_revolute, urscript, write_urscript

__all__ = [
    "Approximation",
    "CoupledMotors",
    "ExportedText",
    "FilledUrdf",
    "FrictionLaw",
    "LoadedGasSpring",
    "PlainFriction",
    "ServoSettings",
    "StandardParameters",
    "c_prefix",
    "ccode",
    "check_parameters",
    "check_six_revolute",
    "fill_urdf",
    "mjcf",
    "model_parameters",
    "new_urdf",
    "plain_parameters",
    "standard_parameters",
    "urscript",
    "write_urscript",
]
