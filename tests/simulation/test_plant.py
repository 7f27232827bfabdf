"""The MuJoCo plant is the robot that the description says, with Pinocchio as the judge."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace

import mujoco
import numpy as np
import pinocchio
import pytest

from tauhat.dynamics import inverse_dynamics
from tauhat.errors import MissingExtraError, SimulationError
from tauhat.robots import builtin_names, load_robot
from tauhat.robots.joint import inertia_at_origin
from tauhat.robots.kinematics import pinocchio_model
from tauhat.robots.robot import Robot
from tauhat.simulation import build_plant, nominal_parameters, perturbed, plant_gravity_torque, plant_torque

BRANCHED = (-1, 0, 0, 1, 2, -1, 5)  # breadth first: MuJoCo numbers it otherwise


@pytest.mark.parametrize("options", [{}, {"parents": BRANCHED, "prismatic": (2, 5)}])
@pytest.mark.parametrize("seed", range(3))
def test_forward_dynamics_undo_pinocchios_inverse_dynamics(
    make_robot: Callable[..., Robot], seed: int, options: dict[str, tuple[int, ...]]
) -> None:
    robot = make_robot(seed, friction=0.0, **options)
    rng = np.random.default_rng(seed)
    parameters = replace(nominal_parameters(robot), viscous=rng.uniform(size=robot.n_v))
    plant = build_plant(robot, parameters=parameters)
    model = pinocchio_model(robot)
    data, state = model.createData(), mujoco.MjData(plant.model)
    for _ in range(20):
        q, dq, ddq = rng.standard_normal((3, robot.n_v))
        tau = pinocchio.rnea(model, data, q, dq, ddq) + parameters.rotor * ddq + parameters.viscous * dq
        state.qpos[plant.dof], state.qvel[plant.dof], state.qfrc_applied[plant.dof] = q, dq, tau
        mujoco.mj_forward(plant.model, state)
        np.testing.assert_allclose(state.qacc[plant.dof], ddq, rtol=0, atol=1e-8 * np.abs(ddq).max())


@pytest.mark.parametrize("options", [{}, {"parents": BRANCHED, "prismatic": (2, 5)}])
def test_gravity_torque_is_pinocchios(make_robot: Callable[..., Robot], options: dict[str, tuple[int, ...]]) -> None:
    robot = make_robot(5, **options)
    q = np.random.default_rng(5).standard_normal((10, robot.n_v))
    model = pinocchio_model(robot)
    data = model.createData()
    expected = np.array([pinocchio.computeGeneralizedGravity(model, data, row) for row in q])
    found = plant_gravity_torque(build_plant(robot), q)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10 * np.abs(expected).max())


def test_true_parameters_replace_the_nominal_ones(make_robot: Callable[..., Robot]) -> None:
    robot = make_robot()
    truth = perturbed(robot, np.random.default_rng(0), spread=0.3)
    heavier = replace(
        robot, joints=tuple(replace(j, inertia=link) for j, link in zip(robot.joints, truth.inertia, strict=True))
    )
    q = np.random.default_rng(1).standard_normal((5, 6))
    replaced = plant_gravity_torque(build_plant(robot, parameters=truth), q)
    np.testing.assert_allclose(replaced, plant_gravity_torque(build_plant(heavier), q), atol=1e-12)
    assert not np.allclose(replaced, plant_gravity_torque(build_plant(robot), q))


def test_a_flat_plate_is_accepted(make_robot: Callable[..., Robot]) -> None:
    robot, rng = make_robot(parents=(-1,)), np.random.default_rng(0)
    for _ in range(20):
        across, along = rng.uniform(0.01, 1.0, size=2)
        central = np.diag([across, along, across + along])
        plate = inertia_at_origin(mass=1.0, com=rng.standard_normal(3), inertia_at_com=central)
        model = build_plant(replace(robot, joints=(replace(robot.joints[0], inertia=plate),))).model
        np.testing.assert_allclose(np.sort(model.body_inertia[1]), np.sort(np.diag(central)), rtol=1e-9)


def test_a_resting_joint_is_held_by_coulomb_friction_and_slips_beyond_it(make_robot: Callable[..., Robot]) -> None:
    robot = replace(make_robot(parents=(-1,)), gravity=np.zeros(3))
    plant = build_plant(robot)
    data = mujoco.MjData(plant.model)
    data.qfrc_applied[0] = 0.9 * robot.joints[0].coulomb
    mujoco.mj_step(plant.model, data, 2000)
    assert abs(data.qpos[0]) < 1e-4
    data.qfrc_applied[0] = 1.1 * robot.joints[0].coulomb
    mujoco.mj_step(plant.model, data, 2000)
    assert data.qpos[0] > 1e-2
    assert -data.qfrc_constraint[0] == pytest.approx(robot.joints[0].coulomb, rel=1e-12)


def test_massless_link_is_named(make_robot: Callable[..., Robot]) -> None:
    robot = make_robot()
    joints = (*robot.joints[:3], replace(robot.joints[3], inertia=np.zeros(10)), *robot.joints[4:])
    with pytest.raises(SimulationError, match="link of joint axis 3: the link has no mass"):
        build_plant(replace(robot, joints=joints))


def test_parameters_of_another_robot_are_refused(make_robot: Callable[..., Robot]) -> None:
    other = nominal_parameters(make_robot(parents=(-1, 0)))
    with pytest.raises(SimulationError, match=r"another robot; expected 6 joints, got 2"):
        build_plant(make_robot(), parameters=other)


@pytest.mark.parametrize("timestep", [0.0, -1e-3, np.nan])
def test_timestep_must_be_a_positive_time(make_robot: Callable[..., Robot], timestep: float) -> None:
    with pytest.raises(SimulationError, match="timestep"):
        build_plant(make_robot(), timestep=timestep)


def test_missing_mujoco_names_the_extra(make_robot: Callable[..., Robot], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(MissingExtraError, match=r"mujoco is not installed; pip install 'tauhat\[simulation\]'"):
        build_plant(make_robot())


@pytest.mark.parametrize("name", builtin_names())
def test_mujoco_pinocchio_and_the_kernels_agree_on_every_builtin_robot(name: str) -> None:
    robot = load_robot(name)
    q, dq, ddq = np.random.default_rng(7).standard_normal((3, 20, robot.n_v))
    model = pinocchio_model(robot)
    data = model.createData()
    expected = np.array([pinocchio.rnea(model, data, *state) for state in zip(q, dq, ddq, strict=True)])
    tolerance = {"rtol": 0, "atol": 1e-8 * np.abs(expected).max()}
    np.testing.assert_allclose(inverse_dynamics(robot, q, dq, ddq), expected, **tolerance)
    rotor = nominal_parameters(robot).rotor
    np.testing.assert_allclose(plant_torque(build_plant(robot), q, dq, ddq) - rotor * ddq, expected, **tolerance)
