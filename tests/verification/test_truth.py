"""Comparison of an estimate with the truth behind a simulated log."""

from __future__ import annotations

import numpy as np
import pytest

from tauhat.dynamics.model import TorqueModel, torque_model
from tauhat.dynamics.rigid_body import inverse_dynamics
from tauhat.errors import SimulationError
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.identify import identify
from tauhat.excitation.fourier import random_fourier
from tauhat.robots.library import load_robot
from tauhat.simulation.experiment import ExperimentSettings, Simulation, simulate
from tauhat.simulation.parameters import TrueParameters, nominal_parameters
from tauhat.simulation.sensors import SensorErrors
from tauhat.simulation.typical import typical_plant
from tauhat.verification.truth import compare_with_truth, standard_parameters


@pytest.fixture(scope="module")
def simulated() -> tuple[TorqueModel, Simulation]:
    robot = load_robot("two_link")
    rng = np.random.default_rng(5)
    motion = random_fourier(robot, period=5.0, harmonics=4, rng=rng)
    settings = ExperimentSettings(sample_rate=250.0, sensors=SensorErrors(torque_noise=0.2))
    return torque_model(robot), simulate(robot, motion, rng=rng, settings=settings)


@pytest.fixture(scope="module")
def estimate(simulated: tuple[TorqueModel, Simulation]) -> Estimate:
    model, simulation = simulated
    return identify(model, [simulation.recording])


def test_true_parameters_are_in_the_order_of_the_model() -> None:
    robot = load_robot("two_link")
    model = torque_model(robot)
    truth = nominal_parameters(robot)
    values = dict(zip([p.name for p in model.parameters], standard_parameters(model, truth), strict=True))
    assert values["m_2"] == robot.joints[1].inertia[0]
    assert values["Izz_1"] == robot.joints[0].inertia[9]
    assert (values["Ia_2"], values["Fv_1"], values["Fc_2"], values["To_1"]) == (0.03, 2.0, 0.6, 0.0)


def test_true_parameters_make_the_torque_of_inverse_dynamics() -> None:
    robot = load_robot("two_link")
    model = torque_model(robot, "inertia")
    q, dq, ddq = np.random.default_rng(0).normal(size=(3, 50, 2))
    from tauhat.dynamics.motion import motion_from_rows

    layout = model.layout()
    columns, _ = model.columns(motion_from_rows(q, dq, ddq), layout)
    values = standard_parameters(model, nominal_parameters(robot))[layout.parameters]
    torque = np.array([values[layout.of_joint(j)] @ columns[layout.of_joint(j)] for j in range(2)]).T
    np.testing.assert_allclose(torque, inverse_dynamics(robot, q, dq, ddq), atol=1e-10)


def test_an_estimate_from_a_noisy_log_is_nearer_to_the_truth_than_the_log(
    simulated: tuple[TorqueModel, Simulation], estimate: Estimate
) -> None:
    _, simulation = simulated
    compared = compare_with_truth(estimate, simulation.truth)
    noise = np.linalg.norm(simulation.recording.tau - simulation.truth.tau) / np.linalg.norm(simulation.truth.tau)
    assert compared.relative_rms < 0.5 * noise
    assert len(compared.joints) == 2
    assert compared.share_inside == compared.inside.mean() > 0.6
    assert compared.to_dict()["base_parameters"] == 13


def test_a_delay_of_the_log_that_the_estimate_makes_up_for_is_none_of_the_truths(
    simulated: tuple[TorqueModel, Simulation],
) -> None:
    from dataclasses import replace

    from tauhat.recordings import Processing

    model, simulation = simulated
    truth, late = simulation.truth, 5
    q, tau = truth.q[late:], truth.tau[:-late]
    log = replace(simulation.recording, t=truth.reference.t[late:], q=q, dq=None, tau=tau)
    step = float(np.diff(truth.reference.t[:2])[0])
    settings = Processing(cutoff=8.0, motion_cutoff=24.0)
    estimates = [
        identify(model, [log if delay else simulation.recording], processing=replace(settings, delay=delay))
        for delay in (0.0, -late * step)
    ]
    at_once, made_up_for = (compare_with_truth(estimate, truth).relative_rms for estimate in estimates)
    assert made_up_for < 1.2 * at_once + 1e-3


def test_an_estimate_from_torques_behind_the_gear_is_compared_with_those() -> None:
    robot, rng = load_robot("two_link"), np.random.default_rng(6)
    motion = random_fourier(robot, period=5.0, harmonics=4, rng=rng)
    sensors = SensorErrors(torque_noise=0.05, torque_side="link")
    truth = typical_plant(robot, "spring", rng=rng)
    settings = ExperimentSettings(sample_rate=250.0, sensors=sensors)
    done = simulate(robot, motion, rng=rng, parameters=truth, settings=settings)
    estimate = identify(torque_model(robot, "inertia,offset,spring"), [done.recording])
    there = compare_with_truth(estimate, done.truth, torque_side="link")
    assert there.relative_rms < 0.01
    assert there.share_inside > 0.7
    assert compare_with_truth(estimate, done.truth).relative_rms > 0.05


def test_a_wrong_truth_is_seen(simulated: tuple[TorqueModel, Simulation], estimate: Estimate) -> None:
    from dataclasses import replace

    _, simulation = simulated
    known = simulation.truth.parameters
    double = TrueParameters(
        inertia=2 * known.inertia, rotor=known.rotor, viscous=known.viscous, coulomb=known.coulomb, offset=known.offset
    )
    truth = replace(simulation.truth, parameters=double, tau=2 * simulation.truth.tau)
    compared = compare_with_truth(estimate, truth)
    assert compared.share_inside < 0.7
    assert compared.relative_rms == pytest.approx(0.5, abs=0.05)


def test_a_parameter_that_the_simulation_does_not_know_is_refused(simulated: tuple[TorqueModel, Simulation]) -> None:
    from dataclasses import dataclass
    from typing import ClassVar

    from tauhat.dynamics.terms import Offset

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Wind(Offset):
        key: ClassVar[str] = "wind"
        symbols: ClassVar[tuple[str, ...]] = ("Wi",)

    model, simulation = simulated
    with pytest.raises(SimulationError, match="no such parameter; got Wi"):
        standard_parameters(TorqueModel(robot=model.robot, terms=(Wind(),)), simulation.truth.parameters)
