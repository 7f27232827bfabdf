"""Momentum and its drift against Pinocchio's mass and Coriolis matrices, and against each other."""

from __future__ import annotations

import numpy as np
import pinocchio
import pytest

from sample_arms import random_tree
from tauhat.dynamics import base_parameters, torque_model
from tauhat.dynamics.momentum_kernel import momentum_kernel
from tauhat.dynamics.tree import kernel_tree
from tauhat.robots import load_robot
from tauhat.robots.kinematics import pinocchio_model
from tauhat.robots.library import builtin_names


def momentum(robot, inertia, q, dq, rotor=None):
    out = np.empty((len(q), 2, robot.n_v))
    rotors = np.zeros((robot.n_v, robot.n_v)) if rotor is None else rotor
    body, work = (kernel_tree(robot).links, inertia, rotors), np.empty(40 * robot.n_v)
    for k in range(len(q)):
        momentum_kernel(body, q[k], dq[k], work, out[k])
    return out[:, 0], out[:, 1]


@pytest.mark.parametrize("name", builtin_names())
def test_momentum_and_drift_are_those_of_pinocchios_matrices(name):
    robot, rng = load_robot(name), np.random.default_rng(2)
    model = pinocchio_model(robot)
    data = model.createData()
    q, dq = rng.uniform(-2.0, 2.0, (2, 20, robot.n_v))
    p, drift = momentum(robot, np.array(robot.inertia), q, dq)
    for k in range(20):
        mass = pinocchio.crba(model, data, q[k])
        mass = np.triu(mass) + np.triu(mass, 1).T
        coriolis = pinocchio.computeCoriolisMatrix(model, data, q[k], dq[k])
        gravity = pinocchio.computeGeneralizedGravity(model, data, q[k])
        scale = np.abs(coriolis.T @ dq[k]).max() + np.abs(gravity).max() + 1e-9
        assert np.abs(p[k] - mass @ dq[k]).max() < 1e-12 * max(1.0, np.abs(p[k]).max())
        assert np.abs(drift[k] - (coriolis.T @ dq[k] - gravity)).max() < 1e-12 * max(1.0, scale)


@pytest.mark.parametrize("seed", range(4))
def test_trees_of_sliding_and_turning_joints_are_no_exception(seed):
    rng = np.random.default_rng(seed)
    robot = random_tree(rng, 7)
    model = pinocchio_model(robot)
    data = model.createData()
    inertia, still = np.array(robot.inertia), np.zeros(robot.n_v)
    q, dq = rng.uniform(-1.0, 1.0, (2, robot.n_v))
    (p,), (drift,) = momentum(robot, inertia, q[None], dq[None])
    # Momentum is the torque of an acceleration dq without speed and gravity.
    weight = pinocchio.rnea(model, data, q, still, still)
    assert p == pytest.approx(pinocchio.rnea(model, data, q, still, dq) - weight, rel=1e-10, abs=1e-10)
    # The drift is the slope of the kinetic energy, here in sixth-order differences, less gravity.
    h = 1e-2
    around = q + h * (np.arange(7) - 3)[:, None, None] * np.eye(robot.n_v)  # (step, joint, n_v)
    moving, _ = momentum(robot, inertia, around.reshape(-1, robot.n_v), np.tile(dq, (7 * robot.n_v, 1)))
    energy = 0.5 * (moving @ dq).reshape(7, robot.n_v)
    slope = np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) @ energy / (60.0 * h)
    assert drift + weight == pytest.approx(slope, rel=1e-8, abs=1e-8)


def test_base_parameters_have_the_momentum_of_the_whole_arm_and_rotors_add_theirs():
    robot, rng = load_robot("ur5e"), np.random.default_rng(3)
    model = torque_model(robot, "inertia")
    base = base_parameters(model)
    regrouped = np.zeros(model.n_p)
    regrouped[base.independent] = base.projection @ robot.inertia.ravel()
    q, dq, root = *rng.uniform(-2.0, 2.0, (2, 10, 6)), rng.uniform(0.1, 1.0, (6, 6))
    rotor = root @ root.T
    p, drift = momentum(robot, np.array(robot.inertia), q, dq)
    p_base, drift_base = momentum(robot, regrouped.reshape(-1, 10), q, dq, rotor)
    assert p_base - dq @ rotor == pytest.approx(p, abs=1e-9)
    assert drift_base == pytest.approx(drift, abs=1e-9)


def test_momentum_changes_by_drift_along_a_free_fall():
    # Along any motion dp/dt = tau + drift, with tau from inverse dynamics: here in sixth-order differences.
    robot = load_robot("panda")
    model = pinocchio_model(robot)
    data = model.createData()
    h = 1e-3
    t = (np.arange(7) - 3) * h
    phase = np.arange(robot.n_v)
    q = 0.5 * np.sin(2.0 * t[:, None] + phase)
    dq = np.cos(2.0 * t[:, None] + phase)
    ddq = -2.0 * np.sin(2.0 * t[:, None] + phase)
    p, drift = momentum(robot, np.array(robot.inertia), q, dq)
    slope = np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) @ p / (60.0 * h)
    tau = pinocchio.rnea(model, data, q[3], dq[3], ddq[3])
    assert slope == pytest.approx(tau + drift[3], rel=1e-9, abs=1e-9)
