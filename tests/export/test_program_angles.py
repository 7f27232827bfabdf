"""Orientations as controllers write them, against SciPy and Pinocchio."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from tauhat.errors import ExportError
from tauhat.export.programs.angles import (
    rotation_of_quaternion,
    rotation_of_zyx,
    zyx_angles,
)
from tauhat.robots.transforms import quaternion, rotation_of_vector, rotation_vector

RANDOM = Rotation.random(200, random_state=5).as_matrix()


def test_angles_are_those_about_moving_axes_z_y_x_and_about_fixed_axes_x_y_z():
    for rotation in RANDOM:
        z, y, x = zyx_angles(rotation)
        assert [z, y, x] == pytest.approx(Rotation.from_matrix(rotation).as_euler("ZYX"), abs=1e-12)
        assert [x, y, z] == pytest.approx(Rotation.from_matrix(rotation).as_euler("xyz"), abs=1e-12)
        assert [x, y, z] == pytest.approx(pin.rpy.matrixToRpy(rotation), abs=1e-12)
        assert rotation_of_zyx(z, y, x) == pytest.approx(pin.rpy.rpyToMatrix(x, y, z), abs=1e-14)


@pytest.mark.parametrize("y", [np.pi / 2, -np.pi / 2, np.pi / 2 - 1e-9, -np.pi / 2 + 1e-8, 1.5])
def test_angles_give_the_same_orientation_near_a_right_angle_too(y: float):
    for x, z in np.random.default_rng(4).uniform(-np.pi, np.pi, (50, 2)):
        rotation = pin.rpy.rpyToMatrix(x, y, z)
        assert rotation_of_zyx(*zyx_angles(rotation)) == pytest.approx(rotation, abs=1e-14)


def test_a_rotation_vector_is_the_logarithm_and_a_quaternion_has_w_first():
    for rotation in RANDOM:
        assert rotation_vector(rotation) == pytest.approx(pin.log3(rotation), abs=1e-9)
        assert rotation_of_vector(rotation_vector(rotation)) == pytest.approx(rotation, abs=1e-12)
        w, x, y, z = quaternion(rotation)
        assert w >= 0.0
        assert pin.Quaternion(w, x, y, z).toRotationMatrix() == pytest.approx(rotation, abs=1e-12)
        assert rotation_of_quaternion(np.array([w, x, y, z])) == pytest.approx(rotation, abs=1e-12)


def test_a_quaternion_of_another_length_is_refused():
    with pytest.raises(ExportError, match=r"length 1, got 1\.1"):
        rotation_of_quaternion(np.array([1.1, 0.0, 0.0, 0.0]))
