"""Orientations as controllers write them: rotation vectors, quaternions, three angles."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from tauhat.arrays import FloatArray
from tauhat.errors import ExportError
from tauhat.robots.kinematics import Pose

_UNIT = 1e-4  # how far a quaternion's length may be from 1


def zyx_angles(rotation: FloatArray) -> tuple[float, float, float]:
    """Return z, y, x of `R = Rz(z) Ry(y) Rx(x)`, y within a right angle [rad].

    About moving axes first z, then y, then x (KUKA's A, B, C), or about fixed axes first x, then y, then z (FANUC's
    W, P, R in the opposite order). x is taken after z is turned back, so that the product is exact to rounding also
    where y is nearly a right angle and z alone means little.
    """
    z = float(np.arctan2(rotation[1, 0], rotation[0, 0]))
    y = float(np.arctan2(-rotation[2, 0], np.hypot(rotation[0, 0], rotation[1, 0])))
    sine, cosine = np.sin(z), np.cos(z)
    across = sine * rotation[0, 2] - cosine * rotation[1, 2]
    along = cosine * rotation[1, 1] - sine * rotation[0, 1]
    return z, y, float(np.arctan2(across, along))


def rotation_of_zyx(z: float, y: float, x: float) -> FloatArray:
    """Return `Rz(z) Ry(y) Rx(x)`, (3, 3)."""
    (sz, cz), (sy, cy), (sx, cx) = ((np.sin(angle), np.cos(angle)) for angle in (z, y, x))
    return np.array([
        [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
        [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
        [-sy, cy * sx, cy * cx],
    ])  # fmt: skip


def rotation_of_quaternion(wxyz: FloatArray) -> FloatArray:
    """Return the rotation of a quaternion w, x, y, z of length 1, (3, 3).

    Raises
    ------
    ExportError
        when it has another length.
    """
    length = float(np.linalg.norm(wxyz))
    if abs(length - 1.0) > _UNIT:
        raise ExportError("a quaternion that is no orientation", expected="length 1", got=f"{length:.6g}")
    w, x, y, z = wxyz
    return np.asarray(Rotation.from_quat([x, y, z, w]).as_matrix())


def pose_in_degrees(pose: Pose) -> FloatArray:
    """Return place [mm] and the angles z, y, x [deg] of a pose, (6,)."""
    return np.concatenate([1e3 * pose.translation, np.rad2deg(zyx_angles(pose.rotation))])


def pose_of_degrees(values: FloatArray) -> Pose:
    """Return the pose of a place [mm] and the angles z, y, x [deg], (6,)."""
    return Pose(rotation=rotation_of_zyx(*np.deg2rad(values[3:])), translation=values[:3] / 1e3)
