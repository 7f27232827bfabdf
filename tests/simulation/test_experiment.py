"""Simulated experiments: truth that obeys the equation of motion sample by sample, and recordings that show it."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio
import pytest

from tauhat.arrays import FloatArray
from tauhat.control import PDGravity
from tauhat.errors import SimulationError, TauhatWarning
from tauhat.excitation import FourierSeries, random_fourier
from tauhat.robots.kinematics import pinocchio_model
from tauhat.robots.robot import Robot
from tauhat.simulation import (
    ExperimentSettings,
    SensorErrors,
    Simulation,
    TrueParameters,
    perturbed,
    simulate,
    tracking_gains,
)

BRANCHED = (-1, 0, 0, 1, 2, -1, 5)  # breadth first: MuJoCo numbers it otherwise
MakeRobot = Callable[..., Robot]


def motion_of(robot: Robot, *, seed: int = 0, period: float = 3.0) -> FourierSeries:
    return random_fourier(robot, period=period, harmonics=3, rng=np.random.default_rng(seed), margin=0.2)


def run(robot: Robot, **options: Any) -> Simulation:
    seed = options.pop("seed", 0)
    motion = options.pop("motion", None) or motion_of(robot)
    return simulate(robot, motion, rng=np.random.default_rng(seed), **options)


def true_robot(robot: Robot, parameters: TrueParameters) -> Robot:
    pairs = zip(robot.joints, parameters.inertia, strict=True)
    return replace(robot, joints=tuple(replace(joint, inertia=link) for joint, link in pairs))


def torque_without_coulomb(robot: Robot, done: Simulation) -> FloatArray:
    truth, parameters = done.truth, done.truth.parameters
    model = pinocchio_model(true_robot(robot, parameters))
    data = model.createData()
    states = zip(truth.q, truth.dq, truth.ddq, strict=True)
    rigid = np.array([pinocchio.rnea(model, data, q, dq, ddq) for q, dq, ddq in states])
    return rigid + parameters.rotor * truth.ddq + parameters.viscous * truth.dq + parameters.offset


RATES = [
    ExperimentSettings(),
    ExperimentSettings(timestep=1e-3, control_rate=1000.0),
    ExperimentSettings(timestep=2.5e-4, control_rate=1000.0, sample_rate=250.0),
]


@pytest.mark.parametrize("settings", RATES, ids=["default", "one rate", "substeps"])
@pytest.mark.parametrize("options", [{}, {"parents": BRANCHED, "prismatic": (2, 5)}], ids=["arm", "tree"])
def test_true_torque_is_pinocchios_inverse_dynamics_of_the_true_motion(
    make_robot: MakeRobot, options: dict[str, Any], settings: ExperimentSettings
) -> None:
    robot = make_robot(1, **options)
    parameters = perturbed(robot, np.random.default_rng(1), spread=0.2)
    frictionless = replace(parameters, coulomb=np.zeros(robot.n_v))
    done = run(robot, parameters=frictionless, settings=settings)
    expected = torque_without_coulomb(robot, done)
    np.testing.assert_allclose(done.truth.tau, expected, rtol=0, atol=1e-8 * np.abs(expected).max())
    assert not done.truth.coulomb_torque.any()


@pytest.mark.parametrize("options", [{}, {"parents": BRANCHED, "prismatic": (2, 5)}], ids=["arm", "tree"])
def test_dry_friction_is_ideal_while_joints_move(make_robot: MakeRobot, options: dict[str, Any]) -> None:
    robot = make_robot(2, **options)
    parameters = perturbed(robot, np.random.default_rng(2), spread=0.2)
    done = run(robot, parameters=parameters)
    smooth, truth = torque_without_coulomb(robot, done), done.truth
    tolerance = 1e-8 * np.abs(truth.tau).max()
    np.testing.assert_allclose(truth.tau, smooth + truth.coulomb_torque, rtol=0, atol=tolerance)
    moving = np.abs(truth.dq) > 0.01
    ideal = parameters.coulomb * np.sign(truth.dq)
    np.testing.assert_allclose(truth.tau[moving], (smooth + ideal)[moving], rtol=0, atol=tolerance)
    assert moving.mean() > 0.8
    assert (np.abs(truth.coulomb_torque) <= parameters.coulomb * (1.0 + 1e-12)).all()


def test_motor_work_becomes_energy_and_friction_heat(make_robot: MakeRobot) -> None:
    robot = make_robot(3)
    parameters = perturbed(robot, np.random.default_rng(3), spread=0.2)
    done = run(robot, parameters=parameters)
    truth, t = done.truth, done.recording.t
    model = pinocchio_model(true_robot(robot, parameters))
    data = model.createData()
    energy = np.array(
        [
            pinocchio.computeKineticEnergy(model, data, q, dq) + pinocchio.computePotentialEnergy(model, data, q)
            for q, dq in zip(truth.q, truth.dq, strict=True)
        ]
    )
    energy += 0.5 * truth.dq**2 @ parameters.rotor
    power = (truth.tau * truth.dq).sum(axis=1)
    lost = ((truth.coulomb_torque + parameters.viscous * truth.dq + parameters.offset) * truth.dq).sum(axis=1)
    stored = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(t) * ((power - lost)[1:] + (power - lost)[:-1]))])
    np.testing.assert_allclose(stored, energy - energy[0], rtol=0, atol=2e-3 * np.trapezoid(np.abs(power), t))


def test_true_velocity_and_acceleration_are_those_of_the_logged_position(make_robot: MakeRobot) -> None:
    done = run(make_robot(4, friction=0.0))
    q, dq, ddq, h = done.recording.q, done.truth.dq, done.truth.ddq, 1e-3
    by_difference = (q[2:] - q[:-2]) / (2.0 * h)
    curvature = (q[2:] - 2.0 * q[1:-1] + q[:-2]) / h**2
    for found, true in ((by_difference, dq), (curvature, ddq)):
        assert np.sqrt(np.mean((found - true[1:-1]) ** 2)) < 2e-3 * np.sqrt(np.mean(true**2))


def test_log_starts_with_the_motion_at_rest_and_follows_it(make_robot: MakeRobot) -> None:
    robot = make_robot(5)
    done = run(robot, parameters=perturbed(robot, np.random.default_rng(5)))
    recording, truth = done.recording, done.truth
    np.testing.assert_allclose(recording.t, np.arange(3001) / 1000.0, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(truth.reference.t, recording.t)
    assert np.abs(truth.dq[0]).max() < 1e-3
    assert np.abs(truth.q - truth.reference.q).max() < 0.05
    assert recording.joint_names == robot.joint_names


def test_without_settling_the_log_starts_exactly_in_the_start_pose(make_robot: MakeRobot) -> None:
    done = run(make_robot(6), settings=ExperimentSettings(settle=0.0))
    np.testing.assert_array_equal(done.truth.q[0], done.truth.reference.q[0])
    np.testing.assert_array_equal(done.truth.dq[0], 0.0)


def test_a_given_controller_is_used(make_robot: MakeRobot) -> None:
    robot = make_robot(7)
    soft = tracking_gains(robot, motion_of(robot).sample(np.linspace(0, 3, 50)).q, bandwidth=2.0, control_rate=2000.0)
    errors = [
        np.abs(done.truth.q - done.truth.reference.q).max()
        for done in (run(robot), run(robot, settings=ExperimentSettings(controller=soft)))
    ]
    assert errors[1] > 3.0 * errors[0]


def test_same_seed_gives_the_same_recording_and_noise_leaves_the_truth_alone(make_robot: MakeRobot) -> None:
    robot = make_robot(8)
    settings = ExperimentSettings(sensors=SensorErrors(encoder_step=1e-4, torque_noise=0.1, velocity_noise=1e-3))
    first, again, other = (run(robot, settings=settings, seed=seed) for seed in (1, 1, 2))
    for name in ("t", "q", "dq", "tau"):
        np.testing.assert_array_equal(getattr(first.recording, name), getattr(again.recording, name))
    assert not np.array_equal(first.recording.tau, other.recording.tau)
    np.testing.assert_array_equal(first.truth.tau, other.truth.tau)
    noise = first.recording.tau - first.truth.tau
    assert noise.std() == pytest.approx(0.1, rel=0.03)
    assert np.abs(first.recording.q - first.truth.q).max() <= 0.5e-4 * (1.0 + 1e-9)


def test_arrays_of_the_truth_are_read_only(make_robot: MakeRobot) -> None:
    truth = run(make_robot(9), motion=motion_of(make_robot(9), period=0.5)).truth
    for name in ("q", "dq", "ddq", "tau", "coulomb_torque"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(truth, name)[0] = 0.0


def test_unstable_gains_are_reported_and_leave_no_file_behind(
    make_robot: MakeRobot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    wild = PDGravity(kp=np.full(6, 1e18), kd=np.full(6, 1e18))
    with pytest.raises(SimulationError, match=r"arm, joint axis \d: the simulated robot went unstable.*gains"):
        run(make_robot(), settings=ExperimentSettings(controller=wild))
    assert not list(tmp_path.iterdir())
    assert capfd.readouterr() == ("", "")


def test_torque_at_its_limit_warns_with_its_share(make_robot: MakeRobot) -> None:
    with pytest.warns(TauhatWarning, match=r"arm, joint axis \d: torque at its limit in \d+\.\d % of the samples"):
        run(make_robot(effort=20.0))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run(make_robot(effort=300.0))


def test_a_joint_without_torque_is_named(make_robot: MakeRobot) -> None:
    with pytest.raises(SimulationError, match="joint axis 0: the joint has no torque"):
        run(make_robot(effort=0.0))


def test_motion_of_another_robot_is_refused(make_robot: MakeRobot) -> None:
    with pytest.raises(SimulationError, match="motion is of another robot; expected 6, got 2"):
        run(make_robot(), motion=motion_of(make_robot(parents=(-1, 0))))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"timestep": 0.0}, "setting timestep"),
        ({"sample_rate": np.inf}, "setting sample_rate"),
        ({"settle": -1.0}, "setting settle"),
        ({"timestep": 3e-4}, "timesteps in a control period"),
        ({"timestep": 1e-3}, "timesteps in a control period"),
        ({"sample_rate": 900.0}, "control periods in a sample period"),
        ({"sample_rate": 4000.0}, "control periods in a sample period"),
    ],
)
def test_clocks_that_do_not_fit_are_refused(settings: dict[str, float], message: str) -> None:
    with pytest.raises(SimulationError, match=message):
        ExperimentSettings(**settings)


def test_gains_stay_stable_at_a_slow_control_rate(make_robot: MakeRobot) -> None:
    settings = ExperimentSettings(timestep=5e-3, control_rate=200.0, sample_rate=200.0, bandwidth=30.0)
    done = run(make_robot(10), settings=settings)
    assert np.abs(done.truth.q - done.truth.reference.q).max() < 0.2
