"""Joint positions from poses, checked by the forward kinematics, which is other code."""

from __future__ import annotations

import numpy as np
import pytest

from sample_arms import WORKING_POSES, chain
from tauhat.errors import RobotError
from tauhat.robots import (
    Pose,
    Robot,
    forward_kinematics,
    inverse_kinematics,
    load_robot,
    singularity_distance,
)
from tauhat.robots.inverse_kinematics import FrameKinematics


def tool(robot: Robot) -> str:
    return robot.frames[-1].name if robot.frames else robot.joint_names[-1]


@pytest.mark.parametrize("name", WORKING_POSES)
def test_positions_found_from_a_seed_nearby_have_the_pose(name: str):
    robot, seed, rng = load_robot(name), WORKING_POSES[name], np.random.default_rng(3)
    for _ in range(8):
        pose = forward_kinematics(robot, seed + rng.uniform(-0.3, 0.3, robot.n_v), frame=tool(robot))
        q = inverse_kinematics(robot, pose, seed=seed, frame=tool(robot))
        reached = forward_kinematics(robot, q, frame=tool(robot))
        assert np.abs(reached.translation - pose.translation).max() < 1e-10
        assert np.abs(reached.rotation - pose.rotation).max() < 1e-10
        assert not q.flags.writeable


def test_an_arm_of_six_joints_keeps_the_configuration_of_the_seed():
    robot, seed = load_robot("ur5e"), WORKING_POSES["ur5e"]
    wanted = seed + np.array([0.2, -0.1, 0.15, 0.1, 0.2, -0.3])
    pose = forward_kinematics(robot, wanted, frame="tool")
    assert np.abs(inverse_kinematics(robot, pose, seed=seed, frame="tool") - wanted).max() < 1e-9


def test_positions_beyond_a_limit_are_turned_back_into_it():
    robot, seed = load_robot("crs_a465"), np.array([3.0, 0.3, 1.2, 0.1, 1.0, 0.0])
    pose = forward_kinematics(robot, seed + np.array([0.3, 0, 0, 0, 0, 0]), frame="tool")
    q = inverse_kinematics(robot, pose, seed=seed, frame="tool")
    assert q[0] == pytest.approx(3.3 - 2 * np.pi, abs=1e-9)


def test_jacobian_and_drift_are_the_derivatives_of_the_forward_kinematics():
    rng = np.random.default_rng(0)
    for robot in (load_robot("panda"), chain(rng, "RPRPRR")):
        q, dq, h = rng.uniform(-0.6, 0.6, robot.n_v), rng.normal(size=robot.n_v), 1e-4
        kinematics = FrameKinematics(robot, tool(robot))
        placement = kinematics.at(q)
        ahead, here, behind = (forward_kinematics(robot, q + s * h * dq, frame=tool(robot)) for s in (1.0, 0.0, -1.0))
        np.testing.assert_allclose(placement.translation, here.translation, atol=1e-14)
        velocity = (ahead.translation - behind.translation) / (2 * h)
        np.testing.assert_allclose((placement.jacobian @ dq)[:3], velocity, atol=1e-7)
        spin = (ahead.rotation - behind.rotation) / (2 * h) @ here.rotation.T
        np.testing.assert_allclose((placement.jacobian @ dq)[3:], [spin[2, 1], spin[0, 2], spin[1, 0]], atol=1e-7)
        second = (ahead.translation - 2 * here.translation + behind.translation) / h**2
        np.testing.assert_allclose(kinematics.drift(q, dq)[:3], second, atol=1e-5)
        turn = ahead.rotation - 2 * here.rotation + behind.rotation
        change = (turn / h**2) @ here.rotation.T  # R'' R^T = [dw] + [w]^2; the square is symmetric
        skew = 0.5 * (change - change.T)
        np.testing.assert_allclose(kinematics.drift(q, dq)[3:], [skew[2, 1], skew[0, 2], skew[1, 0]], atol=1e-5)


def test_a_stretched_elbow_and_an_aligned_wrist_are_singular():
    robot, q = load_robot("ur5e"), WORKING_POSES["ur5e"]
    assert singularity_distance(robot, q, frame="tool") > 0.1
    for joint in (2, 4):
        bad = q.copy()
        bad[joint] = 0.0
        assert singularity_distance(robot, bad, frame="tool") < 1e-6


def test_a_pose_out_of_reach_is_refused_with_how_far_it_is():
    robot = load_robot("ur5e")
    far = Pose(rotation=np.eye(3), translation=np.array([2.0, 0.0, 0.3]))
    with pytest.raises(RobotError, match=r"ur5e, frame tool: the pose is not reached; got 1\d{3} mm and .* rad away"):
        inverse_kinematics(robot, far, seed=WORKING_POSES["ur5e"], frame="tool")


def test_a_singular_pose_is_refused_by_name():
    robot, q = load_robot("ur5e"), WORKING_POSES["ur5e"].copy()
    q[4] = 1e-3
    pose = forward_kinematics(robot, q, frame="tool")
    with pytest.raises(RobotError, match=r"singular position only; expected smallest singular value >= 0.01"):
        inverse_kinematics(robot, pose, seed=q, frame="tool")
    assert np.abs(inverse_kinematics(robot, pose, seed=q, frame="tool", singular=1e-6) - q).max() < 1e-9


def test_a_pose_beyond_a_range_is_refused_with_the_joint():
    robot, q = load_robot("crs_a465"), np.array([0.2, 1.5, 0.6, 0.1, 1.0, 0.0])
    pose = forward_kinematics(robot, q + np.array([0, 0.2, 0, 0, 0, 0]), frame="tool")
    with pytest.raises(RobotError, match=r"outside the limits of joint_2 only; expected -1.5708 to 1.5708, got 1.7"):
        inverse_kinematics(robot, pose, seed=q, frame="tool")


def test_an_unknown_frame_is_refused():
    with pytest.raises(RobotError, match="no such frame"):
        singularity_distance(load_robot("ur5e"), WORKING_POSES["ur5e"], frame="tol")
