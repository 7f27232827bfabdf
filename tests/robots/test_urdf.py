from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from robot_texts import LIMIT, TREE, TWO_LINKS, joint, link, robot

from tauhat.errors import RobotError, TauhatError, TauhatWarning
from tauhat.robots import Robot, forward_kinematics, load_robot, lock_joints, pinocchio_model, robot_from_urdf

BOUNDED_TREE = TREE.replace('type="continuous"', 'type="revolute"').replace("<dynamics", f"{LIMIT}<dynamics")


def inverse_dynamics(model: pin.Model, states: np.ndarray) -> np.ndarray:
    data = model.createData()
    return np.array([pin.rnea(model, data, *state).copy() for state in states])


def same_dynamics(ours: Robot, theirs: pin.Model) -> None:
    states = np.random.default_rng(3).normal(size=(30, 3, ours.n_v))
    expected = inverse_dynamics(theirs, states)
    np.testing.assert_allclose(inverse_dynamics(pinocchio_model(ours), states), expected, atol=1e-10, rtol=0)
    assert np.abs(expected).max() > 1.0


def without_friction(model: pin.Model) -> pin.Model:
    model.armature = np.zeros(model.nv)
    return model


def test_a_tree_with_fixed_and_prismatic_joints_has_the_dynamics_of_pinocchios_own_model() -> None:
    ours = robot_from_urdf(BOUNDED_TREE)
    theirs = without_friction(pin.buildModelFromXML(BOUNDED_TREE))
    assert ours.joint_names == tuple(theirs.names)[1:]
    assert ours.parents == tuple(parent - 1 for parent in list(theirs.parents)[1:])
    assert [joint.kind for joint in ours.joints].count("prismatic") == 2
    same_dynamics(ours, theirs)


def test_locked_joints_give_the_dynamics_of_pinocchios_reduced_model() -> None:
    locked = {"slide": 0.31, "branch": -0.8}
    full = without_friction(pin.buildModelFromXML(BOUNDED_TREE))
    reference = np.zeros(full.nq)
    for name, position in locked.items():
        reference[full.joints[full.getJointId(name)].idx_q] = position
    theirs = pin.buildReducedModel(full, [full.getJointId(name) for name in locked], reference)
    ours = robot_from_urdf(BOUNDED_TREE, locked=locked)
    assert ours.joint_names == tuple(theirs.names)[1:]
    same_dynamics(ours, theirs)


def test_locking_leaves_every_frame_where_it_was() -> None:
    whole = robot_from_urdf(TREE)
    locked = lock_joints(whole, {"slide": 0.2, "wrist": 0.5})
    q = np.array([{"slide": 0.2, "wrist": 0.5}.get(name, 0.3) for name in whole.joint_names])
    for frame in whole.frames:
        before = forward_kinematics(whole, q, frame=frame.name)
        after = forward_kinematics(locked, [0.3] * locked.n_v, frame=frame.name)
        np.testing.assert_allclose(after.translation, before.translation, atol=1e-12)
        np.testing.assert_allclose(after.rotation, before.rotation, atol=1e-12)


def test_every_link_of_the_urdf_is_a_frame_at_pinocchios_pose() -> None:
    ours, theirs = robot_from_urdf(BOUNDED_TREE), pin.buildModelFromXML(BOUNDED_TREE)
    data, q = theirs.createData(), np.linspace(-0.5, 0.9, ours.n_v)
    pin.framesForwardKinematics(theirs, data, q)
    assert {frame.name for frame in ours.frames} == {"world", "base", "a", "b", "plate", "c", "d", "e", "tool"}
    for frame in ours.frames:
        expected = data.oMf[theirs.getFrameId(frame.name, pin.FrameType.BODY)]
        pose = forward_kinematics(ours, q, frame=frame.name)
        np.testing.assert_allclose(pose.translation, expected.translation, atol=1e-12)
        np.testing.assert_allclose(pose.rotation, expected.rotation, atol=1e-12)


def test_limits_and_dynamics_are_read_and_continuous_joints_are_unlimited() -> None:
    made = robot_from_urdf(TREE)
    waist = made.joints[made.joint_names.index("waist")]
    assert (waist.limits.lower, waist.limits.upper) == (-np.inf, np.inf)
    assert (waist.viscous, waist.coulomb, waist.rotor_inertia) == (1.5, 0.7, 0.2)
    wrist = made.joints[made.joint_names.index("wrist")].limits
    assert (wrist.lower, wrist.upper, wrist.effort, wrist.velocity, wrist.acceleration) == (-2, 2.5, 60, 3, np.inf)


def test_text_and_file_give_the_same_robot(tmp_path) -> None:
    path = tmp_path / "made.urdf"
    path.write_text(TREE)
    text, file, named = robot_from_urdf(TREE), robot_from_urdf(str(path)), load_robot(path)
    assert text.fingerprint == file.fingerprint == named.fingerprint
    assert file.source == "made.urdf"


def test_gravity_is_the_callers() -> None:
    np.testing.assert_array_equal(robot_from_urdf(TWO_LINKS, gravity=(0, 0, 9.81)).gravity, [0, 0, 9.81])


def test_names_that_would_confuse_a_parser_survive() -> None:
    odd = TREE.replace('"a"', '"a &lt;&quot;é\'"').replace('"wrist"', '"c"')
    made = robot_from_urdf(odd, locked={"c": 0.1})
    assert "a <\"é'" in {frame.name for frame in made.frames}
    assert made.n_v == 4


def test_a_mimic_joint_follows_a_locked_leader_without_warning() -> None:
    fingers = robot(
        *(link(name) for name in ("base", "arm", "left", "right")),
        joint("turn", "revolute", "base", "arm"),
        joint("finger", "prismatic", "arm", "left"),
        joint("other", "prismatic", "arm", "right", LIMIT + '<mimic joint="finger" multiplier="-2" offset="0.1"/>'),
    )
    made = robot_from_urdf(fingers, locked={"finger": 0.3})
    without_mimic = fingers.replace('<mimic joint="finger" multiplier="-2" offset="0.1"/>', "")
    expected = robot_from_urdf(without_mimic, locked={"finger": 0.3, "other": -0.5})
    np.testing.assert_allclose(made.inertia, expected.inertia, atol=1e-12)
    with pytest.warns(TauhatWarning, match=r"other mimics finger: locked at 0\.1"):
        assert robot_from_urdf(fingers).joint_names == ("turn", "finger")
    with pytest.raises(RobotError, match="mimics a joint that is missing"):
        robot_from_urdf(fingers.replace('mimic joint="finger"', 'mimic joint="thumb"'))


@pytest.mark.parametrize(
    ("locked", "message"),
    [({"trun": 0.0}, "did you mean turn"), ({"turn": np.nan}, "finite"), ({"turn": "open"}, "finite")],
)
def test_locking_what_cannot_be_locked_says_so(locked, message) -> None:
    with pytest.raises(RobotError, match=message):
        robot_from_urdf(TWO_LINKS, locked=locked)


def test_locking_every_joint_leaves_no_robot() -> None:
    with pytest.raises(RobotError, match="no movable joint"):
        robot_from_urdf(TWO_LINKS, locked={"turn": 0.0})


def test_locking_outside_the_limits_warns_with_the_number() -> None:
    two = robot(link("base", None), link("arm"), link("hand"), joint("turn", "revolute", "base", "arm"),
                joint("grip", "prismatic", "arm", "hand"))  # fmt: skip
    with pytest.warns(TauhatWarning, match=r"grip is locked at 40, outside its limits \[-2, 2.5\]"):
        robot_from_urdf(two, locked={"grip": 40.0})


MOMENTS = 'ixx="0.031" ixy="0.002" ixz="-0.001" iyy="0.027" iyz="0.003" izz="0.012"'


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (MOMENTS, 'ixx="0.1" iyy="-0.02" izz="0.1"', r"not positive definite: smallest principal moment -0\.02"),
        (MOMENTS, 'ixx="0" iyy="0" izz="0"', "not positive definite: smallest principal moment 0"),
        (MOMENTS, 'ixx="0.1" iyy="0.03" izz="0.02"', r"triangle inequality: largest moment exceeds .* by 0\.05"),
        (MOMENTS, 'ixx="31000" iyy="27000" izz="12000"', "radius of gyration 144 m"),
        ('lower="-2"', 'lower="-200"', "200 rad; limits are radians, are these degrees"),
        ('rpy="0.4 -0.7 1.1"', 'rpy="90 0 0"', "turned by 90 rad"),
        ('velocity="3"', 'velocity="0"', "velocity limit 0 taken as not given"),
        ('lower="-2" upper="2.5"', 'lower="0" upper="0"', "lower and upper limit are both 0"),
    ],
)
def test_doubtful_figures_warn_with_their_number_and_sound_ones_do_not(old, new, message) -> None:
    assert old in TWO_LINKS
    robot_from_urdf(TWO_LINKS)  # warnings are errors: silence is part of the claim
    with pytest.warns(TauhatWarning, match=message):
        robot_from_urdf(TWO_LINKS.replace(old, new))


def test_a_moving_link_without_mass_among_others_warns_but_a_massless_tool_does_not() -> None:
    chain = robot(link("base", None), link("arm"), link("bare", None), link("tool", None),
                  joint("turn", "revolute", "base", "arm"), joint("roll", "revolute", "arm", "bare"),
                  joint("flange", "fixed", "arm", "tool", ""))  # fmt: skip
    with pytest.warns(TauhatWarning, match=r"1 of 2 moving links have no mass \(moved by roll\)"):
        robot_from_urdf(chain)
    robot_from_urdf(chain.replace('type="revolute"><parent link="arm"', 'type="fixed"><parent link="arm"'))


def test_a_missing_acceleration_limit_is_infinite_and_a_given_one_is_read() -> None:
    assert robot_from_urdf(TWO_LINKS).joints[0].limits.acceleration == np.inf
    given = TWO_LINKS.replace('velocity="3"', 'velocity="3" acceleration="9"')
    assert robot_from_urdf(given).joints[0].limits.acceleration == 9


def test_infinite_limits_are_legal() -> None:
    made = robot_from_urdf(TWO_LINKS.replace('lower="-2" upper="2.5"', 'lower="-inf" upper="inf"'))
    assert made.upper[0] == np.inf


def test_every_error_is_one_line(tmp_path) -> None:
    path = tmp_path / "half.urdf"
    path.write_text(TREE[: len(TREE) // 2])
    with pytest.raises(TauhatError) as caught:
        robot_from_urdf(path)
    assert "\n" not in str(caught.value)
    assert "cut off" in str(caught.value)
