"""The pseudo-inertia of a rigid body: four by four, positive definite exactly when a body of positive density has it.

    J = [[ tr(I)/2 E - I,  m c ],
         [ (m c)',          m  ]]       (the second, first and zeroth moments of mass)

J is linear in the ten inertial parameters `m, mx, my, mz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz` about the frame's origin; the
triangle inequality of the principal moments and a positive mass are both contained in `J > 0`.

Source: Wensing, Kim, Slotine, "Linear matrix inequalities for physically consistent inertial parameter
identification", 2018.
"""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray, read_only

SIZE = 10  # independent entries of a symmetric four by four matrix, as many as inertial parameters
_ROWS = np.array([row for column in range(4) for row in range(column + 1)])
_COLUMNS = np.array([column for column in range(4) for _ in range(column + 1)])
_WEIGHTS = np.where(_ROWS == _COLUMNS, 1.0, np.sqrt(2.0))
_MOMENTS = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))  # Ixx, Ixy, Iyy, Ixz, Iyz, Izz


def _basis() -> FloatArray:
    basis = np.zeros((SIZE, 4, 4))
    basis[0, 3, 3] = 1.0
    for axis in range(3):
        basis[1 + axis, axis, 3] = basis[1 + axis, 3, axis] = 1.0
    for index, (row, column) in enumerate(_MOMENTS):
        inertia = np.zeros((3, 3))
        inertia[row, column] = inertia[column, row] = 1.0
        basis[4 + index, :3, :3] = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    return read_only(basis)


BASIS = _basis()  # (10, 4, 4): J = sum_k parameter_k BASIS[k]


def pseudo_inertia(parameters: FloatArray) -> FloatArray:
    """Return J, (..., 4, 4), of inertial parameters (..., 10)."""
    return np.asarray(np.tensordot(parameters, BASIS, axes=(-1, 0)))


def inertial_parameters(pseudo: FloatArray) -> FloatArray:
    """Return the ten parameters, (..., 10), of pseudo-inertias (..., 4, 4): the inverse of `pseudo_inertia`."""
    second = pseudo[..., :3, :3]
    inertia = np.trace(second, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) - second
    moments = np.stack([inertia[..., row, column] for row, column in _MOMENTS], axis=-1)
    return np.concatenate([pseudo[..., 3, 3, None], pseudo[..., :3, 3], moments], axis=-1)


def stacked(symmetric: FloatArray) -> FloatArray:
    """Return the upper triangle column by column, (..., 10), off-diagonals times sqrt(2): dot products are traces."""
    return np.asarray(symmetric[..., _ROWS, _COLUMNS] * _WEIGHTS)


def unstacked(stack: FloatArray) -> FloatArray:
    """Return the symmetric matrix, (..., 4, 4), of a stack (..., 10)."""
    symmetric = np.empty((*stack.shape[:-1], 4, 4))
    symmetric[..., _ROWS, _COLUMNS] = symmetric[..., _COLUMNS, _ROWS] = stack / _WEIGHTS
    return symmetric


def margins(parameters: FloatArray) -> FloatArray:
    """Return the smallest eigenvalue of each pseudo-inertia over its trace, (...,); positive for a physical body.

    For a link near its frame's origin this is about the square of its thinnest extent (root mean square) [m^2].
    """
    values = np.linalg.eigvalsh(pseudo_inertia(parameters))
    trace = values.sum(axis=-1)
    return np.asarray(values[..., 0] / np.where(trace != 0.0, np.abs(trace), 1.0))


def pushed_inside(parameters: FloatArray, margin: float) -> FloatArray:
    """Return the parameters (..., 10) with as much of E added to J as the margin lacks; unchanged where it holds."""
    pseudo = pseudo_inertia(parameters)
    values = np.linalg.eigvalsh(pseudo)
    lacking = np.maximum(margin * values.sum(axis=-1) - values[..., 0], 0.0) / (1.0 - 4.0 * margin)
    pushed = inertial_parameters(pseudo + lacking[..., None, None] * np.eye(4))
    return np.where(lacking[..., None] > 0.0, pushed, parameters)
