"""Closed-form base parameters: the rules find what the rank of the regressor finds, for every arm and any gravity."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from structured_arms import GRAVITIES, structured_arm

from sample_arms import chain, planar_arm, random_states, random_tree
from tauhat.dynamics import BaseParameters, base_parameters, regressor, torque_model
from tauhat.dynamics.closed_form_base import closed_form_base
from tauhat.errors import TauhatWarning
from tauhat.robots import Robot, builtin_names, load_robot
from tauhat.robots.modified_dh import modified_dh, with_modified_frames


def stacked(robot: Robot, seed: int, n_t: int) -> np.ndarray:
    states = random_states(np.random.default_rng(seed), n_t, robot.n_v)
    return regressor(robot, *states).reshape(-1, 10 * robot.n_v)


def rank(matrix: np.ndarray) -> int:
    norms = np.linalg.norm(matrix, axis=0)
    return int(np.linalg.matrix_rank(matrix[:, norms > 1e-9] / norms[norms > 1e-9], tol=1e-7))


def numeric(robot: Robot) -> BaseParameters:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)  # of a small gap, which the rank of its own decides here
        return base_parameters(torque_model(robot, "inertia"))


def assert_predicts_the_torque(robot: Robot, base: BaseParameters, seed: int) -> None:
    whole = stacked(robot, seed, 20)
    standard = np.random.default_rng(seed).normal(size=whole.shape[1])
    torque = whole @ standard
    predicted = whole[:, base.independent] @ (base.projection @ standard)
    assert np.allclose(predicted, torque, rtol=0, atol=1e-9 * max(1.0, np.abs(torque).max()))


@pytest.mark.parametrize("name", builtin_names())
@pytest.mark.parametrize("gravity", [(0.0, 0.0, -9.81), (4.0, -5.0, 7.0)])
def test_builtin_arms_have_the_numeric_base_set_to_the_last_weight(name, gravity):
    robot = load_robot(name).with_gravity(gravity)
    base, reference = closed_form_base(robot), numeric(robot)
    assert base.names == reference.names
    for field in ("independent", "dependent", "unidentifiable"):
        assert np.array_equal(getattr(base, field), getattr(reference, field)), field
    assert np.allclose(base.regrouping, reference.regrouping, rtol=0, atol=1e-9)
    whole = stacked(robot, 1, 50)
    ours, theirs = (whole[:, found.independent] @ found.projection for found in (base, reference))
    assert np.allclose(ours, theirs, rtol=0, atol=1e-9 * np.abs(whole).max())


@settings(max_examples=80)
@given(seed=st.integers(0, 100_000), n_v=st.integers(1, 6), gravity=st.sampled_from(GRAVITIES))
def test_rules_find_the_rank_and_predict_the_torque_of_any_serial_arm(seed, n_v, gravity):
    robot = structured_arm(seed, n_v, gravity=gravity)
    base = closed_form_base(robot)
    assert base.n_b == rank(stacked(robot, seed, 80))
    assert_predicts_the_torque(robot, base, seed + 1)


@settings(max_examples=40)
@given(seed=st.integers(0, 100_000), n_v=st.integers(2, 6), gravity=st.sampled_from(GRAVITIES))
def test_rules_find_the_rank_and_predict_the_torque_of_any_tree(seed, n_v, gravity):
    robot = structured_arm(seed, n_v, gravity=gravity, branching=0.6)
    base = closed_form_base(robot)
    assert base.n_b == rank(stacked(robot, seed, 80))
    assert_predicts_the_torque(robot, base, seed + 1)


@settings(max_examples=30)
@given(seed=st.integers(0, 100_000), n_v=st.integers(1, 6))
def test_robots_in_arbitrary_joint_frames_keep_the_parameters_of_the_numeric_set(seed, n_v):
    robot = random_tree(np.random.default_rng(seed), n_v)
    base, reference = closed_form_base(robot), numeric(robot)
    assert np.array_equal(base.independent, reference.independent)
    assert np.allclose(base.projection, reference.projection, rtol=0, atol=1e-6)
    assert_predicts_the_torque(robot, base, seed)


def axes(kinds: str, directions: str, places: list[tuple[float, float, float]], *, gravity: str) -> Robot:
    """Return an arm with unturned frames: R or P, x y or z, origin in the frame before, one a joint."""
    unit = dict(zip("xyz0", [*np.eye(3), np.zeros(3)], strict=True))
    joints = [
        replace(joint, rotation=np.eye(3), axis=unit[direction], translation=np.array(place))
        for joint, direction, place in zip(
            chain(np.random.default_rng(0), kinds).joints, directions, places, strict=True
        )
    ]
    return Robot(name=kinds, joints=tuple(joints), gravity=-9.81 * unit[gravity])


HERE, ASIDE, UP = (0.0, 0.0, 0.0), (0.4, 0.0, 0.0), (0.0, 0.0, 0.4)


BENT = "Ixx Ixy Ixz Iyz Izz"


@pytest.mark.parametrize(
    ("robot", "shown"),
    [
        (axes("P", "z", [HERE], gravity="z"), ["m"]),
        (axes("R", "z", [HERE], gravity="z"), ["Izz"]),
        (axes("R", "z", [HERE], gravity="y"), ["Izz mx my"]),
        (axes("PR", "xz", [HERE, HERE], gravity="z"), ["m", "Izz mx my"]),
        (axes("PR", "zz", [HERE, HERE], gravity="z"), ["m", "Izz"]),
        (axes("RR", "zz", [HERE, UP], gravity="z"), ["Izz", "Izz"]),
        (axes("RR", "zz", [HERE, ASIDE], gravity="z"), ["Izz", "Izz mx my"]),
        (axes("RP", "zz", [HERE, ASIDE], gravity="z"), ["Izz", "m"]),
        (axes("RP", "zx", [HERE, HERE], gravity="z"), ["Izz", "mx my m"]),
        (axes("RPP", "zxz", [HERE] * 3, gravity="z"), ["Izz", "mx my m", "m"]),
        (axes("RRP", "zyy", [HERE] * 3, gravity="z"), ["Izz", f"{BENT} Iyy mx mz".replace("Izz ", ""), "mx my mz m"]),
        (axes("RR", "zx", [HERE, HERE], gravity="0"), ["Izz", BENT]),
        (axes("RR", "zx", [HERE, (0.5, 0.0, 0.0)], gravity="0"), ["Izz", BENT]),
        (axes("RR", "zx", [HERE, (0.0, 0.4, 0.0)], gravity="0"), ["Izz", f"{BENT} my mz"]),
    ],
)
def test_each_rule_shows_the_parameters_of_its_row(robot, shown):
    base = closed_form_base(robot)
    kept = [{base.names[k].split("_")[0] for k in base.independent if k // 10 == link} for link in range(robot.n_v)]
    assert kept == [set(symbols.split()) for symbols in shown]
    assert rank(stacked(robot, 3, 80)) == base.n_b


def test_planar_arm_has_the_textbooks_regrouping():
    expected = ("mx_1 + 0.5 m_2", "my_1", "Izz_1 + 0.25 m_2", "mx_2", "my_2", "Izz_2")
    assert closed_form_base(planar_arm()).formulas() == expected


def test_last_link_groups_as_in_the_textbook_formulas():
    """Khalil, Dombre 2002, eq. 9.23: Iyy, mz and m of link j in modified DH frames go to link j - 1."""
    robot = with_modified_frames(chain(np.random.default_rng(4), "RRR"))
    base = closed_form_base(robot)
    row = modified_dh(robot).rows[2]
    cosine, sine, a, d = np.cos(row.alpha), np.sin(row.alpha), row.a, row.d
    of_moment = {"Ixx": 2 * d, "Ixy": a * sine, "Ixz": -a * cosine, "Iyy": 2 * d * cosine**2, "my": -sine, "mz": cosine}
    of_moment |= {"Iyz": 2 * d * cosine * sine, "Izz": 2 * d * sine**2}
    of_inertia = {"Ixx": 1.0, "Iyy": cosine**2, "Iyz": cosine * sine, "Izz": sine**2}
    own = {name: k for k, name in enumerate(base.names)}
    for name, weights in (("Iyy_3", of_inertia), ("mz_3", of_moment)):
        moved = np.zeros(30)
        for symbol, weight in weights.items():
            moved[own[f"{symbol}_2"]] = weight
        if name == "Iyy_3":
            moved[own["Ixx_3"]] = -1.0
        assert np.allclose(base.projection[:, own[name]], base.projection @ moved, rtol=0, atol=1e-12)


def test_a_right_angle_written_as_1_5708_does_not_add_base_parameters():
    robot = load_robot("ur5e")
    slip = Rotation.from_rotvec([1.5708 - np.pi / 2, 0.0, 0.0]).as_matrix()
    written = replace(robot, joints=tuple(replace(joint, rotation=joint.rotation @ slip) for joint in robot.joints))
    base = closed_form_base(written)
    assert base.n_b == 36
    assert np.array_equal(base.independent, closed_form_base(robot).independent)


def test_results_cannot_be_written_to():
    base = closed_form_base(planar_arm())
    assert not any(array.flags.writeable for array in (base.independent, base.regrouping, base.unidentifiable))
