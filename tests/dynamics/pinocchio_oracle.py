"""What Pinocchio says, in the shapes of our own functions."""

from __future__ import annotations

import numpy as np
import pinocchio

from tauhat.arrays import FloatArray
from tauhat.robots import Robot, pinocchio_model


def mass_matrices(robot: Robot, q: FloatArray) -> FloatArray:
    """Return the mass matrix at each position, (n_t, n_v, n_v): Pinocchio fills the upper half."""
    model = pinocchio_model(robot)
    data = model.createData()
    upper = np.array([np.triu(pinocchio.crba(model, data, row).reshape(robot.n_v, robot.n_v)) for row in q])
    return upper + np.triu(upper, 1).transpose(0, 2, 1)
