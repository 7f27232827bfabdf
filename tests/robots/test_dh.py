from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robot_texts import dh_text, homogeneous_dh
from test_urdf_hostile import is_robot_or_own_error

from tauhat.errors import RobotError, TauhatWarning
from tauhat.robots import forward_kinematics, pinocchio_model, robot_from_dh

GRAVITY = np.array([1.0, -2.0, -9.0])


def made_rows(seed: int, *, with_mass: str = "masses") -> list[dict[str, object]]:
    random = np.random.default_rng(seed)
    rows: list[dict[str, object]] = []
    for index, kind in enumerate(("revolute", "prismatic", "revolute", "revolute", "prismatic")):
        a, alpha, d, theta = random.uniform(-1, 1, 4)
        row: dict[str, object] = {"name": f"j{index}", "kind": kind, "a": a, "alpha": alpha, "d": d, "theta": theta}
        if with_mass == "masses":
            body = random.normal(size=(3, 3))
            second = body @ body.T + 0.1 * np.eye(3)
            tensor = np.trace(second) * np.eye(3) - second
            figures = [tensor[0, 0], tensor[0, 1], tensor[1, 1], tensor[0, 2], tensor[1, 2], tensor[2, 2]]
            row |= {"mass": random.uniform(1, 5), "com": random.uniform(-0.3, 0.3, 3), "inertia": figures}
        rows.append(row)
    return rows


def link_poses(convention: str, rows, q) -> list[np.ndarray]:
    poses, pose = [], np.eye(4)
    for row, position in zip(rows, q, strict=True):
        pose = pose @ homogeneous_dh(convention, row, position)
        poses.append(pose)
    return poses


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_frames_are_the_product_of_the_conventions_matrices(convention) -> None:
    rows = made_rows(1)
    robot, q = robot_from_dh(dh_text(convention, rows)), np.linspace(-1.0, 1.3, 5)
    for index, expected in enumerate(link_poses(convention, rows, q)):
        pose = forward_kinematics(robot, q, frame=f"dh_{index + 1}")
        np.testing.assert_allclose(pose.rotation, expected[:3, :3], atol=1e-12)
        np.testing.assert_allclose(pose.translation, expected[:3, 3], atol=1e-12)


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_each_joint_frames_z_axis_is_the_joints_own(convention) -> None:
    """Whatever moves a joint frame relative to its parent is a motion along or about its z."""
    rows = made_rows(2)
    robot = robot_from_dh(dh_text(convention, rows))
    for index, joint in enumerate(robot.joints):
        q = np.zeros(5)
        still = forward_kinematics(robot, q, frame=joint.name)
        q[index] = 0.7
        moved = forward_kinematics(robot, q, frame=joint.name)
        np.testing.assert_allclose(moved.rotation[:, 2], still.rotation[:, 2], atol=1e-12)
        travelled = 0.7 * still.rotation[:, 2] if joint.kind == "prismatic" else np.zeros(3)
        np.testing.assert_allclose(moved.translation - still.translation, travelled, atol=1e-12)


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_energy_computed_from_the_dh_frames_alone_is_that_of_the_robot(convention) -> None:
    """Potential energy from centres, kinetic energy from numerically differentiated frames: no joint frame enters."""
    rows = made_rows(3)
    robot = robot_from_dh(dh_text(convention, rows, head=f"gravity = {GRAVITY.tolist()}"))
    random = np.random.default_rng(4)
    q, dq, step = random.uniform(-1, 1, 5), random.normal(size=5), 1e-6
    before, now, after = (link_poses(convention, rows, q + shift * dq) for shift in (-step, 0.0, step))
    potential, kinetic = 0.0, 0.0
    for row, low, mid, high in zip(rows, before, now, after, strict=True):
        rate = (high - low) / (2 * step)
        com = np.array([*row["com"], 1.0])
        spin = rate[:3, :3] @ mid[:3, :3].T
        omega = mid[:3, :3].T @ np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
        xx, xy, yy, xz, yz, zz = row["inertia"]
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        kinetic += 0.5 * row["mass"] * np.sum((rate @ com)[:3] ** 2) + 0.5 * omega @ tensor @ omega
        potential -= row["mass"] * GRAVITY @ (mid @ com)[:3]
    model = pinocchio_model(robot)
    data = model.createData()
    assert pin.computeKineticEnergy(model, data, q, dq) == pytest.approx(kinetic, rel=1e-7)
    assert pin.computePotentialEnergy(model, data, q) == pytest.approx(potential, rel=1e-9)


def test_base_and_tool_place_the_first_and_the_last_frame() -> None:
    rows = made_rows(5)
    head = "[base]\nxyz = [1.0, 2.0, 3.0]\nrpy = [0.0, 0.0, 1.5707963267948966]\n[tool]\nxyz = [0.0, 0.0, 0.4]"
    for convention in ("standard", "modified"):
        plain, placed = (robot_from_dh(dh_text(convention, rows, head=text)) for text in ("", head))
        q = np.full(5, 0.2)
        last = forward_kinematics(plain, q, frame="dh_5")
        tool = forward_kinematics(placed, q, frame="tool").translation
        x, y, z = last.translation + 0.4 * last.rotation[:, 2]
        np.testing.assert_allclose(tool, [1.0 - y, 2.0 + x, 3.0 + z], atol=1e-12)


def test_degrees_scale_angles_and_the_limits_of_revolute_joints_only() -> None:
    limits = {"lower": -90.0, "upper": 180.0, "velocity": 90.0, "acceleration": 360.0, "effort": 5.0}
    rows = [
        {"name": "r", "kind": "revolute", "alpha": 90.0, **limits},
        {"name": "p", "kind": "prismatic", **(limits | {"lower": -0.5, "upper": 2.0})},
    ]
    robot = robot_from_dh(dh_text("modified", rows, head='angle_unit = "deg"'))
    turn, slide = (joint.limits for joint in robot.joints)
    found = [turn.lower, turn.upper, turn.velocity, turn.acceleration, turn.effort]
    np.testing.assert_allclose(found, [-np.pi / 2, np.pi, np.pi / 2, 2 * np.pi, 5.0])
    assert [slide.lower, slide.upper, slide.velocity, slide.acceleration] == [-0.5, 2.0, 90.0, 360.0]
    np.testing.assert_allclose(robot.joints[0].rotation[:, 2], [0, -1, 0], atol=1e-15)


def test_a_table_without_masses_is_kinematic_only() -> None:
    robot = robot_from_dh(dh_text("standard", made_rows(6, with_mass="none")))
    assert not robot.has_inertia
    assert robot.n_v == 5


def test_one_link_without_mass_among_others_warns() -> None:
    rows = made_rows(7)
    for key in ("mass", "com", "inertia"):
        del rows[2][key]
    with pytest.warns(TauhatWarning, match=r"1 of 5 moving links have no mass \(moved by j2\)"):
        robot_from_dh(dh_text("standard", rows))


def test_friction_and_rotor_inertia_are_read() -> None:
    rows = [{"name": "r", "mass": 1.0, "viscous": 1.5, "coulomb": 0.5, "rotor_inertia": 0.25}]
    joint = robot_from_dh(dh_text("standard", rows)).joints[0]
    assert (joint.viscous, joint.coulomb, joint.rotor_inertia) == (1.5, 0.5, 0.25)


ROW = {"name": "r", "a": 0.3, "mass": 1.0}
REFUSED = {
    "unknown key": (
        dh_text("standard", [ROW | {"alfa": 1.0}]),
        "joint 1: unknown key; got alfa; did you mean alpha",
    ),
    "unknown key on top": (
        dh_text("standard", [ROW], head="gravitas = 1"),
        "got gravitas; did you mean gravity",
    ),
    "unknown key of the tool": (dh_text("standard", [ROW], head="[tool]\nx = 1.0"), r"\[tool\]: unknown key; got x"),
    "no convention": ('name = "x"\n[[joints]]\nname = "r"', "key is missing; expected convention"),
    "other convention": (dh_text("hayati", [ROW]), "unknown convention; expected standard | modified"),
    "other unit": (dh_text("standard", [ROW], head='angle_unit = "grad"'), "unknown angle_unit"),
    "other kind": (dh_text("standard", [ROW | {"kind": "ball"}]), "unknown kind; expected revolute | prismatic"),
    "no joints": (dh_text("standard", []), "no joints"),
    "joints no tables": ('convention = "standard"\njoints = [1, 2]', "not a list of tables"),
    "tool no table": (dh_text("standard", [ROW], head="tool = 3"), "tool is not a table"),
    "no name": (dh_text("standard", [{"a": 1.0}]), "key is missing; expected name"),
    "same name": (dh_text("standard", [ROW, ROW]), "joint names are not unique"),
    "negative mass": (dh_text("standard", [ROW | {"mass": -1.0}]), "negative mass"),
    "centre without mass": (dh_text("standard", [{"name": "r", "com": (0, 0, 0)}]), "without a mass; got com"),
    "five moments": (
        dh_text("standard", [ROW | {"inertia": (1, 0, 1, 0, 1)}]),
        "inertia has the wrong form; expected 6",
    ),
    "nan": (dh_text("standard", [ROW]).replace("0.3", "nan"), "a is not finite"),
    "inf": (dh_text("standard", [ROW]).replace("0.3", "inf"), "a is not finite"),
    "text": (dh_text("standard", [ROW]).replace("0.3", '"long"'), "a is not a number"),
    "true": (dh_text("standard", [ROW]).replace("0.3", "true"), "a is not a number"),
    "endless integer": (dh_text("standard", [ROW]).replace("0.3", "9" * 400), "a is far too large"),
    "nan in a row": (dh_text("standard", [ROW], head="gravity = [0.0, nan, 0.0]"), "gravity is not finite"),
    "millimetres": (dh_text("standard", [ROW]).replace("0.3", "300"), "absurd size.*got 300 m.*millimetres"),
    "crossed limits": (dh_text("standard", [ROW | {"lower": 1.0, "upper": -1.0}]), "impossible limits"),
    "no speed": (dh_text("standard", [ROW | {"velocity": 0.0}]), "impossible limits"),
    "negative friction": (dh_text("standard", [ROW | {"viscous": -1.0}]), "cannot be negative"),
    "cut off": (dh_text("standard", [ROW])[:-3] + "\n[", "not TOML"),
    "deep": ("a = " + "[\n" * 20_000, "absurdly deep TOML"),
    "dotted key": (".".join("a" * 40_000) + " = 1\n", "absurdly long line"),
    "large": ("# " + "x" * 200_000 + "\n", r"absurdly large; expected at most 0\.1 MB"),
    "surrogate": ("name = '\ud800'\n", "no text"),
}


@pytest.mark.parametrize(("text", "message"), REFUSED.values(), ids=REFUSED.keys())
def test_a_broken_table_is_refused_with_one_line_that_names_the_fault(text, message) -> None:
    with pytest.raises(RobotError, match=message) as caught:
        robot_from_dh(text)
    assert "\n" not in str(caught.value)


def test_an_impossible_tensor_warns_and_a_possible_one_does_not() -> None:
    sound = dh_text("standard", [ROW | {"inertia": (1.0, 0, 1.0, 0, 0, 1.0)}])
    robot_from_dh(sound)
    with pytest.warns(TauhatWarning, match="triangle inequality"):
        robot_from_dh(dh_text("standard", [ROW | {"inertia": (3.0, 0, 1.0, 0, 0, 1.0)}]))


def test_a_table_in_a_file_takes_the_files_name(tmp_path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(dh_text("standard", [ROW]).replace('name = "made"', ""))
    assert (robot_from_dh(path).name, robot_from_dh(str(path)).source) == ("mine", "mine.toml")


TABLE = dh_text("standard", made_rows(8))


@settings(max_examples=200, deadline=2000, derandomize=True)
@given(
    st.integers(0, len(TABLE)), st.integers(0, 30), st.sampled_from(["", "nan", "-", "[", '"', "1e400", "\n", "=", "é"])
)
def test_a_damaged_table_gives_a_robot_or_our_own_error(start, length, fragment) -> None:
    is_robot_or_own_error(robot_from_dh, TABLE[:start] + fragment + TABLE[start + length :] + "\n")
