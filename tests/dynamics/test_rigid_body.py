"""Rigid-body dynamics against Pinocchio, a closed-form arm, and the laws of mechanics."""

from __future__ import annotations

import numpy as np
import pinocchio
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pinocchio_oracle import mass_matrices

from sample_arms import PLANAR, chain, planar_arm, random_states, random_tree, smooth_motion
from tauhat.dynamics import bias_torque, gravity_torque, inverse_dynamics, mass_matrix, regressor
from tauhat.errors import ArrayError
from tauhat.robots import EARTH, pinocchio_model

seeds = st.integers(0, 10_000)
sizes = st.integers(1, 8)


def _close(ours, oracle):
    return np.abs(ours - oracle).max() <= 1e-11 * max(1.0, np.abs(oracle).max())


@given(seed=seeds, n_v=sizes, n_t=st.sampled_from([1, 2, 63, 64, 65, 130]))
def test_regressor_of_any_tree_is_pinocchios(seed, n_v, n_t):
    rng = np.random.default_rng(seed)
    robot = random_tree(rng, n_v)
    model = pinocchio_model(robot)
    data = model.createData()
    q, dq, ddq = random_states(rng, n_t, n_v)
    ours = regressor(robot, q, dq, ddq)
    rows = zip(q, dq, ddq, strict=True)
    oracle = np.array([pinocchio.computeJointTorqueRegressor(model, data, *row).copy() for row in rows])
    assert ours.shape == (n_t, n_v, 10 * n_v)
    assert _close(ours, oracle.reshape(ours.shape))


@given(seed=seeds, n_v=sizes, n_t=st.sampled_from([1, 64, 70]))
def test_torques_of_any_tree_are_pinocchios(seed, n_v, n_t):
    rng = np.random.default_rng(seed)
    robot = random_tree(rng, n_v)
    model = pinocchio_model(robot)
    data = model.createData()
    q, dq, ddq = random_states(rng, n_t, n_v)
    zero = np.zeros(n_v)
    rows = list(zip(q, dq, ddq, strict=True))
    rnea = [[pinocchio.rnea(model, data, *state).copy() for state in states] for states in (
        rows, [(a, b, zero) for a, b, _ in rows], [(a, zero, zero) for a, _, _ in rows],
    )]  # fmt: skip
    assert _close(inverse_dynamics(robot, q, dq, ddq), np.array(rnea[0]))
    assert _close(bias_torque(robot, q, dq), np.array(rnea[1]))
    assert _close(gravity_torque(robot, q), np.array(rnea[2]))


@given(seed=seeds, n_v=sizes)
def test_mass_matrix_of_a_chain_is_pinocchios(seed, n_v):
    rng = np.random.default_rng(seed)
    robot = random_tree(rng, n_v, branching=0.0)
    q, _, _ = random_states(rng, 3, n_v)
    for own, oracle in zip(mass_matrix(robot, q), mass_matrices(robot, q), strict=True):
        assert _close(own, oracle)


@given(seed=seeds, n_v=sizes)
def test_mass_matrix_of_any_tree_is_symmetric_and_positive_definite(seed, n_v):
    rng = np.random.default_rng(seed)
    q, _, _ = random_states(rng, 5, n_v)
    mass = mass_matrix(random_tree(rng, n_v), q)
    assert np.allclose(mass, mass.transpose(0, 2, 1), atol=1e-12 * np.abs(mass).max())
    assert (np.linalg.eigvalsh(mass) > 0).all()


@given(seed=seeds, n_v=sizes)
def test_torque_is_mass_times_acceleration_plus_bias(seed, n_v):
    rng = np.random.default_rng(seed)
    robot = random_tree(rng, n_v)
    q, dq, ddq = random_states(rng, 67, n_v)
    sum_of_parts = np.einsum("tij,tj->ti", mass_matrix(robot, q), ddq) + bias_torque(robot, q, dq)
    assert _close(inverse_dynamics(robot, q, dq, ddq), sum_of_parts)


@given(seed=seeds, n_v=sizes)
def test_regressor_times_parameters_is_inverse_dynamics(seed, n_v):
    rng = np.random.default_rng(seed)
    robot = random_tree(rng, n_v)
    states = random_states(rng, 5, n_v)
    inertia = rng.normal(size=(n_v, 10))
    assert _close(regressor(robot, *states) @ inertia.ravel(), inverse_dynamics(robot, *states, inertia=inertia))
    assert _close(regressor(robot, *states) @ robot.inertia.ravel(), inverse_dynamics(robot, *states))


@given(seed=seeds, n_v=sizes)
def test_torque_is_linear_in_the_parameters(seed, n_v):
    rng = np.random.default_rng(seed)
    robot = random_tree(rng, n_v)
    states = random_states(rng, 5, n_v)
    first, second, weight = rng.normal(size=(n_v, 10)), rng.normal(size=(n_v, 10)), rng.normal()
    mixed = inverse_dynamics(robot, *states, inertia=first + weight * second)
    apart = inverse_dynamics(robot, *states, inertia=first) + weight * inverse_dynamics(robot, *states, inertia=second)
    assert _close(mixed, apart)


@given(seed=seeds, n_v=sizes)
def test_power_of_the_torque_is_the_rate_of_the_energy(seed, n_v):
    rng = np.random.default_rng(seed)
    robot = random_tree(rng, n_v)
    model = pinocchio_model(robot)
    data = model.createData()
    step = 1e-4
    t = np.array([-2, -1, 0, 1, 2]) * step + 0.3
    q, dq, ddq = smooth_motion(n_v, t, seed=seed)
    energy = [
        pinocchio.computeKineticEnergy(model, data, a, b) + pinocchio.computePotentialEnergy(model, data, a)
        for a, b in zip(q, dq, strict=True)
    ]
    rate = (energy[0] - 8 * energy[1] + 8 * energy[3] - energy[4]) / (12 * step)
    power = float(inverse_dynamics(robot, q, dq, ddq)[2] @ dq[2])
    assert rate == pytest.approx(power, rel=1e-6, abs=1e-6 * max(1.0, np.abs(energy).max()))


def _closed_form(q, dq, ddq):
    (m1, l1, c1, i1), (m2, _, c2, i2) = PLANAR
    cos2, sin2 = np.cos(q[:, 1]), np.sin(q[:, 1])
    m11 = i1 + m1 * c1**2 + i2 + m2 * (l1**2 + c2**2 + 2 * l1 * c2 * cos2)
    m12 = i2 + m2 * (c2**2 + l1 * c2 * cos2)
    pull = m2 * l1 * c2 * sin2
    far = m2 * c2 * 9.81 * np.cos(q.sum(axis=1))
    near = (m1 * c1 + m2 * l1) * 9.81 * np.cos(q[:, 0]) + far
    first = m11 * ddq[:, 0] + m12 * ddq[:, 1] - pull * (2 * dq[:, 0] * dq[:, 1] + dq[:, 1] ** 2) + near
    second = m12 * ddq[:, 0] + (i2 + m2 * c2**2) * ddq[:, 1] + pull * dq[:, 0] ** 2 + far
    return np.column_stack([first, second])


def test_planar_arm_has_the_textbooks_torque():
    states = random_states(np.random.default_rng(1), 40, 2)
    assert np.allclose(inverse_dynamics(planar_arm(), *states), _closed_form(*states), rtol=0, atol=1e-12)


def test_link_held_out_horizontally_needs_a_positive_torque_of_its_weight():
    (m1, l1, c1, _), (m2, _, c2, _) = PLANAR
    torque = gravity_torque(planar_arm(), np.zeros((1, 2)))[0]
    assert torque[0] == pytest.approx(9.81 * (m1 * c1 + m2 * (l1 + c2)), rel=1e-14)
    assert torque[1] == pytest.approx(9.81 * m2 * c2, rel=1e-14)


def test_ceiling_mount_turns_the_gravity_torque_around():
    rng = np.random.default_rng(2)
    robot = chain(rng, "RRPR")
    q, _, _ = random_states(rng, 10, 4)
    hung = robot.with_gravity(-np.array(EARTH))
    assert np.abs(gravity_torque(robot, q)).max() > 1.0
    assert np.allclose(gravity_torque(hung, q), -gravity_torque(robot, q), atol=1e-12)


def test_vertical_slide_carries_its_mass():
    rng = np.random.default_rng(3)
    robot = chain(rng, "P")
    lift = robot.joints[0].rotation @ robot.joints[0].axis
    expected = robot.inertia[0, 0] * (2.0 - lift @ np.array(EARTH))
    torque = inverse_dynamics(robot, np.array([[0.3]]), np.array([[0.7]]), np.array([[2.0]]))
    assert torque[0, 0] == pytest.approx(expected, rel=1e-13)


def test_links_do_not_load_joints_that_do_not_carry_them():
    rng = np.random.default_rng(4)
    robot = random_tree(rng, 8, branching=0.7)
    columns = regressor(robot, *random_states(rng, 20, 8)).reshape(20, 8, 8, 10)
    loaded = np.abs(columns).max(axis=(0, 3)) > 0
    expected = np.array([[link in robot.subtree(joint) for link in range(8)] for joint in range(8)])
    assert not expected.all(axis=None)
    assert np.array_equal(loaded, expected)


def test_no_samples_give_no_rows():
    empty = np.zeros((0, 2))
    assert regressor(planar_arm(), empty, empty, empty).shape == (0, 2, 20)
    assert inverse_dynamics(planar_arm(), empty, empty, empty).shape == (0, 2)


@pytest.mark.parametrize("name", ["q", "dq", "ddq"])
def test_states_of_another_width_are_refused(name):
    states = {key: np.zeros((3, 2)) for key in ("q", "dq", "ddq")} | {name: np.zeros((3, 3))}
    with pytest.raises(ArrayError, match=rf"^{name} has the wrong shape; expected \(any, 2\), got \(3, 3\)"):
        regressor(planar_arm(), **states)


def test_states_of_different_length_are_refused():
    with pytest.raises(ArrayError, match="differ in length"):
        inverse_dynamics(planar_arm(), np.zeros((3, 2)), np.zeros((4, 2)), np.zeros((3, 2)))


def test_infinite_speed_is_refused_with_its_place():
    dq = np.zeros((3, 2))
    dq[2, 1] = np.inf
    with pytest.raises(ArrayError, match=r"dq is not finite; got inf at index \(2, 1\)"):
        regressor(planar_arm(), np.zeros((3, 2)), dq, np.zeros((3, 2)))
