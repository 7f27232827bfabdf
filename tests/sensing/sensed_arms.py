"""Arms whose torque along a motion is Pinocchio's, with what an observer knows of them."""

from __future__ import annotations

import numpy as np
import pinocchio

from tauhat.arrays import FloatArray
from tauhat.dynamics.passive_kernel import ELEMENT
from tauhat.dynamics.terms import Thermal
from tauhat.robots import Robot, load_robot
from tauhat.robots.kinematics import pinocchio_model
from tauhat.sensing.sensed_model import SensedModel
from tauhat.sensing.thermal import SensedHeat

RATE = 1000.0


def frictionless(name: str = "panda") -> SensedModel:
    robot = load_robot(name)
    nothing = np.zeros(0, dtype=ELEMENT)
    return SensedModel(
        robot=robot, inertia=robot.inertia, rotor=np.zeros(robot.n_v), sliding=nothing, bristles=nothing,
        rms=np.full(robot.n_v, 0.1), slow=np.full(robot.n_v, 0.02),
        heat=SensedHeat(term=Thermal(), slopes=np.zeros((robot.n_v, 2))),
    )  # fmt: skip


def motion(robot: Robot, seconds: float = 3.0, rate: float = RATE) -> tuple[FloatArray, FloatArray]:
    """Return position and torque (n_t, n_v) along a smooth motion, the torque by Pinocchio."""
    t, phase = np.arange(int(seconds * rate)) / rate, np.arange(robot.n_v)
    swing = 2.0 * t[:, None] + phase
    q, dq, ddq = 0.5 * np.sin(swing), np.cos(swing), -2.0 * np.sin(swing)
    model = pinocchio_model(robot)
    data = model.createData()
    return q, np.array([pinocchio.rnea(model, data, *state) for state in zip(q, dq, ddq, strict=True)])
