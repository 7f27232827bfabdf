"""Joint references of a path against Pinocchio's forward kinematics and exact inverse kinematics."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio
import pytest
from scipy.spatial.transform import Rotation

from sample_arms import WORKING_POSES, planar_arm
from tauhat.arrays import FloatArray
from tauhat.control.force import (
    CylindricalSurface,
    FlatSurface,
    PathJoints,
    PolishCommand,
    Polisher,
    PolishLimits,
    PolishTask,
    Surface,
    ToolMount,
    path_joints,
)
from tauhat.errors import ControlError, RobotError
from tauhat.robots import Robot, forward_kinematics, load_robot, pinocchio_model
from tauhat.robots.inverse_kinematics import PoseSolver

ARMS = ["ur5e", "ur10e", "panda", "crs_a465"]
SEEDS = {**WORKING_POSES, "ur10e": np.array([0.0, -1.3, 1.6, -1.8, -1.4, 0.0])}
LENGTH, HALF, OFFSET = 0.12, 0.06, 8e-3


def frame_of(robot: Robot) -> str:
    return robot.frames[-1].name if robot.frames else robot.joint_names[-1]


def surface_below(robot: Robot, seed: FloatArray, kind: type[Surface] = FlatSurface, **shape: float) -> Surface:
    """Return a surface under the tool in the seed's pose, its path along the frame's x."""
    pose = forward_kinematics(robot, seed, frame=frame_of(robot))
    rotation = pose.rotation @ np.diag([1.0, -1.0, -1.0])
    place = pose.translation + LENGTH * pose.rotation[:, 2]
    settings: dict[str, Any] = {"half": HALF, **shape}
    return kind(place=place, rotation=rotation, **settings)


def solved(
    name: str, kind: type[Surface] = FlatSurface, **shape: float
) -> tuple[Robot, Surface, ToolMount, PathJoints]:
    robot = load_robot(name)
    surface = surface_below(robot, SEEDS[name], kind, **shape)
    tool = ToolMount(frame=frame_of(robot), length=LENGTH)
    return robot, surface, tool, path_joints(robot, surface, tool=tool, seed=SEEDS[name])


def pinocchio_pose(robot: Robot, q: FloatArray) -> pinocchio.SE3:
    model = pinocchio_model(robot)
    data = model.createData()
    pinocchio.framesForwardKinematics(model, data, q)
    return data.oMf[model.getFrameId(frame_of(robot))]


@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize(
    ("kind", "shape"),
    [(FlatSurface, {}), (CylindricalSurface, {"radius": 0.3}), (CylindricalSurface, {"radius": -0.3})],
)
def test_the_tip_is_on_its_path_upright_and_at_its_depth(name: str, kind: type[Surface], shape: dict[str, float]):
    robot, surface, _, joints = solved(name, kind, **shape)
    for s in np.linspace(-HALF, HALF, 9) * 0.997:
        for depth in (-OFFSET, 0.0, 0.003, OFFSET):
            pose = pinocchio_pose(robot, joints.at(float(s), 0.0, depth, 0.0)[0])
            tip = pose.translation + LENGTH * pose.rotation[:, 2]
            normal, tangent = surface.normals([s])[0], surface.tangents([s])[0]
            assert np.linalg.norm(tip - surface.points([s])[0] + depth * normal) < 1e-5
            assert Rotation.from_matrix(
                pose.rotation @ np.column_stack([tangent, np.cross(-normal, tangent), -normal]).T
            ).magnitude() < 1e-4  # fmt: skip
    assert joints.tip_error <= 1e-5


@pytest.mark.parametrize("name", ["ur5e", "ur10e", "crs_a465"])
def test_offsets_of_eight_millimetres_are_those_of_exact_inverse_kinematics(name: str):
    robot, surface, tool, joints = solved(name, CylindricalSurface, radius=0.4)
    solver, largest = PoseSolver(robot, tool.frame), 0.0
    s = np.linspace(-HALF, HALF, 14)
    for depth in (-OFFSET, OFFSET):
        for length, pose in zip(s, tool.poses(surface, s, depth), strict=True):
            q = joints.at(float(length), 0.0, depth, 0.0)[0]
            exact = solver.position(pose, q)
            tips = [forward_kinematics(robot, each, frame=tool.frame) for each in (q, exact)]
            ends = [tip.translation + LENGTH * tip.rotation[:, 2] for tip in tips]
            largest = max(largest, float(np.linalg.norm(ends[0] - ends[1])))
            assert np.abs(q - exact).max() < 1e-4
    assert largest < 1e-5
    assert largest <= 1.5 * joints.tip_error


def test_nodes_come_closer_where_the_joints_bend_much():
    coarse = solved("ur5e", CylindricalSurface, radius=0.3)[3]
    near_singular = solved("crs_a465", CylindricalSurface, radius=0.3)[3]
    assert near_singular.nodes.size > coarse.nodes.size
    assert near_singular.tip_error <= 1e-5


@pytest.mark.parametrize("name", ARMS)
def test_joint_speeds_are_the_derivative_along_a_motion(name: str):
    joints, step = solved(name)[3], 1e-5
    for s, ds, depth, ddepth in ((0.01, 0.05, 0.002, 0.004), (-0.0301, -0.05, -0.02, -0.05), (0.04, 0.0, 0.0, 0.005)):
        ahead = joints.at(s + step * ds, ds, depth + step * ddepth, ddepth)[0]
        behind = joints.at(s - step * ds, ds, depth - step * ddepth, ddepth)[0]
        np.testing.assert_allclose(joints.at(s, ds, depth, ddepth)[1], (ahead - behind) / (2.0 * step), atol=1e-7)


def test_speeds_do_not_jump_at_the_nodes():
    joints = solved("ur5e")[3]
    for node in joints.nodes[1:-1]:
        before, after = (joints.at(float(node) + side * 1e-9, 0.05, 0.003, 0.0)[1] for side in (-1.0, 1.0))
        np.testing.assert_allclose(before, after, atol=1e-8)


def test_a_turn_is_about_the_normal():
    robot, seed = load_robot("ur5e"), SEEDS["ur5e"]
    surface = surface_below(robot, seed)
    tool = ToolMount(frame="tool", length=LENGTH, turn=0.4)
    q = path_joints(robot, surface, tool=tool, seed=seed).at(0.0, 0.0, 0.0, 0.0)[0]
    turned = pinocchio_pose(robot, q).rotation @ pinocchio_pose(robot, seed).rotation.T
    np.testing.assert_allclose(Rotation.from_matrix(turned).as_rotvec(), 0.4 * surface.rotation[:, 2], atol=1e-6)


def test_a_command_is_followed_and_one_off_the_path_refused():
    joints = solved("ur5e")[3]
    command = PolishCommand(0.01, 0.05, 0.002, 0.001, "pass", "")
    for one, other in zip(joints.follow(command), joints.at(0.01, 0.05, 0.002, 0.001), strict=True):
        np.testing.assert_array_equal(one, other)
    joints.at(HALF, 0.0, 8e-3, 0.0)
    for s, depth in (
        (HALF + 1e-6, 0.0),
        (-HALF - 1e-6, 0.0),
        (0.0, 8.001e-3),
        (0.0, -0.031),
        (np.nan, 0.0),
        (0.0, np.nan),
    ):
        with pytest.raises(ControlError, match="command off the path"):
            joints.at(s, 0.0, depth, 0.0)


def test_speeds_that_a_joint_cannot_follow_are_refused_by_its_name():
    joints = solved("ur5e")[3]
    joints.check_speeds(feed=0.05, depth_speed=0.05)
    with pytest.raises(RobotError, match=r"the path is too fast for a joint.*expected <= 3.1"):
        joints.check_speeds(feed=2.0, depth_speed=0.05)


@pytest.mark.parametrize(
    ("polisher", "error", "message"),
    [
        (Polisher(task=PolishTask(half=0.07)), ControlError, "too little path was solved"),
        (Polisher(task=PolishTask(half=HALF), limits=PolishLimits(height=0.04)), ControlError, "too little height"),
        (Polisher(task=PolishTask(half=HALF), limits=PolishLimits(deepest=9e-3)), ControlError, "too little depth"),
        (Polisher(task=PolishTask(half=HALF, feed=2.0)), RobotError, "too fast for a joint"),
    ],
)
def test_a_job_beyond_what_was_solved_is_refused_before_it_begins(
    polisher: Polisher, error: type[Exception], message: str
):
    joints = solved("ur5e")[3]
    Polisher(task=PolishTask(half=HALF)).check_path(joints)
    with pytest.raises(error, match=message):
        polisher.check_path(joints)


def moved(surface: Surface, shift: FloatArray, *, half: float = HALF) -> FlatSurface:
    return FlatSurface(place=surface.place + shift, rotation=surface.rotation, half=half)


def test_paths_that_the_arm_cannot_follow_are_refused_by_name():
    robot, surface, tool, _ = solved("ur5e")
    seed = SEEDS["ur5e"]
    with pytest.raises(RobotError, match=r"s = -\d+ mm: the pose is not reached.*another place for the surface"):
        path_joints(robot, moved(surface, np.array([-0.6, 0.0, 0.0])), tool=tool, seed=seed)
    with pytest.raises(RobotError, match=r"not reached|singular"):
        path_joints(robot, moved(surface, np.zeros(3), half=0.8), tool=tool, seed=seed)


def test_a_path_through_a_singular_position_is_refused_by_name():
    robot, seed = load_robot("ur5e"), np.array([0.0, -1.3, 1.6, -1.8, -1e-3, 0.0])  # the wrist stretched
    surface = surface_below(robot, seed)
    with pytest.raises(RobotError, match="singular position only"):
        path_joints(robot, surface, tool=ToolMount(frame="tool", length=LENGTH), seed=seed)


def test_a_path_beyond_a_joint_limit_is_refused_by_name():
    robot, seed = load_robot("panda"), SEEDS["panda"].copy()
    seed[5] = 3.74  # upper limit 3.7525
    surface = surface_below(robot, seed)
    with pytest.raises(RobotError, match=r"outside the limits of \w+ only"):
        path_joints(robot, surface, tool=ToolMount(frame=frame_of(robot), length=LENGTH), seed=seed)


def test_a_path_that_needs_a_turn_of_a_joint_is_refused_by_name():
    robot, seed = load_robot("crs_a465"), SEEDS["crs_a465"].copy()
    seed[5] = robot.upper[5] - 0.01
    assert robot.upper[5] - robot.lower[5] >= 2.0 * np.pi
    surface = surface_below(robot, seed)
    with pytest.raises(RobotError, match="needs a jump of a joint"):
        path_joints(robot, surface, tool=ToolMount(frame=frame_of(robot), length=LENGTH), seed=seed)


def test_depths_and_tools_that_make_no_sense_are_refused():
    robot, surface, tool, _ = solved("ur5e")
    for depths in ((0.01, 0.02), (-0.03, -0.01), (-np.inf, 0.01)):
        with pytest.raises(ControlError, match="expected highest < 0 < deepest"):
            path_joints(robot, surface, tool=tool, seed=SEEDS["ur5e"], depths=depths)
    with pytest.raises(ControlError, match="the tip misses the path between the nodes"):
        path_joints(robot, surface, tool=tool, seed=SEEDS["ur5e"], tip_tolerance=1e-13)
    with pytest.raises(ControlError, match="length of the tool"):
        ToolMount(frame="tool", length=-0.1)
    with pytest.raises(ControlError, match="turn is not an angle"):
        ToolMount(frame="tool", length=0.1, turn=np.nan)
    with pytest.raises(RobotError, match="no such frame"):
        path_joints(robot, surface, tool=ToolMount(frame="toool", length=0.1), seed=SEEDS["ur5e"])
    arm = planar_arm()
    with pytest.raises(RobotError, match=r"singular|not reached"):
        path_joints(arm, surface, tool=ToolMount(frame="j2", length=0.1), seed=np.zeros(2))
