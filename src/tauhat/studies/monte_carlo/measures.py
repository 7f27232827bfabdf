"""What estimates with a known truth are judged by: errors of parameters and of torque that can be compared."""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray, read_only
from tauhat.dynamics.base import BaseParameters
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.motion import motion_from_rows
from tauhat.excitation.trajectory import MotionSamples


def model_torque(model: TorqueModel, standard: FloatArray, motion: MotionSamples) -> FloatArray:
    """Return the torque of standard parameters (n_p,) along a motion, (n_t, n_v) [Nm or N]."""
    layout = model.layout()
    columns, _ = model.columns(motion_from_rows(motion.q, motion.dq, motion.ddq), layout)
    weights = standard[layout.parameters]
    joints = [layout.of_joint(joint) for joint in range(model.robot.n_v)]
    return np.ascontiguousarray(np.array([weights[rows] @ columns[rows] for rows in joints]).T)


def column_sizes(model: TorqueModel, base: BaseParameters, motion: MotionSamples, torque: FloatArray) -> FloatArray:
    """Return what one unit of each base parameter does to the torque along a motion, (n_b,).

    `s_i^2 = sum over joints j of mean_t(Y_ji^2) / mean_t(tau_j^2)`: each joint in parts of its own torque.

    Parameters
    ----------
    torque : (n_t, n_v) of the motion [Nm or N]
    """
    layout = model.layout(base.independent)
    columns, _ = model.columns(motion_from_rows(motion.q, motion.dq, motion.ddq), layout)
    place = np.full(len(base.names), -1)
    place[base.independent] = np.arange(base.n_b)
    squares = np.zeros(base.n_b)
    for joint, level in enumerate(np.mean(torque**2, axis=0)):
        rows = layout.of_joint(joint)
        np.add.at(squares, place[layout.parameters[rows]], np.mean(columns[rows] ** 2, axis=1) / level)
    return read_only(np.sqrt(squares))


def relative_error(values: FloatArray, truth: FloatArray, sizes: FloatArray) -> float:
    """Return `|s (x - x*)| / |s x*|`: the error of all parameters in units of the torque that each makes.

    Kilograms, kilogram metres and newton metres cannot be added; what they do to the torque can, and a parameter that
    does nothing does not hide the others.

    Parameters
    ----------
    values, truth : (n_b,) base parameters
    sizes : (n_b,) of their columns, `column_sizes`
    """
    return float(np.linalg.norm(sizes * (values - truth)) / np.linalg.norm(sizes * truth))
