"""Base parameters: they predict what the standard parameters predict, and no smaller set does."""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sample_arms import chain, planar_arm, random_states, random_tree
from tauhat.dynamics import (
    BaseParameters,
    TorqueModel,
    Viscous,
    base_parameters,
    random_motion,
    regressor,
    torque_model,
)
from tauhat.errors import ModelError, TauhatWarning
from tauhat.robots import Limits, Robot, load_robot

TERM_OF_FORMULA = re.compile(r"([+-])? ?(?:([0-9.]+(?:e[+-]?[0-9]+)?) )?([A-Za-z]+_[0-9]+)")


def stacked_regressor(model: TorqueModel, *, n_t: int, seed: int) -> np.ndarray:
    motion = random_motion(model.robot, n_t, np.random.default_rng(seed))
    layout = model.layout()
    columns, _ = model.columns(motion, layout)
    stacked = np.zeros((model.robot.n_v, n_t, model.n_p))
    for joint in range(model.robot.n_v):
        rows = layout.of_joint(joint)
        stacked[joint][:, layout.parameters[rows]] = columns[rows].T
    return stacked.reshape(-1, model.n_p)


def numeric_rank(matrix: np.ndarray) -> int:
    norms = np.linalg.norm(matrix, axis=0)
    return int(np.linalg.matrix_rank(matrix[:, norms > 0] / norms[norms > 0], tol=1e-7))


@settings(max_examples=8)
@given(
    seed=st.integers(0, 10_000),
    n_v=st.integers(1, 6),
    terms=st.sampled_from(["inertia", "inertia,rotor,viscous,offset"]),
)
def test_base_parameters_predict_what_standard_parameters_predict(seed, n_v, terms):
    rng = np.random.default_rng(seed)
    model = torque_model(random_tree(rng, n_v), terms)
    base = base_parameters(model)
    standard = rng.normal(size=model.n_p)
    unseen = stacked_regressor(model, n_t=50, seed=seed + 1)
    whole = unseen @ standard
    assert np.allclose(
        unseen[:, base.independent] @ (base.projection @ standard), whole, atol=1e-8 * np.abs(whole).max()
    )


@settings(max_examples=8)
@given(seed=st.integers(0, 10_000), n_v=st.integers(1, 6))
def test_their_number_is_the_rank_of_the_regressor(seed, n_v):
    model = torque_model(random_tree(np.random.default_rng(seed), n_v))
    base = base_parameters(model)
    assert base.n_b == numeric_rank(stacked_regressor(model, n_t=300, seed=seed + 1))


@pytest.mark.parametrize(("name", "count"), [("ur5e", 36), ("staubli_tx40", 36), ("two_link", 6), ("panda", 43)])
def test_known_arms_have_their_known_number_of_inertial_base_parameters(name, count):
    assert base_parameters(torque_model(load_robot(name), "inertia")).n_b == count


@pytest.mark.parametrize(("upright", "count"), [(True, 7 * 6 - 6), (False, 7 * 6 - 4)])
def test_general_six_joint_arm_has_seven_a_joint_less_what_the_first_axis_hides(upright, count):
    # Mayeda, Yoshida, Osuka 1990: seven a link; of the first only Izz, and mx, my where gravity turns with it.
    robot = chain(np.random.default_rng(5), "RRRRRR")
    first = robot.joints[0]
    if upright:
        robot = robot.with_gravity(9.81 * first.rotation @ first.axis)
    assert base_parameters(torque_model(robot, "inertia")).n_b == count


def test_planar_arm_has_the_textbooks_regrouping():
    base = base_parameters(torque_model(planar_arm(), "inertia"))
    expected = ("mx_1 + 0.5 m_2", "my_1", "Izz_1 + 0.25 m_2", "mx_2", "my_2", "Izz_2")
    assert base.formulas() == expected
    assert {base.names[k] for k in base.unidentifiable} == {
        f"{symbol}_{link}" for link in (1, 2) for symbol in ("mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz")
    } | {"m_1"}


def parsed(formula: str, values: dict[str, float]) -> float:
    """Return the number a printed formula stands for."""
    found = list(TERM_OF_FORMULA.finditer(formula))
    assert "".join(match.group(0) for match in found).replace(" ", "") == formula.replace(" ", "")
    return sum((-1.0 if match[1] == "-" else 1.0) * float(match[2] or 1.0) * values[match[3]] for match in found)


@pytest.mark.parametrize(("digits", "tolerance"), [(4, 2e-3), (15, 1e-12)])
def test_printed_formulas_give_the_base_values(digits, tolerance):
    model = torque_model(load_robot("ur5e"))
    base = base_parameters(model)
    standard = np.random.default_rng(6).normal(size=model.n_p)
    values = dict(zip(base.names, standard, strict=True))
    printed = [parsed(formula, values) for formula in base.formulas(digits=digits)]
    assert np.allclose(printed, base.projection @ standard, rtol=0, atol=tolerance)


def test_they_are_the_same_every_time():
    model = torque_model(load_robot("staubli_tx40"))
    first, second = base_parameters(model), base_parameters(model)
    assert np.array_equal(first.projection, second.projection)
    assert first.formulas() == second.formulas()


def test_every_parameter_is_kept_regrouped_or_listed_as_unidentifiable():
    model = torque_model(load_robot("crs_a465"))
    base = base_parameters(model)
    everyone = np.concatenate([base.independent, base.dependent, base.unidentifiable])
    assert np.array_equal(np.sort(everyone), np.arange(model.n_p))
    columns = stacked_regressor(model, n_t=50, seed=1)
    silent = np.abs(columns).max(axis=0) < 1e-12
    assert np.array_equal(np.flatnonzero(silent), base.unidentifiable)


def test_first_rotor_is_regrouped_into_its_link():
    formulas = base_parameters(torque_model(load_robot("ur5e"), "inertia,rotor")).formulas()
    assert any(formula.startswith("Izz_1") and "Ia_1" in formula for formula in formulas)


def limited(robot: Robot, half: float) -> Robot:
    limits = Limits(lower=-half, upper=half)
    return replace(robot, joints=tuple(replace(joint, limits=limits) for joint in robot.joints))


@pytest.mark.parametrize("half", [3.0, 0.3, 0.0])
def test_they_belong_to_the_structure_and_not_to_the_joint_limits(half):
    robot = chain(np.random.default_rng(7), "RRR")
    free = base_parameters(torque_model(robot, "inertia"))
    narrow = base_parameters(torque_model(limited(robot, half), "inertia"))
    assert np.array_equal(free.independent, narrow.independent)
    assert np.allclose(free.projection, narrow.projection, atol=1e-6)


def nearly_parallel(tilt: float) -> Robot:
    arm = planar_arm()
    tilted = replace(arm.joints[1], axis=np.array([np.sin(tilt), 0.0, np.cos(tilt)]))
    return replace(arm, joints=(arm.joints[0], tilted))


@pytest.mark.parametrize("tilt", [1e-9, 1e-7, 4e-6])
def test_axes_that_are_parallel_up_to_the_rounding_of_a_file_count_as_parallel(tilt):
    assert base_parameters(torque_model(nearly_parallel(tilt), "inertia")).n_b == 6


def test_a_right_angle_written_as_1_5708_does_not_add_base_parameters():
    robot = load_robot("ur5e")
    slip = Rotation.from_rotvec([1.5708 - np.pi / 2, 0.0, 0.0]).as_matrix()
    written = replace(robot, joints=tuple(replace(joint, rotation=joint.rotation @ slip) for joint in robot.joints))
    assert base_parameters(torque_model(written, "inertia")).n_b == 36


def test_parameters_that_are_nearly_told_apart_warn_with_the_gap():
    with pytest.warns(
        TauhatWarning, match=r"not clearly apart: smallest kept part \d\.\de-\d+, largest dropped \d\.\de"
    ):
        base_parameters(torque_model(load_robot("ur5e"), "inertia"), tolerance=0.7)


@pytest.mark.parametrize("tilt", [0.0, 0.1])
def test_axes_that_are_clearly_parallel_or_not_do_not_warn(tilt):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert isinstance(base_parameters(torque_model(nearly_parallel(tilt), "inertia")), BaseParameters)


@dataclass(frozen=True, slots=True, kw_only=True)
class Silent(Viscous):
    """A term that never acts."""

    key: ClassVar[str] = "silent"

    def columns(self, robot, motion, state):
        return tuple(np.zeros((1, motion.n_t)) for _ in robot.joints), state


def test_a_model_that_loads_no_joint_is_refused():
    with pytest.raises(ModelError, match=r"^planar: no parameter of the model loads any joint"):
        base_parameters(TorqueModel(robot=planar_arm(), terms=(Silent(),)))


def test_random_states_keep_the_limits():
    robot = load_robot("panda")
    motion = random_motion(robot, 500, np.random.default_rng(8))
    assert (motion.q >= robot.lower[:, None]).all()
    assert (motion.q <= robot.upper[:, None]).all()
    assert (np.abs(motion.dq) <= robot.velocity_limit[:, None]).all()
    assert np.ptp(motion.q, axis=1) == pytest.approx(robot.upper - robot.lower, rel=0.05)


def test_regressor_of_the_library_is_what_base_parameters_sift():
    robot = load_robot("two_link")
    model = torque_model(robot, "inertia")
    base = base_parameters(model)
    rng = np.random.default_rng(9)
    rows = regressor(robot, *random_states(rng, 20, 2)).reshape(-1, 20)
    standard = robot.inertia.ravel()
    assert np.allclose(rows[:, base.independent] @ (base.projection @ standard), rows @ standard, atol=1e-11)
