from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from robot_texts import TREE

from tauhat.errors import ArrayError, RobotError
from tauhat.robots import forward_kinematics, load_robot, pinocchio_model, robot_from_urdf


def test_a_batch_is_the_single_poses_stacked() -> None:
    robot = robot_from_urdf(TREE)
    q = np.random.default_rng(0).normal(size=(7, robot.n_v))
    batch = forward_kinematics(robot, q, frame="tool")
    singles = [forward_kinematics(robot, row, frame="tool") for row in q]
    np.testing.assert_allclose(batch.rotation, [pose.rotation for pose in singles], atol=1e-15)
    np.testing.assert_allclose(batch.translation, [pose.translation for pose in singles], atol=1e-15)
    assert batch.rotation.shape == (7, 3, 3)


def test_a_frame_on_the_base_does_not_move() -> None:
    robot = robot_from_urdf(TREE)
    poses = forward_kinematics(robot, np.random.default_rng(0).normal(size=(3, robot.n_v)), frame="world")
    np.testing.assert_array_equal(poses.translation, np.zeros((3, 3)))


def test_poses_are_read_only() -> None:
    pose = forward_kinematics(load_robot("two_link"), [0.0, 0.0], frame="tool")
    with pytest.raises(ValueError, match="read-only"):
        pose.translation[0] = 1.0


def test_an_unknown_frame_is_refused_with_advice() -> None:
    with pytest.raises(RobotError, match="no such frame; got tol; did you mean tool"):
        forward_kinematics(load_robot("two_link"), [0.0, 0.0], frame="tol")


@pytest.mark.parametrize(
    "q", [0.0, [0.0], [[0.0]], np.zeros((1, 1, 2)), [np.nan, 0.0], ["a", "b"], [[0.0], [0.0, 1.0]]]
)
def test_a_position_of_the_wrong_form_is_refused(q) -> None:
    with pytest.raises(ArrayError):
        forward_kinematics(load_robot("two_link"), q, frame="tool")


def test_the_pinocchio_model_carries_gravity_limits_and_frames() -> None:
    robot = load_robot("panda").with_gravity((0, 0, 9.81))
    model = pinocchio_model(robot)
    np.testing.assert_array_equal(model.gravity.linear, [0, 0, 9.81])
    np.testing.assert_array_equal(model.upperPositionLimit, robot.upper)
    np.testing.assert_array_equal(model.effortLimit, robot.effort_limit)
    assert {frame.name for frame in robot.frames} <= {frame.name for frame in model.frames}
    np.testing.assert_array_equal(model.armature, np.zeros(7))


def test_the_robots_room_is_imported_without_pinocchio() -> None:
    code = "import sys, tauhat.robots; sys.exit('pinocchio' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
