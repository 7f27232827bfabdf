"""Modified DH frames: the same robot in other joint frames, whatever frames it was described in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robot_texts import dh_text
from scipy.spatial.transform import Rotation

from sample_arms import chain, planar_arm, random_states, random_tree
from tauhat.dynamics import inverse_dynamics
from tauhat.robots import Robot, builtin_names, forward_kinematics, load_robot, robot_from_dh
from tauhat.robots.inertia_change import inertia_change
from tauhat.robots.modified_dh import PARALLEL, modified_dh, with_modified_frames
from tauhat.robots.transforms import homogeneous, moved_inertia


def pose(robot: Robot, q: np.ndarray, frame: str) -> np.ndarray:
    found = forward_kinematics(robot, q, frame=frame)
    return homogeneous(found.rotation, found.translation)


def boxy_tree(seed: int, n_v: int) -> Robot:
    """Return a tree whose axes are parallel, anti-parallel, perpendicular, meeting or coaxial as often as not."""
    rng = np.random.default_rng(seed)
    joints = []
    for joint in random_tree(rng, n_v).joints:
        turned = np.eye(3)[rng.permutation(3)] * rng.choice([-1.0, 1.0], 3)[:, None]
        turned[0] *= np.linalg.det(turned)
        place, axis = rng.choice([0.0, 0.0, 0.3, -0.5], 3), np.eye(3)[rng.integers(3)]
        joints.append(replace(joint, rotation=turned, translation=place, axis=axis))
    return Robot(name="boxy", joints=tuple(joints))


def any_robot(seed: int, n_v: int) -> Robot:
    return boxy_tree(seed, n_v) if seed % 2 else random_tree(np.random.default_rng(seed), n_v)


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000), n_v=st.integers(1, 7))
def test_own_frames_follow_from_the_dh_frames_in_every_position(seed, n_v):
    robot = any_robot(seed, n_v)
    table, moved = modified_dh(robot), with_modified_frames(robot)
    q = np.random.default_rng(seed).uniform(-3.0, 3.0, n_v)
    for index, name in enumerate(robot.joint_names):
        assert np.allclose(pose(moved, q, name) @ table.links[index], pose(robot, q, name), rtol=0, atol=1e-9)
    assert table.tilt < 1e-12


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000), n_v=st.integers(2, 7))
def test_z_lies_along_the_joint_and_x_along_the_normal_to_the_next_axis(seed, n_v):
    robot = any_robot(seed, n_v)
    moved, q = with_modified_frames(robot), np.zeros(n_v)
    poses = [pose(moved, q, name) for name in moved.joint_names]
    for index, joint in enumerate(robot.joints):
        own = pose(robot, q, joint.name)
        assert np.allclose(poses[index][:3, 2], own[:3, :3] @ joint.axis, rtol=0, atol=1e-9)
        child = next((k for k, other in enumerate(robot.joints) if other.parent == index), None)
        if child is not None:
            x = poses[index][:3, 0]
            gap = poses[child][:3, 3] - poses[index][:3, 3]
            assert abs(x @ poses[child][:3, 2]) < 1e-9
            assert abs(gap - (gap @ x) * x - (gap @ poses[child][:3, 2]) * poses[child][:3, 2]).max() < 1e-9


@settings(max_examples=15)
@given(seed=st.integers(0, 10_000), n_v=st.integers(1, 6))
def test_inertias_move_along_with_the_frames(seed, n_v):
    robot = any_robot(seed, n_v)
    states = random_states(np.random.default_rng(seed), 5, n_v)
    before, after = inverse_dynamics(robot, *states), inverse_dynamics(with_modified_frames(robot), *states)
    assert np.allclose(after, before, rtol=0, atol=1e-9 * max(1.0, np.abs(before).max()))


@pytest.mark.parametrize("name", builtin_names())
def test_builtin_arms_keep_the_poses_of_all_their_named_frames(name):
    robot = load_robot(name)
    moved, q = with_modified_frames(robot), np.random.default_rng(0).uniform(-2.0, 2.0, robot.n_v)
    assert {frame.name for frame in moved.frames} == {frame.name for frame in robot.frames}
    for frame in robot.frames:
        assert np.allclose(pose(moved, q, frame.name), pose(robot, q, frame.name), rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", builtin_names())
def test_the_rows_of_a_serial_arm_are_a_modified_dh_table_for_the_reader(name):
    robot = load_robot(name)
    table = modified_dh(robot)
    assert all(row.gamma == 0.0 == row.epsilon for row in table.rows[1:])
    rows = [
        {"name": row.name, "kind": row.kind, "a": row.a, "alpha": row.alpha, "d": row.d, "theta": row.theta}
        for row in table.rows
    ]
    text = dh_text("modified", rows)
    base = f"[base]\nxyz = [0.0, 0.0, {table.rows[0].epsilon}]\nrpy = [0.0, 0.0, {table.rows[0].gamma}]"
    again = robot_from_dh(f"{text}\n{base}")
    q = np.random.default_rng(1).uniform(-2.0, 2.0, robot.n_v)
    for index, joint in enumerate(robot.joint_names):
        assert np.allclose(pose(again, q, joint) @ table.links[index], pose(robot, q, joint), rtol=0, atol=1e-12)


def test_a_table_in_the_modified_convention_comes_back_up_to_the_sense_of_its_normals():
    rows = modified_dh(load_robot("panda")).rows
    assert np.allclose([abs(row.a) for row in rows], [0, 0, 0, 0.0825, 0.0825, 0, 0.088], rtol=0, atol=1e-12)
    assert np.allclose([abs(row.d) for row in rows[:6]], [0.333, 0, 0.316, 0, 0.384, 0], rtol=0, atol=1e-12)
    assert np.allclose(np.abs(np.sin([row.alpha for row in rows])), [0, 1, 1, 1, 1, 1, 1], rtol=0, atol=1e-12)


@pytest.mark.parametrize(("tilt", "parallel"), [(3.7e-6, True), (1e-3, False)])
def test_axes_parallel_up_to_the_rounding_of_a_file_give_no_absurd_lengths(tilt, parallel):
    arm = planar_arm()
    tilted = replace(arm.joints[1], rotation=Rotation.from_rotvec([tilt, 0.0, 0.0]).as_matrix())
    robot = replace(arm, joints=(arm.joints[0], tilted))
    table, moved, q = modified_dh(robot), with_modified_frames(robot), np.array([0.4, -1.3])
    assert table.tilt == pytest.approx(tilt if parallel else 0.0, rel=1e-6)
    assert max(abs(row.d) for row in table.rows) < 1e3
    error = np.abs(pose(moved, q, "j2") @ table.links[1] - pose(robot, q, "j2")).max()
    assert error <= (2 * PARALLEL if parallel else 1e-9)


def random_pose(rng: np.random.Generator) -> np.ndarray:
    return homogeneous(Rotation.from_rotvec(rng.normal(size=3)).as_matrix(), rng.normal(size=3))


@settings(max_examples=10)
@given(seed=st.integers(0, 10_000))
def test_change_of_frame_is_the_parallel_axis_theorem_and_follows_the_poses(seed):
    rng = np.random.default_rng(seed)
    first, second, body = random_pose(rng), random_pose(rng), chain(rng, "R").joints[0].inertia
    assert np.allclose(inertia_change(first) @ body, moved_inertia(body, first), rtol=0, atol=1e-9)
    together = inertia_change(second) @ inertia_change(first)
    assert np.allclose(inertia_change(second @ first), together, rtol=0, atol=1e-9)


def test_results_cannot_be_written_to():
    with pytest.raises(ValueError, match="read-only"):
        modified_dh(planar_arm()).links[0, 0, 0] = 2.0
