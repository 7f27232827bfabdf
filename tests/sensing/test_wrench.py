"""Wrenches from joint torques against Pinocchio's Jacobians and NumPy's least squares."""

from __future__ import annotations

import numpy as np
import pinocchio
import pytest
from scipy.linalg import eigh

from sample_arms import random_tree
from tauhat.errors import ArrayError, RobotError, SensingError
from tauhat.robots import Robot, forward_kinematics, load_robot
from tauhat.robots.kinematics import pinocchio_model
from tauhat.sensing.wrench import DIRECTIONS, WrenchSolver, directions_named

HOME = np.array([0.0, -1.3, 1.6, -1.8, -1.4, 0.0])
UR5E = load_robot("ur5e")


def reference_jacobian(robot: Robot, q: np.ndarray, frame: str) -> np.ndarray:
    model = pinocchio_model(robot)
    data = model.createData()
    axes = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
    return pinocchio.computeFrameJacobian(model, data, q, model.getFrameId(frame), axes)


@pytest.mark.parametrize("name", ["ur5e", "panda", "crs_a465", "staubli_tx40"])
def test_jacobians_are_pinocchios(name):
    robot, rng = load_robot(name), np.random.default_rng(1)
    solver = WrenchSolver(robot=robot)
    for _ in range(10):
        q = rng.uniform(-2.0, 2.0, robot.n_v)
        jacobian, rotation = solver.jacobian(q)
        assert jacobian == pytest.approx(reference_jacobian(robot, q, solver.frame), abs=1e-12)
        assert rotation == pytest.approx(forward_kinematics(robot, q, frame=solver.frame).rotation, abs=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_jacobians_of_trees_see_only_the_way_to_the_base(seed):
    rng = np.random.default_rng(seed)
    robot = random_tree(rng, 7)
    q = rng.uniform(-1.0, 1.0, 7)
    for joint in robot.joint_names:
        jacobian, _ = WrenchSolver(robot=robot, frame=joint).jacobian(q)
        model = pinocchio_model(robot)
        data = model.createData()
        pinocchio.computeJointJacobians(model, data, q)
        axes = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
        assert jacobian == pytest.approx(
            pinocchio.getJointJacobian(model, data, model.getJointId(joint), axes), abs=1e-12
        )


@pytest.mark.parametrize("axes", ["base", "frame"])
@pytest.mark.parametrize("name", list(DIRECTIONS))
def test_torques_of_a_wrench_give_the_wrench_back(name, axes):
    solver = WrenchSolver(robot=UR5E, directions=DIRECTIONS[name], axes=axes, largest=(1e5, 1e5))
    rng = np.random.default_rng(2)
    wrench = DIRECTIONS[name] @ rng.uniform(-30.0, 30.0, DIRECTIONS[name].shape[1])
    rotation = forward_kinematics(UR5E, HOME, frame=solver.frame).rotation if axes == "frame" else np.eye(3)
    in_base = np.concatenate([rotation @ wrench[:3], rotation @ wrench[3:]])
    tau = reference_jacobian(UR5E, HOME, solver.frame).T @ in_base
    found = solver.at(HOME, tau, np.full(6, 0.01))
    assert found.wrench == pytest.approx(wrench, abs=1e-4)


def test_the_solution_is_that_of_weighted_least_squares_with_its_covariance():
    rng = np.random.default_rng(3)
    panda = load_robot("panda")
    solver = WrenchSolver(robot=panda, directions=DIRECTIONS["force"], largest=(1e6, 1e6))
    q, tau, variance = rng.uniform(-1.5, 1.5, 7), rng.normal(size=7), rng.uniform(0.1, 2.0, 7)
    jacobian = reference_jacobian(panda, q, solver.frame)[:3]
    weights = 1.0 / np.sqrt(variance)
    expected = np.linalg.lstsq((jacobian * weights).T, tau * weights, rcond=None)[0]
    found = solver.at(q, tau, variance)
    assert found.wrench[:3] == pytest.approx(expected, rel=1e-6)
    covariance = np.linalg.inv((jacobian / variance) @ jacobian.T)
    assert found.covariance[:3, :3] == pytest.approx(covariance, rel=1e-6)
    assert (found.wrench[3:] == 0.0).all()
    assert (found.covariance[3:] == 0.0).all()


def test_errors_that_belong_together_are_weighted_by_their_whole_covariance():
    rng = np.random.default_rng(5)
    panda = load_robot("panda")
    mixed = rng.normal(size=(7, 7))
    covariance = mixed @ mixed.T
    sizes = np.sqrt(covariance.diagonal())
    correlation = covariance / np.outer(sizes, sizes)
    solver = WrenchSolver(robot=panda, directions=DIRECTIONS["force"], largest=(1e6, 1e6), correlation=correlation)
    q, tau, std, own = rng.uniform(-1.5, 1.5, 7), rng.normal(size=7), rng.uniform(0.3, 1.5, 7), rng.uniform(0.0, 0.5, 7)
    jacobian = reference_jacobian(panda, q, solver.frame)[:3]
    for beside in (np.zeros(7), own):
        whole = np.diag(std) @ correlation @ np.diag(std) + np.diag(beside)
        lower = np.linalg.cholesky(whole)  # NumPy's least squares on errors made alike and independent
        expected = np.linalg.lstsq(np.linalg.solve(lower, jacobian.T), np.linalg.solve(lower, tau), rcond=None)[0]
        found = solver.along(q[None], tau[None], std[None] ** 2, own=beside[None])
        assert found.wrench[0, :3] == pytest.approx(expected, rel=1e-6)
        inverse = np.linalg.inv(jacobian @ np.linalg.inv(whole) @ jacobian.T)
        assert found.covariance[0, :3, :3] == pytest.approx(inverse, rel=1e-6)


@pytest.mark.parametrize(
    "correlation",
    [np.ones((6, 6)), 2.0 * np.eye(6), np.triu(np.full((6, 6), 0.1), 1) + np.eye(6)],
    ids=["singular", "no ones on the diagonal", "not symmetric"],
)
def test_a_correlation_that_is_none_is_refused(correlation):
    with pytest.raises(SensingError, match="correlation of the joints' errors"):
        WrenchSolver(robot=UR5E, correlation=correlation)


def test_a_direction_with_a_known_size_is_solved_with_that_prior():
    rng = np.random.default_rng(8)
    tau, variance = rng.normal(size=6), rng.uniform(0.5, 2.0, 6)
    sizes = np.array([4.0, 0.5, 200.0])
    solver = WrenchSolver(robot=UR5E, directions=DIRECTIONS["force"], sizes=sizes)
    jacobian, _ = solver.jacobian(HOME)
    columns = jacobian[:3].T
    information = columns.T @ (columns / variance[:, None]) + np.diag(sizes**-2.0)
    expected = np.linalg.solve(information, columns.T @ (tau / variance))
    found = solver.at(HOME, tau, variance)
    assert found.wrench[:3] == pytest.approx(expected, rel=1e-6)
    assert found.covariance[:3, :3] == pytest.approx(np.linalg.inv(information), rel=1e-6)
    usual = WrenchSolver(robot=UR5E, directions=DIRECTIONS["force"])
    same = WrenchSolver(robot=UR5E, directions=DIRECTIONS["force"], sizes=np.full(3, usual.largest[0]))
    assert same.at(HOME, tau, variance).wrench == pytest.approx(usual.at(HOME, tau, variance).wrench, abs=1e-12)


def test_a_direction_is_hidden_where_the_joints_tell_no_more_of_it_than_its_size():
    sizes = np.array([300.0, 0.5, 300.0])  # friction of half a newton across, which no joint of this arm can tell
    solver = WrenchSolver(robot=UR5E, directions=DIRECTIONS["force"], sizes=sizes)
    covariance = solver.at(HOME, np.zeros(6), np.ones(6)).covariance
    shares, dual = eigh(covariance[:3, :3], np.diag(sizes**2))  # the prior's own scaling, by SciPy
    assert np.flatnonzero(shares > 0.5).tolist() == [2]
    expected = sizes**2 * dual[:, 2]
    hidden = solver.hidden(covariance)
    assert hidden.shape == (6, 1)
    assert np.abs(hidden[:3, 0] @ expected) == pytest.approx(np.linalg.norm(expected))
    assert np.abs(hidden[3:]).max() < 1e-12
    sure = solver.at(HOME, np.zeros(6), np.full(6, 1e-4))
    assert solver.hidden(sure.covariance).shape[1] == 0


def test_hidden_directions_are_those_of_the_prior_whatever_directions_were_asked_for():
    rng = np.random.default_rng(9)
    mixed = rng.normal(size=(6, 3))
    solver = WrenchSolver(robot=UR5E, directions=mixed / np.linalg.norm(mixed, axis=0))
    found = solver.at(HOME, np.zeros(6), np.full(6, 1e12))  # joints that tell nothing: all that may act is hidden
    hidden = solver.hidden(found.covariance)
    scaled = mixed / np.repeat(solver.largest, 3)[:, None]
    assert hidden.T @ hidden == pytest.approx(np.eye(3), abs=1e-9)
    assert hidden @ (hidden.T @ scaled) == pytest.approx(scaled, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("sizes", [[1.0, 2.0], [1.0, 0.0, 1.0], [1.0, np.nan, 1.0]])
def test_sizes_that_mean_nothing_are_refused(sizes):
    with pytest.raises((SensingError, ArrayError)):
        WrenchSolver(robot=UR5E, directions=DIRECTIONS["force"], sizes=np.array(sizes))


def test_near_a_singularity_the_answer_stays_small_and_says_what_it_does_not_know():
    straight = np.array([0.0, -np.pi / 2, 0.0, -np.pi / 2, 0.0, 0.0])  # arm stretched upwards: fz loads no joint
    solver = WrenchSolver(robot=UR5E, largest=(500.0, 100.0))
    found = solver.at(straight, np.array([0.0, 0.3, -0.2, 0.1, 0.2, -0.1]), np.full(6, 0.25))
    assert np.abs(found.wrench[:3]).max() < 500.0
    assert found.standard_errors[2] == pytest.approx(500.0, rel=0.05)
    hidden = solver.hidden(found.covariance)
    assert hidden.shape[1] >= 1
    assert np.linalg.norm(hidden[2]) > 0.9  # fz is in it
    usual = solver.at(HOME, np.zeros(6), np.full(6, 0.25))
    assert solver.hidden(usual.covariance).shape[1] == 0


def test_one_known_direction_is_surer_than_three():
    rng = np.random.default_rng(4)
    errors = rng.normal(size=(400, 6)) * 0.5
    normal = DIRECTIONS["fz"]
    q, variance = np.tile(HOME, (400, 1)), np.full((400, 6), 0.25)
    tau = reference_jacobian(UR5E, HOME, "tool").T @ (30.0 * normal[:, 0]) + errors
    one = WrenchSolver(robot=UR5E, directions=normal).along(q, tau, variance)
    three = WrenchSolver(robot=UR5E, directions=DIRECTIONS["force"]).along(q, tau, variance)
    assert np.std(one.wrench[:, 2]) < np.std(three.wrench[:, 2])
    for found in (one, three):
        assert np.std(found.wrench[:, 2]) == pytest.approx(found.standard_errors[0, 2], rel=0.1)
        assert np.mean(found.wrench[:, 2]) == pytest.approx(30.0, abs=4.0 * found.standard_errors[0, 2] / 20.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"directions": np.zeros((6, 0))}, "one to six"),
        ({"directions": np.ones((6, 2)) / np.sqrt(6.0)}, "none a sum of the others"),
        ({"directions": 2.0 * np.eye(6)}, "unit length"),
        ({"axes": "world"}, "base or frame"),
        ({"largest": (0.0, 1.0)}, "sizes above zero"),
    ],
)
def test_settings_that_mean_nothing_are_refused(changes, message):
    with pytest.raises(SensingError, match=message):
        WrenchSolver(robot=UR5E, **changes)


def test_names_and_variances_are_checked():
    with pytest.raises(SensingError, match="unknown directions of a wrench"):
        directions_named("up")
    with pytest.raises(RobotError, match="no such frame"):
        WrenchSolver(robot=UR5E, frame="hand")
    with pytest.raises(SensingError, match="variance of external torque"):
        WrenchSolver(robot=UR5E).at(HOME, np.zeros(6), np.zeros(6))
    rows = np.zeros((1, 6))
    with pytest.raises(SensingError, match="own variance"):
        WrenchSolver(robot=UR5E).along(rows, rows, rows + 1.0, own=rows - 1.0)
