"""The linear map that takes a body's ten inertial parameters from one frame to another."""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray

_TENSOR = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))  # of Ixx, Ixy, Iyy, Ixz, Iyz, Izz


def inertia_change(pose: FloatArray) -> FloatArray:
    """Return the matrix (10, 10) that takes parameters given in a frame to those in the frame where it has `pose`.

    With the pseudo-inertia `J = [[S, h], [h', m]]`, `S = tr(I)/2 E - I`, `h = (mx, my, mz)`, a change of frame by the
    homogeneous transform T is `J -> T J T'`, which is linear in the parameters, whether or not they belong to a body.

    Parameters
    ----------
    pose : (4, 4) of the old frame in the new one

    Source: Wensing, Kim, Slotine, "Linear matrix inequalities for physically consistent inertial parameter
    identification", 2018.
    """
    moved = [_parameters(pose @ _pseudo_inertia(unit) @ pose.T) for unit in np.eye(10)]
    return np.column_stack(moved)


def _pseudo_inertia(parameters: FloatArray) -> FloatArray:
    tensor = np.zeros((3, 3))
    for (row, column), value in zip(_TENSOR, parameters[4:], strict=True):
        tensor[row, column] = tensor[column, row] = value
    pseudo = np.zeros((4, 4))
    pseudo[:3, :3] = 0.5 * np.trace(tensor) * np.eye(3) - tensor
    pseudo[:3, 3] = pseudo[3, :3] = parameters[1:4]
    pseudo[3, 3] = parameters[0]
    return pseudo


def _parameters(pseudo: FloatArray) -> FloatArray:
    second = pseudo[:3, :3]
    tensor = np.trace(second) * np.eye(3) - second
    return np.array([pseudo[3, 3], *pseudo[:3, 3], *(tensor[entry] for entry in _TENSOR)])
