"""What a robot's description says of the parameters of a model."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.terms import INERTIAL_SYMBOLS

DESCRIBED_DRIVES: Mapping[str, str] = {"Ia": "rotor_inertia", "Fv": "viscous", "Fc": "coulomb"}
"""Symbol of a drive's parameter -> the field of a joint that states it."""


def nominal_standard_parameters(model: TorqueModel) -> FloatArray:
    """Return the standard parameters that the robot's description has, (n_p,); zero where it says nothing."""
    robot = model.robot
    values = []
    for parameter in model.parameters:
        if parameter.symbol in INERTIAL_SYMBOLS:
            values.append(float(robot.inertia[parameter.joint, INERTIAL_SYMBOLS.index(parameter.symbol)]))
        else:
            name = DESCRIBED_DRIVES.get(parameter.symbol, "")
            values.append(float(getattr(robot.joints[parameter.joint], name)) if name else 0.0)
    return np.array(values)
