"""Control of the plant: delay, encoders, feedforward, other people's controllers and environments."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pinocchio
import pytest
from effect_plants import TOOL, loaded_model, with_every_effect

from tauhat.arrays import FloatArray
from tauhat.control import PD, PID, ControlSample, PDFeedforward, PDGravity
from tauhat.errors import SimulationError
from tauhat.excitation import FourierSeries, random_fourier
from tauhat.robots import load_robot
from tauhat.simulation import (
    ElasticJoints,
    Encoder,
    ExperimentSettings,
    Simulation,
    TrueParameters,
    build_plant,
    nominal_parameters,
    plant_gravity_torque,
    simulate,
)

ARM = load_robot("ur5e")
NOMINAL = nominal_parameters(ARM)
FAST = ExperimentSettings(timestep=1e-3, control_rate=1000.0, settle=0.0)
GAINS = {"kp": np.linspace(2000.0, 200.0, 6), "kd": np.linspace(200.0, 10.0, 6)}


def motion(seed: int = 1, period: float = 2.0) -> FourierSeries:
    return random_fourier(ARM, period=period, harmonics=3, rng=np.random.default_rng(seed), margin=0.3)


def run(truth: TrueParameters = NOMINAL, environment: Any = None, **changes: Any) -> Simulation:
    settings = replace(FAST, **changes)
    rng = np.random.default_rng(0)
    return simulate(ARM, motion(), rng=rng, parameters=truth, settings=settings, environment=environment)


@dataclass(frozen=True)
class Witness:
    """A gravity controller that remembers what it was shown."""

    seen: list[ControlSample] = field(default_factory=list)
    feedforward: str = "gravity"
    torque_limit: FloatArray = field(default_factory=lambda: np.full(6, np.inf))

    def start(self, _: ControlSample) -> int:
        self.seen.clear()
        return 0

    def step(self, memory: int, sample: ControlSample) -> tuple[int, FloatArray]:
        self.seen.append(sample)
        torque = sample.feedforward + 400.0 * (sample.q_ref - sample.q) + 40.0 * (sample.dq_ref - sample.dq)
        return memory + 1, torque


@pytest.mark.parametrize("periods", [0, 1, 4])
@pytest.mark.parametrize("controller", [PDGravity(kp=np.zeros(6), kd=np.zeros(6)), Witness()], ids=["law", "object"])
def test_a_delay_shifts_the_command_by_exactly_its_periods(controller: Any, periods: int) -> None:
    truth = replace(NOMINAL, viscous=np.full(6, 50.0))
    known = run(truth, controller=controller, control_delay=periods * 1e-3).truth
    if isinstance(controller, Witness):
        error, rate = known.reference.q - known.q, known.reference.dq - known.dq
    else:
        error = rate = np.zeros_like(known.q)
    gravity = plant_gravity_torque(build_plant(ARM), known.reference.q)
    command = gravity + 400.0 * error + 40.0 * rate
    np.testing.assert_allclose(known.tau[periods:], command[: len(command) - periods], atol=1e-9)
    np.testing.assert_allclose(known.tau[:periods], np.tile(gravity[0], (periods, 1)), atol=1e-12)


def test_a_controller_is_told_the_time_the_reference_and_the_torque_before() -> None:
    witness = Witness()
    known = run(controller=witness, settle=0.01).truth
    samples = witness.seen
    assert len(samples) == 10 + known.q.shape[0]
    np.testing.assert_allclose([sample.t for sample in samples], 1e-3 * (np.arange(len(samples)) - 10), atol=1e-12)
    for name in ("q", "dq", "ddq"):
        reference = np.array([getattr(sample, f"{name}_ref") for sample in samples[10:]])
        np.testing.assert_allclose(reference, getattr(known.reference, name), atol=1e-9)
    assert not np.any([sample.dq_ref for sample in samples[:10]])
    np.testing.assert_array_equal([sample.tau for sample in samples[11:]], known.tau[:-1])
    np.testing.assert_array_equal([sample.q for sample in samples[10:]], known.q)


def test_the_controller_sees_the_motor_in_steps_and_its_speed_by_differences() -> None:
    gears = ElasticJoints(joints=(0, 1, 2), stiffness=np.full(3, 5000.0), damping=np.full(3, 10.0))
    truth, witness, step = replace(NOMINAL, elasticity=gears), Witness(), 1e-3
    known = run(truth, controller=witness, encoder=Encoder(side="motor", step=step, velocity="differenced")).truth
    seen = np.array([sample.q for sample in witness.seen])
    np.testing.assert_allclose(seen, step * np.round(known.motor_q / step), atol=1e-12)
    speeds = np.array([sample.dq for sample in witness.seen])
    np.testing.assert_allclose(speeds[1:], np.diff(seen, axis=0) / 1e-3, atol=1e-12)
    assert not speeds[0].any()
    assert np.abs(known.motor_q - known.q).max() > step


def test_the_whole_models_feedforward_leaves_the_smallest_error_to_feedback() -> None:
    truth = replace(NOMINAL, coulomb=0.2 * NOMINAL.coulomb)
    robot = replace(ARM, joints=tuple(replace(joint, coulomb=0.2 * joint.coulomb) for joint in ARM.joints))
    errors = []
    for law in (PD, PDGravity, PDFeedforward):
        done = simulate(
            robot, motion(), rng=np.random.default_rng(0), parameters=truth,
            settings=replace(FAST, controller=law(**GAINS)),
        )  # fmt: skip
        errors.append(np.abs(done.truth.q - done.truth.reference.q)[:, 1:3].max())
    assert errors[2] < 0.2 * errors[1] < 0.2 * errors[0]


def test_an_integral_carries_a_payload_that_proportional_control_lets_hang() -> None:
    truth = replace(NOMINAL, attached=(TOOL,), coulomb=np.zeros(6))
    pose = np.array([0.0, -1.2, 1.0, 0.2, 0.3, 0.0])
    still = FourierSeries(period=3.0, coefficients=np.zeros((6, 4)), offset=pose)
    sags = []
    for law in (PD(**GAINS), PID(**GAINS, ki=5.0 * GAINS["kp"])):
        settings = replace(FAST, controller=law)
        done = simulate(ARM, still, rng=np.random.default_rng(0), parameters=truth, settings=settings)
        sags.append(np.abs(done.truth.q[-1] - done.truth.reference.q[-1]).max())
    assert sags[0] > 1e-2
    assert sags[1] < 0.02 * sags[0]


@dataclass(frozen=True)
class Wall:
    """A spring on the second joint that pushes back beyond a position."""

    at: float

    def torque(self, _: float, q: FloatArray, __: FloatArray) -> FloatArray:
        pushed = np.zeros(6)
        pushed[1] = -300.0 * max(0.0, q[1] - self.at)
        return pushed


def test_what_the_environment_adds_is_in_the_truth_and_in_its_equation() -> None:
    truth = with_every_effect(ARM)
    loop = {"settle": 0.1, "encoder": Encoder(side="motor")}
    free = run(truth, **loop).truth
    wall = Wall(float(np.median(free.q[:, 1])))
    known = run(truth, environment=wall, **loop).truth
    expected = np.zeros_like(known.q)
    expected[:, 1] = -300.0 * np.maximum(0.0, known.q[:, 1] - wall.at)
    np.testing.assert_allclose(known.external_torque, expected, atol=1e-12)
    assert np.abs(expected).max() > 5.0
    assert not free.external_torque.any()
    model, data = loaded_model(ARM, truth)
    rigid = np.array([pinocchio.rnea(model, data, *row) for row in zip(known.q, known.dq, known.ddq, strict=True)])
    taken = truth.rotor * known.motor_ddq + truth.viscous * known.motor_dq + truth.offset - known.external_torque
    total = rigid + taken + known.coulomb_torque + known.law_torque
    np.testing.assert_allclose(known.tau, total, rtol=0, atol=1e-8 * np.abs(total).max())


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Encoder(side="tip"), "encoder, side; expected link or motor, got tip"),
        (lambda: Encoder(velocity="guessed"), "encoder, velocity; expected true or differenced"),
        (lambda: Encoder(step=-1.0), "encoder, step; expected one number >= 0"),
        (lambda: Encoder(step=np.ones(2)).steps(6), "encoder, step; expected 1 or 6 values, got 2"),
        (lambda: replace(FAST, control_delay=-1e-3), "setting control_delay; expected a time >= 0"),
        (lambda: replace(FAST, control_delay=1.5e-3), "control periods in the delay; expected a whole number, got 1.5"),
    ],
)
def test_control_that_cannot_be_is_refused(make: Any, said: str) -> None:
    with pytest.raises(SimulationError, match=said):
        make()
