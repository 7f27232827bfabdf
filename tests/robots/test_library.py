from __future__ import annotations

import json
import tomllib
from importlib.resources import files

import numpy as np
import pinocchio as pin
import pytest
from robot_texts import TREE, homogeneous_dh

from tauhat.errors import RobotError
from tauhat.robots import (
    Robot,
    builtin_names,
    central_inertia,
    describe_builtins,
    forward_kinematics,
    load_robot,
    pinocchio_model,
)

NAMES = ("crs_a465", "kuka_iiwa14", "panda", "staubli_tx40", "two_link", "ur10e", "ur3e", "ur5e")


def table_of(name: str) -> dict:
    return tomllib.loads(files("tauhat.robots").joinpath("data", f"{name}.toml").read_text())


def test_the_builtin_robots_are_these_and_each_says_what_it_is() -> None:
    assert builtin_names() == NAMES
    assert all(len(line) > 30 and "\n" not in line for line in describe_builtins().values())


@pytest.mark.parametrize("name", NAMES)
def test_forward_kinematics_is_the_product_of_the_files_dh_matrices(name) -> None:
    table, robot = table_of(name), load_robot(name)
    unit = np.pi / 180 if table["angle_unit"] == "deg" else 1.0
    base = np.eye(4)
    if "base" in table:
        base[:3, :3] = pin.rpy.rpyToMatrix(*(unit * np.array(table["base"]["rpy"])))
    for q in np.random.default_rng(0).uniform(-2, 2, size=(5, robot.n_v)):
        expected = base
        for row, position in zip(table["joints"], q, strict=True):
            angles = {key: unit * row.get(key, 0.0) for key in ("alpha", "theta")}
            expected = expected @ homogeneous_dh(table["convention"], row | angles, position)
        tool = expected @ np.array([*table.get("tool", {}).get("xyz", (0, 0, 0)), 1.0])
        pose = forward_kinematics(robot, q, frame="tool")
        np.testing.assert_allclose(pose.translation, tool[:3], atol=1e-12)
        np.testing.assert_allclose(pose.rotation, expected[:3, :3], atol=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_every_builtin_link_is_a_possible_rigid_body(name) -> None:
    for joint in load_robot(name).joints:
        mass, com, tensor = central_inertia(joint.inertia)
        second = 0.5 * np.trace(tensor) * np.eye(3) - tensor + mass * np.outer(com, com)
        pseudo = np.block([[second, mass * com[:, None]], [mass * com[None, :], np.array([[mass]])]])
        assert np.linalg.eigvalsh(pseudo).min() > 0, joint.name


@pytest.mark.parametrize("name", NAMES)
def test_every_builtin_holds_itself_against_gravity_everywhere_in_its_range(name) -> None:
    robot = load_robot(name)
    model = pinocchio_model(robot)
    data = model.createData()
    lower, upper = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    random = np.random.default_rng(0)
    torque = [pin.computeGeneralizedGravity(model, data, random.uniform(lower, upper)).copy() for _ in range(400)]
    assert (np.abs(torque).max(axis=0) < 0.7 * robot.effort_limit).all()


@pytest.mark.parametrize("name", NAMES)
def test_every_builtin_has_all_limits_and_nominal_drives(name) -> None:
    robot = load_robot(name)
    for joint in robot.joints:
        limits = joint.limits
        bounds = [limits.lower, limits.upper, limits.velocity, limits.effort, limits.acceleration]
        assert np.isfinite(bounds).all()
        assert min(joint.rotor_inertia, joint.viscous, joint.coulomb) > 0
    assert robot.has_inertia
    assert robot.source == f"built-in {name}"


# (name, joint positions, where the tool is) from the makers' drawings: lengths added up by hand
REACH = [
    ("crs_a465", [0] * 6, (0, 0, 0.3302 + 0.3048 + 0.3302 + 0.0762)),
    ("crs_a465", [0, np.pi / 2, 0, 0, 0, 0], (0.3048 + 0.3302 + 0.0762, 0, 0.3302)),
    ("staubli_tx40", [0] * 6, (0, 0.035, 0.320 + 0.225 + 0.225 + 0.065)),
    ("staubli_tx40", [0, np.pi / 2, 0, 0, 0, 0], (0.515, 0.035, 0.320)),
    ("kuka_iiwa14", [0] * 7, (0, 0, 1.306)),
    ("kuka_iiwa14", [0, np.pi / 2, 0, 0, 0, 0, 0], (0.946, 0, 0.36)),
    ("panda", [0] * 7, (0.088, 0, 0.333 + 0.316 + 0.384 - 0.107)),
    ("ur5e", [0] * 6, (-0.425 - 0.3922, -0.1333 - 0.0996, 0.1625 - 0.0997)),
    ("ur10e", [0] * 6, (-0.6127 - 0.57155, -0.17415 - 0.11655, 0.1807 - 0.11985)),
    ("ur3e", [0] * 6, (-0.24355 - 0.2132, -0.13105 - 0.0921, 0.15185 - 0.08535)),
    ("two_link", [np.pi / 2, -np.pi / 2], (0.4, 0, 0.5)),
]


@pytest.mark.parametrize(("name", "q", "expected"), REACH)
def test_reach_is_the_sum_of_the_published_lengths(name, q, expected) -> None:
    np.testing.assert_allclose(forward_kinematics(load_robot(name), q, frame="tool").translation, expected, atol=1e-9)


def test_two_link_gravity_torque_is_the_closed_form() -> None:
    model = pinocchio_model(load_robot("two_link"))
    data = model.createData()
    for q1, q2 in np.random.default_rng(1).uniform(-3, 3, size=(20, 2)):
        second = 2.5 * 9.81 * 0.2 * np.cos(q1 + q2)
        first = (4 * 0.25 + 2.5 * 0.5) * 9.81 * np.cos(q1) + second
        torque = pin.computeGeneralizedGravity(model, data, np.array([q1, q2]))
        np.testing.assert_allclose(torque, [first, second], atol=1e-12)


def test_ur10e_shoulder_torque_stretched_out_is_the_sum_of_its_weights() -> None:
    """Arm along -x at q = 0: each mass times its horizontal distance from the shoulder axis, by hand."""
    arms = (0.6127 - 0.38, 0.6127 + 0.57155 - 0.24, 0.6127 + 0.57155, 0.6127 + 0.57155, 0.6127 + 0.57155)
    masses = (13.051, 3.989, 2.1, 1.98, 0.615)
    expected = 9.81 * sum(mass * arm for mass, arm in zip(masses, arms, strict=True))
    model = pinocchio_model(load_robot("ur10e"))
    torque = pin.computeGeneralizedGravity(model, model.createData(), np.zeros(6))
    assert abs(torque[1]) == pytest.approx(expected, rel=1e-12)
    assert torque[0] == pytest.approx(0.0, abs=1e-9)


def test_iiwa_centres_of_mass_stand_where_they_were_published() -> None:
    published = {1: (0, -0.014, 0.2545), 2: (0, 0.003, 0.424), 4: (0, -0.009, 0.866), 6: (0, -0.002, 1.196)}
    robot = load_robot("kuka_iiwa14")
    for number, expected in published.items():
        _, com, _ = central_inertia(robot.joints[number - 1].inertia)
        pose = forward_kinematics(robot, np.zeros(7), frame=f"joint_{number}")
        np.testing.assert_allclose(pose.rotation @ com + pose.translation, expected, atol=1e-12)


@pytest.mark.parametrize("name", [*NAMES, "tree"])
def test_plain_data_brings_back_the_same_robot_exactly(name, tmp_path) -> None:
    path = tmp_path / "tree.urdf"
    path.write_text(TREE)
    robot = load_robot(path if name == "tree" else name)
    data = robot.to_dict()
    back = Robot.from_dict(json.loads(json.dumps(data)))
    assert back.to_dict() == data
    assert back.fingerprint == robot.fingerprint
    np.testing.assert_array_equal(back.inertia, robot.inertia)


def test_fingerprints_tell_robots_apart_and_ignore_nominal_inertia() -> None:
    assert len({load_robot(name).fingerprint for name in NAMES}) == len(NAMES)
    robot = load_robot("two_link")
    assert robot.with_gravity((0, 0, 9.81)).fingerprint != robot.fingerprint
    data = robot.to_dict()
    data["joints"][0]["inertia"][0] += 1.0
    assert Robot.from_dict(data).fingerprint == robot.fingerprint
    data["joints"][0]["translation"][0] += 1e-6
    assert Robot.from_dict(data).fingerprint != robot.fingerprint


def test_the_fingerprint_of_a_robot_does_not_change_between_versions() -> None:
    assert load_robot("two_link").fingerprint == "4e186a7f80c6083c"


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda data: data.pop("joints"), "damaged"),
        (lambda data: data["joints"][0].pop("axis"), "damaged"),
        (lambda data: data["joints"][0].update(colour="red"), "damaged"),
        (lambda data: data["frames"][0].update(joint=17), "joint that is not there"),
        (lambda data: data["frames"].append(data["frames"][0]), "frame names are not unique"),
        (lambda data: data["joints"].reverse(), "topological order"),
    ],
)
def test_damaged_plain_data_is_refused(damage, message) -> None:
    data = load_robot("two_link").to_dict()
    damage(data)
    with pytest.raises(RobotError, match=message):
        Robot.from_dict(data)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("ur5", "did you mean ur5e"),
        ("pandas", "did you mean panda"),
        ("zzzzzz", "known names: crs_a465"),
        ("arm.xml", "MJCF robots are not supported yet"),
        ("missing.urdf", "no such robot description"),
        ("missing.toml", "no such robot description"),
    ],
)
def test_an_unknown_robot_is_refused_with_advice(name, message) -> None:
    with pytest.raises(RobotError, match=message):
        load_robot(name)


def test_a_builtin_can_have_joints_locked() -> None:
    robot = load_robot("panda", locked={"panda_joint7": 0.4, "panda_joint5": -0.2})
    assert robot.joint_names == ("panda_joint1", "panda_joint2", "panda_joint3", "panda_joint4", "panda_joint6")
    whole = forward_kinematics(load_robot("panda"), [0.1, 0.2, 0.3, -0.4, -0.2, 0.6, 0.4], frame="tool")
    kept = forward_kinematics(robot, [0.1, 0.2, 0.3, -0.4, 0.6], frame="tool")
    np.testing.assert_allclose(kept.translation, whole.translation, atol=1e-12)
