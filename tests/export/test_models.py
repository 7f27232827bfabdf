"""A new URDF and an MJCF: every built-in arm and random trees have our torque in Pinocchio and in MuJoCo."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from export_samples import largest_relative, mujoco_torque, pinocchio_torque, some_parameters, states
from scipy.spatial.transform import Rotation

from sample_arms import random_tree
from tauhat.dynamics import inverse_dynamics
from tauhat.errors import ExportError
from tauhat.export import FrictionLaw, mjcf, new_urdf, plain_parameters
from tauhat.export.new_urdf import rpy_from_rotation
from tauhat.robots import Frame, Joint, Limits, Robot, builtin_names, forward_kinematics, load_robot, robot_from_urdf
from tauhat.robots.transforms import rotation_from_rpy

DOWN = (0.0, 0.0, -9.81)


def arms() -> list[Robot]:
    trees = [random_tree(np.random.default_rng(seed), 6) for seed in range(3)]
    return [*(load_robot(name) for name in builtin_names()), *trees]


@pytest.mark.parametrize("robot", arms(), ids=lambda robot: robot.name)
def test_mujoco_calculates_our_torque_from_the_mjcf(robot):
    parameters, motion = some_parameters(robot), states(robot)
    rigid = inverse_dynamics(robot, *motion, inertia=parameters.inertia)
    expected = rigid + parameters.rotor * motion[2] + parameters.friction[0].coefficients * motion[1]
    assert largest_relative(mujoco_torque(mjcf(robot, parameters).text, robot, motion), expected) < 1e-9


@pytest.mark.parametrize("robot", arms(), ids=lambda robot: robot.name)
def test_pinocchio_and_mujoco_calculate_our_torque_from_the_new_urdf(robot):
    robot = robot.with_gravity(DOWN)
    parameters, motion = some_parameters(robot), states(robot)
    text = new_urdf(robot, parameters).text
    rigid = inverse_dynamics(robot, *motion, inertia=parameters.inertia)
    assert largest_relative(pinocchio_torque(pin.buildModelFromXML(text), robot, motion), rigid) < 1e-9
    damped = rigid + parameters.friction[0].coefficients * motion[1]
    assert largest_relative(mujoco_torque(text, robot, motion), damped) < 1e-9


@pytest.mark.parametrize("name", builtin_names())
def test_the_new_urdf_reads_back_as_the_same_robot(name):
    robot = load_robot(name)
    parameters = some_parameters(robot)
    again = robot_from_urdf(new_urdf(robot, parameters).text)
    assert again.joint_names == robot.joint_names
    assert {frame.name for frame in robot.frames} <= {frame.name for frame in again.frames}
    for ours, theirs, rotor in zip(robot.joints, again.joints, parameters.rotor, strict=True):
        np.testing.assert_allclose(theirs.rotation, ours.rotation, atol=1e-15)
        np.testing.assert_allclose(theirs.translation, ours.translation, atol=1e-15)
        assert theirs.limits.velocity == ours.limits.velocity
        assert theirs.rotor_inertia == rotor


def test_sites_and_bodies_of_the_mjcf_are_the_robots_frames():
    robot = load_robot("ur5e")
    q = np.linspace(-1.0, 1.0, robot.n_v)
    model = mujoco.MjModel.from_xml_string(mjcf(robot, some_parameters(robot)).text)
    data = mujoco.MjData(model)
    data.qpos[:] = q
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(
        data.site("tool").xpos, forward_kinematics(robot, q, frame="tool").translation, atol=1e-12
    )


def test_the_mjcf_holds_limits_gravity_armature_and_friction():
    robot = load_robot("panda").with_gravity((1.0, 0.0, -9.0))
    parameters = some_parameters(robot)
    model = mujoco.MjModel.from_xml_string(mjcf(robot, parameters).text)
    np.testing.assert_array_equal(model.opt.gravity, robot.gravity)
    np.testing.assert_array_equal(model.jnt_range, np.column_stack([robot.lower, robot.upper]))
    np.testing.assert_array_equal(model.jnt_actfrcrange[:, 1], robot.effort_limit)
    np.testing.assert_array_equal(model.dof_armature, parameters.rotor)
    np.testing.assert_array_equal(model.dof_frictionloss, parameters.friction[1].coefficients[0])


def test_a_sliding_joint_in_mujoco_feels_its_dry_friction():
    robot = load_robot("two_link").with_gravity((0.0, 0.0, 0.0))
    parameters = plain_parameters(robot.inertia, coulomb=np.array([0.7, 0.4]))
    model = mujoco.MjModel.from_xml_string(mjcf(robot, parameters).text)
    data = mujoco.MjData(model)
    data.qvel[:] = (1.0, -1.0)
    mujoco.mj_inverse(model, data)
    rigid = inverse_dynamics(robot, *(np.array([row]) for row in ((0.0, 0.0), (1.0, -1.0), (0.0, 0.0))))
    np.testing.assert_allclose(data.qfrc_inverse - rigid[0], (0.7, -0.4), rtol=1e-6)


def test_what_the_formats_cannot_say_is_reported():
    robot = load_robot("two_link")
    law = FrictionLaw(key="offset", coefficients=np.array([[0.1, -0.3]]))
    parameters = replace(some_parameters(robot), friction=(law,))
    assert mjcf(robot, parameters).left_out == new_urdf(robot, parameters).left_out == {"offset": 0.3}
    assert mjcf(robot, some_parameters(robot)).left_out == {}


def test_names_that_xml_reserves_and_frames_that_clash_are_written_safely():
    body = load_robot("two_link").joints[0].inertia
    hinge = {"kind": "revolute", "rotation": np.eye(3), "translation": np.zeros(3), "axis": np.array([0.0, 0.0, 1.0])}
    joints = (Joint(name='a<"&', parent=-1, inertia=body, **hinge), Joint(name="b", parent=0, inertia=body, **hinge))
    shifted = Frame(name="b_link", joint=0, rotation=np.eye(3), translation=np.ones(3))
    robot = Robot(name="odd & <one>", joints=joints, frames=(shifted,))
    again = robot_from_urdf(new_urdf(robot, plain_parameters(robot.inertia)).text)
    assert (again.name, again.joint_names) == (robot.name, robot.joint_names)
    model = mujoco.MjModel.from_xml_string(mjcf(robot, plain_parameters(robot.inertia)).text)
    assert model.joint('a<"&').id == 0


def test_a_flat_body_is_accepted_by_mujoco():
    robot = load_robot("two_link")
    flat = np.array([2.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.2, 0.0, 0.0, 0.1 + 0.2])
    for text in (writer(robot, plain_parameters(np.array([flat, flat]))).text for writer in (mjcf, new_urdf)):
        assert mujoco.MjModel.from_xml_string(text).nv == 2


def test_unphysical_and_massless_links_are_refused_by_name():
    robot = load_robot("two_link")
    inertia = np.array(robot.inertia)
    inertia[1] = 0.0
    with pytest.raises(ExportError, match=f"link of joint {robot.joint_names[1]}: the link has no mass"):
        mjcf(robot, plain_parameters(inertia))
    inertia[1, 0] = -0.1
    for writer in (mjcf, new_urdf):
        with pytest.raises(ExportError, match=f"link of joint {robot.joint_names[1]}: no body has this inertia"):
            writer(robot, plain_parameters(inertia))
    with pytest.raises(ExportError, match="another robot"):
        mjcf(load_robot("ur5e"), plain_parameters(robot.inertia))


def test_angles_come_back_as_the_same_rotation_also_at_a_quarter_turn_of_pitch():
    turns = [*Rotation.random(50, random_state=0).as_matrix(), np.eye(3)]
    turns += [Rotation.from_euler("xyz", (0.3, sign * np.pi / 2, -1.2)).as_matrix() for sign in (-1, 1)]
    turns += [Rotation.from_euler("xyz", (0.3, np.pi / 2 - 1e-9, 2.0)).as_matrix()]
    for turn in turns:
        np.testing.assert_allclose(rotation_from_rpy(*rpy_from_rotation(turn)), turn, atol=5e-16 * 4)


def test_an_unlimited_hinge_is_continuous_and_a_limited_one_keeps_its_range():
    robot = load_robot("two_link")
    free = replace(robot, joints=(replace(robot.joints[0], limits=Limits()), robot.joints[1]))
    text = new_urdf(free, plain_parameters(free.inertia)).text
    again = robot_from_urdf(text)
    assert again.lower[0] == -np.inf
    assert again.lower[1] == robot.lower[1]
