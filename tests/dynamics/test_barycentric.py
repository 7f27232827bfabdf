"""Barycentric parameters: augmented bodies, the same torque, and a minimal set of the same size."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from structured_arms import GRAVITIES, structured_arm

from sample_arms import planar_arm, random_states, random_tree
from tauhat.dynamics import base_parameters, regressor, torque_model
from tauhat.dynamics.barycentric import barycentric_parameters
from tauhat.dynamics.closed_form_base import closed_form_base
from tauhat.errors import ModelError
from tauhat.robots import Robot, builtin_names, central_inertia, load_robot


def body(parameters: np.ndarray) -> pin.Inertia:
    return pin.Inertia(*central_inertia(parameters))


def augmented(robot: Robot, link: int) -> pin.Inertia:
    """Return the link with the masses beyond each of its joints as points at the joints, added up by Pinocchio."""
    whole = body(robot.inertia[link])
    for child, joint in enumerate(robot.joints):
        if joint.parent == link:
            mass = sum(robot.inertia[k, 0] for k in robot.subtree(child))
            whole += pin.Inertia(mass, np.array(joint.translation), np.zeros((3, 3)))
    return whole


@settings(max_examples=20)
@given(seed=st.integers(0, 10_000), n_v=st.integers(1, 7))
def test_they_are_the_inertias_of_the_augmented_bodies(seed, n_v):
    robot = random_tree(np.random.default_rng(seed), n_v)
    values = barycentric_parameters(robot).matrix @ robot.inertia.ravel()
    expected = [augmented(robot, link).toDynamicParameters() for link in range(n_v)]
    assert np.allclose(values.reshape(n_v, 10), expected, rtol=0, atol=1e-12)


@settings(max_examples=20)
@given(seed=st.integers(0, 10_000), n_v=st.integers(1, 7))
def test_the_torque_is_linear_in_them_and_they_lead_back_to_the_standard_ones(seed, n_v):
    rng = np.random.default_rng(seed)
    robot = random_tree(rng, n_v)
    found = barycentric_parameters(robot)
    assert np.allclose(found.matrix @ found.inverse, np.eye(10 * n_v), rtol=0, atol=1e-12)
    whole, standard = regressor(robot, *random_states(rng, 10, n_v)), rng.normal(size=10 * n_v)
    torque = whole @ standard
    again = (whole @ found.inverse) @ (found.matrix @ standard)
    assert np.allclose(again, torque, rtol=0, atol=1e-11 * max(1.0, np.abs(torque).max()))


def assert_minimal_set_predicts(robot: Robot, seed: int) -> None:
    found, standard_base = barycentric_parameters(robot), closed_form_base(robot)
    base = found.base(standard_base)
    assert base.n_b == standard_base.n_b
    rng = np.random.default_rng(seed)
    whole = regressor(robot, *random_states(rng, 20, robot.n_v)).reshape(-1, 10 * robot.n_v)
    standard = rng.normal(size=10 * robot.n_v)
    columns = (whole @ found.inverse)[:, base.independent]
    torque = whole @ standard
    predicted = columns @ (base.projection @ (found.matrix @ standard))
    assert np.allclose(predicted, torque, rtol=0, atol=1e-9 * max(1.0, np.abs(torque).max()))


@settings(max_examples=40)
@given(
    seed=st.integers(0, 10_000),
    n_v=st.integers(1, 6),
    gravity=st.sampled_from(GRAVITIES),
    branching=st.sampled_from([0.0, 0.6]),
)
def test_the_minimal_set_has_the_same_dimension_and_predicts_the_same_torque(seed, n_v, gravity, branching):
    assert_minimal_set_predicts(structured_arm(seed, n_v, gravity=gravity, branching=branching), seed)


@pytest.mark.parametrize("name", builtin_names())
def test_builtin_arms_have_as_many_in_either_form(name):
    robot = load_robot(name)
    assert_minimal_set_predicts(robot, 0)
    numeric = base_parameters(torque_model(robot, "inertia"))
    assert barycentric_parameters(robot).base(numeric).n_b == numeric.n_b


@settings(max_examples=20)
@given(seed=st.integers(0, 10_000), n_v=st.integers(1, 6), gravity=st.sampled_from(GRAVITIES))
def test_masses_count_on_prismatic_joints_alone(seed, n_v, gravity):
    robot = structured_arm(seed, n_v, gravity=gravity)
    base = barycentric_parameters(robot).base(closed_form_base(robot))
    for index, joint in enumerate(robot.joints):
        assert (10 * index in base.unidentifiable) == (joint.kind == "revolute")


def test_planar_arm_needs_no_regrouping_at_all():
    base = barycentric_parameters(planar_arm()).base(closed_form_base(planar_arm()))
    assert base.formulas() == ("bx_1", "by_1", "Kzz_1", "bx_2", "by_2", "Kzz_2")


def test_parameters_carry_symbols_units_and_bounds_of_their_kind():
    parameters = barycentric_parameters(planar_arm()).parameters
    assert [item.name for item in parameters[10:15]] == ["mb_2", "bx_2", "by_2", "bz_2", "Kxx_2"]
    assert [item.unit for item in parameters[:5]] == ["kg", "kg m", "kg m", "kg m", "kg m^2"]
    assert {item.symbol for item in parameters if item.lower == 0.0} == {"mb", "Kxx", "Kyy", "Kzz"}


def test_a_base_set_of_more_than_rigid_links_is_refused():
    robot = planar_arm()
    with pytest.raises(ModelError, match="rigid links only; expected a base set of 20 parameters, got 22; make it of"):
        barycentric_parameters(robot).base(base_parameters(torque_model(robot, "inertia,rotor")))


def test_matrices_cannot_be_written_to():
    found = barycentric_parameters(planar_arm())
    assert not found.matrix.flags.writeable
    assert not found.inverse.flags.writeable
