"""Forward dynamics against Pinocchio, against inverse dynamics, and where no acceleration exists."""

from __future__ import annotations

import numpy as np
import pinocchio
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pinocchio_oracle import mass_matrices

from sample_arms import chain, planar_arm, random_states, random_tree
from tauhat.dynamics import base_parameters, inverse_dynamics, mass_matrix, torque_model
from tauhat.dynamics.forward import Masses, forward_dynamics, rotor_mass_matrix
from tauhat.errors import ArrayError, ModelError
from tauhat.robots import load_robot, pinocchio_model

seeds = st.integers(0, 10_000)
sizes = st.integers(1, 8)


def relative_error(ours, oracle):
    return np.abs(ours - oracle).max() / max(1.0, np.abs(oracle).max())


@given(seed=seeds, n_v=sizes)
def test_accelerations_of_any_tree_are_those_of_pinocchios_articulated_bodies(seed, n_v):
    rng = np.random.default_rng(seed)
    robot = random_tree(rng, n_v)
    model = pinocchio_model(robot)
    data = model.createData()
    rotor = rng.uniform(0.05, 1.0, n_v)
    model.armature[:] = rotor
    q, dq, tau = random_states(rng, 5, n_v)
    ours = forward_dynamics(robot, q, dq, tau, masses=Masses(robot.inertia, rotor))
    oracle = np.array([pinocchio.aba(model, data, *row).copy() for row in zip(q, dq, tau, strict=True)])
    assert relative_error(ours, oracle) < 1e-10


@given(seed=seeds, n_v=sizes)
def test_mass_matrix_of_a_chain_without_rotors_is_pinocchios(seed, n_v):
    rng = np.random.default_rng(seed)
    robot = random_tree(rng, n_v, branching=0.0)
    q, _, _ = random_states(rng, 3, n_v)
    ours = rotor_mass_matrix(robot, q, masses=Masses(robot.inertia, np.zeros(n_v)))
    for own, oracle in zip(ours, mass_matrices(robot, q), strict=True):
        assert relative_error(own, oracle) < 1e-12


@given(seed=seeds, n_v=sizes)
def test_mass_matrix_of_a_branched_tree_is_that_of_inverse_dynamics(seed, n_v):
    rng = np.random.default_rng(seed)
    robot = random_tree(rng, n_v, branching=0.8)
    q, _, _ = random_states(rng, 3, n_v)
    rotor = rng.uniform(size=n_v)
    assert (
        relative_error(
            rotor_mass_matrix(robot, q, masses=Masses(robot.inertia, rotor)), mass_matrix(robot, q) + np.diag(rotor)
        )
        < 1e-12
    )


@given(seed=seeds, kinds=st.text("RP", min_size=1, max_size=7))
def test_inverse_dynamics_of_the_acceleration_is_the_torque(seed, kinds):
    rng = np.random.default_rng(seed)
    robot = chain(rng, kinds)
    q, dq, tau = random_states(rng, 4, robot.n_v)
    rotor = np.full(robot.n_v, 0.1)
    ddq = forward_dynamics(robot, q, dq, tau, masses=Masses(robot.inertia, rotor))
    assert relative_error(inverse_dynamics(robot, q, dq, ddq) + rotor * ddq, tau) < 1e-9


def test_base_parameters_alone_accelerate_the_robot_as_all_standard_ones_do():
    robot = load_robot("ur5e")
    base = base_parameters(torque_model(robot, "inertia"))
    grouped = np.zeros(10 * robot.n_v)
    grouped[base.independent] = base.projection @ robot.inertia.ravel()
    q, dq, tau = random_states(np.random.default_rng(0), 50, robot.n_v)
    rotor = np.full(robot.n_v, 0.2)
    whole = forward_dynamics(robot, q, dq, tau, masses=Masses(robot.inertia, rotor))
    assert (grouped.reshape(-1, 10)[:, 0] == 0.0).any()
    ours = forward_dynamics(robot, q, dq, tau, masses=Masses(grouped.reshape(-1, 10), rotor))
    assert relative_error(ours, whole) < 1e-8


def test_threads_change_nothing():
    robot = planar_arm()
    q, dq, tau = random_states(np.random.default_rng(1), 101, 2)
    assert np.array_equal(forward_dynamics(robot, q, dq, tau), forward_dynamics(robot, q, dq, tau, threads=2))


def test_parameters_without_a_positive_definite_mass_matrix_are_refused_and_the_joint_named():
    robot = planar_arm()
    q, dq, tau = random_states(np.random.default_rng(1), 8, 2)
    inertia = robot.inertia.copy()
    inertia[1] *= -1.0
    for threads in (1, 2):
        with pytest.raises(ModelError, match=r"joint j\d, sample \d: the mass matrix is not positive definite"):
            forward_dynamics(robot, q, dq, tau, masses=Masses(inertia, np.zeros(2)), threads=threads)


def test_states_of_different_lengths_are_refused():
    q, dq, tau = random_states(np.random.default_rng(1), 8, 2)
    with pytest.raises(ArrayError, match=r"differ in length.*\[8, 8, 7\]"):
        forward_dynamics(planar_arm(), q, dq, tau[:7])
