"""Passive laws of the plant: closed forms, power, energy, and the equation of motion with Pinocchio as the judge."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio
import pytest
from scipy.integrate import solve_ivp

from tauhat.arrays import FloatArray
from tauhat.errors import ArrayError, SimulationError
from tauhat.excitation import random_fourier
from tauhat.robots.kinematics import pinocchio_model
from tauhat.robots.library import load_robot
from tauhat.robots.robot import Robot
from tauhat.simulation import (
    KINDS,
    ExperimentSettings,
    Simulation,
    TrueParameters,
    build_plant,
    load_true_parameters,
    matching_model,
    nominal_parameters,
    simulate,
    started,
    typical_plant,
)
from tauhat.simulation.laws import (
    LAWS,
    BalancingSpring,
    Bristles,
    CubeRootDrag,
    DirectionalFriction,
    DirectionalViscous,
    GasCylinder,
    LoadedBristles,
    LoadedCoulomb,
    PassiveLaw,
    PolynomialDrag,
    SharedDrive,
    SmoothCoulomb,
    StribeckBump,
    law_from_dict,
)
from tauhat.simulation.laws.law import resting_state
from tauhat.simulation.truth_file import plant_document

ROBOT = load_robot("two_link")
TWO = np.array([1.0, 2.0])
WIDTH = np.array([0.02, 0.05])
SPEED = np.array([0.1, 0.2])
DIRECTIONAL = DirectionalFriction(
    viscous_forwards=TWO, viscous_backwards=0.5 * TWO, coulomb_forwards=3 * TWO, coulomb_backwards=2 * TWO, width=WIDTH
)
POLYNOMIAL = PolynomialDrag(
    constant=TWO, linear=2 * TWO, square=-0.3 * TWO, cube=0.1 * TWO, bump=0.7 * TWO, speed=SPEED, width=WIDTH
)
BRISTLES = Bristles(fine=TWO, coarse=0.5 * TWO, fine_length=np.full(2, 1e-3), coarse_length=np.full(2, 1e-2))
CYLINDER = GasCylinder(joint=1, energy=400.0, distance=0.5, lever=0.1, angle=0.7, area=2e-3, volume=1e-3)
ONE = np.ones(1)
DRY = SmoothCoulomb(torque=np.array([0.4]), width=np.array([0.03]))
DRIVE = SharedDrive(own=1, other=0, ratio=-2.0, inertia=0.04, viscous=0.3, dry=DRY)

CLOSED_FORMS: dict[str, tuple[PassiveLaw, Callable[[FloatArray], FloatArray]]] = {
    "smooth sign": (SmoothCoulomb(torque=TWO, width=WIDTH), lambda v: TWO * (1 - 2 / (np.exp(2 * v / WIDTH) + 1))),
    "cube root": (CubeRootDrag(coefficient=TWO), lambda v: TWO * np.cbrt(v)),
    "viscous by direction": (DirectionalViscous(difference=TWO), lambda v: TWO * v * np.sign(v)),
    "by direction": (
        DIRECTIONAL,
        lambda v: np.where(v > 0, TWO * v + 3 * TWO * np.tanh(v / WIDTH), 0.5 * TWO * v + 2 * TWO * np.tanh(v / WIDTH)),
    ),
    "Stribeck": (
        StribeckBump(torque=TWO, speed=SPEED, width=WIDTH),
        lambda v: TWO * np.exp(-((v / SPEED) ** 2)) * np.tanh(v / WIDTH),
    ),
    "polynomial": (
        POLYNOMIAL,
        lambda v: (
            TWO
            * (
                (1 + 0.7 * np.exp(-np.abs(v) / SPEED)) * np.tanh(v / WIDTH)
                + 2 * v
                - 0.3 * v**2 * np.sign(v)
                + 0.1 * np.abs(v) ** 3 * np.sign(v)
            )
        ),
    ),
    "load": (
        LoadedCoulomb(ratio=0.1 * TWO, width=WIDTH),
        lambda v: 0.1 * TWO * np.array([5.0, 7.0]) * np.tanh(v / WIDTH),
    ),
}
DISSIPATIVE: list[PassiveLaw] = [
    *(CLOSED_FORMS[name][0] for name in CLOSED_FORMS if name != "viscous by direction"),
    BRISTLES,
    LoadedBristles(ratio=0.1 * TWO, length=np.full(2, 1e-3)),
    DRIVE,
    replace(DRIVE, dry=Bristles(fine=ONE, coarse=ONE, fine_length=0.002 * ONE, coarse_length=0.02 * ONE)),
]


def evaluated(law: PassiveLaw, dq: FloatArray, *, q: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
    joints = resting_state(2)
    joints.q[:], joints.dq[:], joints.load[:] = (np.zeros(2) if q is None else q), dq, [5.0, 7.0]
    law.add(joints, law.memory())
    return joints.torque, joints.damping


def with_laws(*laws: PassiveLaw, **changes: Any) -> TrueParameters:
    return replace(nominal_parameters(ROBOT), laws=laws, **changes)


def frictionless(*laws: PassiveLaw) -> TrueParameters:
    return with_laws(*laws, viscous=np.zeros(2), coulomb=np.zeros(2))


def pinocchio_of(truth: TrueParameters) -> tuple[pinocchio.Model, pinocchio.Data]:
    pairs = zip(ROBOT.joints, truth.inertia, strict=True)
    model = pinocchio_model(replace(ROBOT, joints=tuple(replace(joint, inertia=link) for joint, link in pairs)))
    return model, model.createData()


def rigid_torque(truth: TrueParameters, done: Simulation) -> FloatArray:
    model, data = pinocchio_of(truth)
    states = zip(done.truth.q, done.truth.dq, done.truth.ddq, strict=True)
    return np.array([pinocchio.rnea(model, data, *state) for state in states])


def run(robot: Robot, truth: TrueParameters, *, seed: int = 0, period: float = 2.0) -> Simulation:
    rng = np.random.default_rng(seed)
    motion = random_fourier(robot, period=period, harmonics=3, rng=rng, margin=0.2)
    return simulate(robot, motion, rng=rng, parameters=truth, settings=ExperimentSettings(settle=0.2))


@pytest.mark.parametrize("name", CLOSED_FORMS)
def test_friction_is_its_closed_form(name: str) -> None:
    law, form = CLOSED_FORMS[name]
    for dq in np.random.default_rng(0).normal(size=(50, 2)) * np.array([0.5, 0.1]):
        np.testing.assert_allclose(evaluated(law, dq)[0], form(dq), rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("name", [name for name in CLOSED_FORMS if name != "viscous by direction"])
def test_damping_is_the_positive_part_of_the_slope(name: str) -> None:
    law, _ = CLOSED_FORMS[name]
    for dq in np.random.default_rng(1).normal(size=(50, 2)) * np.array([0.5, 0.1]):
        slope = (evaluated(law, dq + 1e-6)[0] - evaluated(law, dq - 1e-6)[0]) / 2e-6
        np.testing.assert_allclose(evaluated(law, dq)[1], np.maximum(slope, 0.0), rtol=1e-4, atol=1e-6)


def test_bristles_bend_as_dahls_equation_says() -> None:
    lengths = np.array([1e-3, 1e-2])
    memory, expected = BRISTLES.memory(), np.zeros(2)
    for stroke in (4e-3, -6e-3, 1e-3, -2e-4):
        for _ in range(20):
            BRISTLES.advance(np.array([stroke, -stroke]) / 20, memory)

        def slope(_: float, z: FloatArray, sign: float = np.sign(stroke)) -> FloatArray:
            return (sign - z) / lengths

        expected = solve_ivp(slope, (0.0, abs(stroke)), expected, rtol=1e-9, atol=1e-12).y[:, -1]
        np.testing.assert_allclose(memory[:, 0], expected, atol=1e-3)
        np.testing.assert_allclose(memory[:, 1], -expected, atol=1e-3)


@pytest.mark.parametrize("law", DISSIPATIVE, ids=lambda law: law.key)
def test_friction_takes_energy_out_over_a_cycle(law: PassiveLaw) -> None:
    t = np.linspace(0.0, 1.0, 4001)
    q = np.stack([0.3 * np.sin(2 * np.pi * t), 0.2 * np.sin(4 * np.pi * t + 1.0)], axis=1)
    memory, joints, work = law.memory(), resting_state(2), 0.0
    joints.load[:] = [5.0, 7.0]
    for before, after in pairwise(q):
        joints.dq[:], joints.torque[:] = (after - before) / (t[1] - t[0]), 0.0
        law.add(joints, memory)
        law.advance(after - before, memory)
        work += float(joints.torque @ (after - before))
    assert work > 0.01


def stored_energy(law: PassiveLaw, q: FloatArray, dq: FloatArray) -> float:
    if isinstance(law, BalancingSpring):
        return 0.5 * float(law.rate @ q**2)
    if isinstance(law, GasCylinder):
        d = q[law.joint] + law.angle
        length = np.hypot(law.distance - law.lever * np.cos(d), law.lever * np.sin(d))
        return -law.energy * float(np.log(law.volume - law.area * (length - law.distance + law.lever)))
    if isinstance(law, SharedDrive):
        return 0.5 * law.inertia * float(dq[law.own] + law.ratio * dq[law.other]) ** 2
    return 0.0


ROTOR_ALONE = SharedDrive(
    own=1, other=0, ratio=0.7, inertia=0.2, viscous=0.0, dry=SmoothCoulomb(torque=np.zeros(1), width=np.ones(1))
)


def swing(truth: TrueParameters, timestep: float) -> tuple[FloatArray, FloatArray]:
    """Let the arm fall for 0.5 s; return its energy and the heat of friction at every step."""
    running = started(build_plant(ROBOT, parameters=truth, timestep=timestep), np.array([0.5, 1.0]))
    model, data = pinocchio_of(truth)

    def energy(q: FloatArray, dq: FloatArray) -> float:
        rigid = pinocchio.computeKineticEnergy(model, data, q, dq) + pinocchio.computePotentialEnergy(model, data, q)
        return rigid + 0.5 * float(truth.rotor @ dq**2) + sum(stored_energy(law, q, dq) for law in truth.laws)

    energies, heat = [energy(*running.state)], [0.0]
    for _ in range(round(0.5 / timestep)):
        before = running.state[0]
        reaction = running.advance(np.zeros(2))
        friction = reaction.law_torque - running.shared_inertia @ reaction.ddq
        heat.append(heat[-1] + float(friction @ (running.state[0] - before)))
        energies.append(energy(*running.state))
    return np.array(energies), np.array(heat)


@pytest.mark.parametrize("law", [None, BalancingSpring(rate=10 * TWO), replace(CYLINDER, energy=60.0), ROTOR_ALONE])
def test_a_plant_without_friction_keeps_its_energy_but_for_the_step(law: PassiveLaw | None) -> None:
    truth = frictionless(*([law] if law else []))
    coarse, fine = (swing(truth, step)[0] for step in (1e-3, 5e-4))
    drifts = [np.abs(energies - energies[0]).max() for energies in (coarse, fine)]
    # The integrator is of first order: half the step, half the drift, and nothing else that stays.
    extrapolated = 2.0 * (fine[::2] - fine[0]) - (coarse - coarse[0])
    assert drifts[1] < 0.6 * drifts[0]
    assert np.abs(extrapolated).max() < 0.05 * drifts[0]


@pytest.mark.parametrize("law", DISSIPATIVE, ids=lambda law: law.key)
def test_what_a_swinging_arm_loses_is_the_heat_of_its_friction(law: PassiveLaw) -> None:
    truth = frictionless(law)
    energies, heat = swing(truth, 5e-4)
    freely, _ = swing(frictionless(), 5e-4)
    drift = np.abs(freely - freely[0]).max()
    assert np.abs(energies + heat - energies[0]).max() < 3.0 * drift
    assert heat[-1] > (0.0 if isinstance(law, StribeckBump) else 3.0 * drift)


@pytest.mark.parametrize("kind", KINDS)
def test_true_torque_is_pinocchios_and_what_friction_takes(kind: str) -> None:
    truth = typical_plant(ROBOT, kind, rng=np.random.default_rng(1))
    done = run(ROBOT, truth)
    known = done.truth
    expected = rigid_torque(truth, done) + truth.rotor * known.ddq + truth.viscous * known.dq + truth.offset
    expected += known.coulomb_torque + known.law_torque
    np.testing.assert_allclose(known.tau, expected, rtol=0, atol=1e-8 * np.abs(expected).max())
    assert np.abs(known.law_torque).max() > 0.3 or kind == "plain"


def test_load_friction_follows_the_rigid_torque() -> None:
    law = LoadedCoulomb(ratio=np.array([0.1, 0.2]), width=np.full(2, 0.01))
    truth = frictionless(law)
    done = run(ROBOT, truth)
    expected = law.ratio * np.abs(rigid_torque(truth, done)) * np.tanh(done.truth.dq / law.width)
    error = done.truth.law_torque - expected
    assert np.linalg.norm(error) < 5e-3 * np.linalg.norm(expected)


def test_a_shared_motor_turns_with_both_joints() -> None:
    truth = frictionless(DRIVE)
    done = run(ROBOT, truth)
    speed, acceleration = (x[:, 1] - 2.0 * x[:, 0] for x in (done.truth.dq, done.truth.ddq))
    motor = 0.04 * acceleration + 0.3 * speed + 0.4 * np.tanh(speed / 0.03)
    np.testing.assert_allclose(done.truth.law_torque, np.outer(motor, [-2.0, 1.0]), atol=1e-10)
    assert [(motor.own, motor.other, motor.ratio) for motor in done.recording.shared_motors] == [(1, 0, -2.0)]


def test_a_shared_motor_is_part_of_both_joints_own_parameters() -> None:
    truth = frictionless(DRIVE)
    found = {(symbol, joint): truth.value(symbol, joint) for symbol in ("Ia", "Fv", "Iam", "Fvm") for joint in (0, 1)}
    rotor = nominal_parameters(ROBOT).rotor
    assert found[("Ia", 0)] == pytest.approx(rotor[0] + 4 * 0.04)
    assert found[("Ia", 1)] == pytest.approx(rotor[1] + 0.04)
    assert (found[("Fv", 0)], found[("Fv", 1)]) == pytest.approx((4 * 0.3, 0.3))
    assert (found[("Iam", 1)], found[("Fvm", 1)], found[("Iam", 0)]) == (0.04, 0.3, 0.0)


def test_bristles_hold_a_joint_as_a_spring_and_let_it_go_beyond() -> None:
    truth = frictionless(BRISTLES)
    floating = ROBOT.with_gravity((0.0, 0.0, 0.0))
    running = started(build_plant(floating, parameters=truth), np.zeros(2))
    for torque in np.linspace(0.0, 0.8, 4000):
        running.advance(torque * np.array([1.5, 0.0]))
    held = running.state[0][0]
    assert 1e-4 < held < 5e-2
    running.advance(np.array([1.7, 0.0]), 2000)
    assert running.state[0][0] > held + 0.1


def test_a_sharp_sign_does_not_chatter() -> None:
    sharp = SmoothCoulomb(torque=np.array([1.5, 0.6]), width=np.full(2, 1e-4))
    floating = ROBOT.with_gravity((0.0, 0.0, 0.0))
    running = started(build_plant(floating, parameters=frictionless(sharp)), np.zeros(2))
    running.place(np.zeros(2), np.array([0.3, -0.3]))
    running.advance(np.array([0.5, 0.1]), 2000)
    speeds = []
    for _ in range(50):
        running.advance(np.array([0.5, 0.1]))
        speeds.append(running.state[1])
    assert np.abs(speeds).max() < 1e-4
    assert np.ptp(speeds, axis=0).max() < 1e-6


def test_bristles_too_stiff_for_the_timestep_are_refused() -> None:
    stiff = replace(BRISTLES, fine_length=np.full(2, 1e-7))
    with pytest.raises(
        SimulationError, match=r"joint joint_2: .* too stiff for the timestep; expected a timestep below"
    ):
        started(build_plant(ROBOT, parameters=frictionless(stiff)), np.zeros(2))


def test_a_run_leaves_the_plants_model_as_it_was() -> None:
    plant = build_plant(ROBOT, parameters=frictionless(SmoothCoulomb(torque=TWO, width=WIDTH)))
    started(plant, np.zeros(2)).advance(np.ones(2), 10)
    assert not plant.model.dof_damping.any()


@pytest.mark.parametrize("kind", KINDS)
def test_plain_data_holds_a_plant_exactly(kind: str) -> None:
    truth = typical_plant(ROBOT, kind, rng=np.random.default_rng(2))
    again = TrueParameters.from_dict(json.loads(json.dumps(truth.to_dict())))
    assert again.to_dict() == truth.to_dict()
    for parameter in matching_model(ROBOT, kind, truth).parameters:
        assert again.value(parameter.symbol, parameter.joint) == truth.value(parameter.symbol, parameter.joint)


def test_every_law_is_in_a_typical_plant_and_can_be_read_back() -> None:
    made = {law.key for kind in KINDS for law in typical_plant(ROBOT, kind, rng=np.random.default_rng(0)).laws}
    assert made == set(LAWS)


def test_files_of_the_truth_are_read_in_both_versions(tmp_path: Path) -> None:
    truth = typical_plant(ROBOT, "dahl", rng=np.random.default_rng(3))
    plain = typical_plant(ROBOT, "plain", rng=np.random.default_rng(3))
    model = matching_model(ROBOT, "plain", plain)
    named = [{"name": p.name, "value": plain.value(p.symbol, p.joint), "unit": p.unit} for p in model.parameters]
    new, old = tmp_path / "new.truth.json", tmp_path / "old.truth.json"
    new.write_text(json.dumps(plant_document(truth)))
    old.write_text(json.dumps({"robot": ROBOT.name, "parameters": named, "base_parameters": [], "seed": 0}))
    assert load_true_parameters(new).to_dict() == truth.to_dict()
    assert load_true_parameters(old).to_dict() == plain.to_dict()


@pytest.mark.parametrize(
    ("document", "said"),
    [
        ({"schema_version": 4}, "unknown form of truth; expected tauhat.truth, version 1 to 3, got 4; update"),
        ({"schema": "tauhat.truth", "schema_version": 2, "plant": {"laws": []}}, "not a readable truth.*damaged"),
        ({"parameters": [{"name": "m_1", "value": 1.0}]}, "not a readable truth"),
        ([], "not a readable truth"),
    ],
)
def test_a_damaged_or_newer_file_of_the_truth_is_refused(tmp_path: Path, document: object, said: str) -> None:
    path = tmp_path / "run.truth.json"
    path.write_text(json.dumps(document))
    with pytest.raises(SimulationError, match=said):
        load_true_parameters(path)


WRONG: list[tuple[Callable[[], object], str]] = [
    (lambda: SmoothCoulomb(torque=TWO, width=np.array([0.1, 0.0])), "joint 2: width must be above zero; got 0"),
    (lambda: CubeRootDrag(coefficient=-TWO), "cube-root, joint 1: coefficient must be at least zero; got -1"),
    (lambda: replace(DRIVE, own=0), "shared-drive: a motor turns with two different joints"),
    (lambda: replace(DRIVE, viscous=-1.0), "shared-drive: a parameter is negative"),
    (lambda: replace(CYLINDER, lever=0.6), "gas-cylinder: the piston does not fit"),
    (lambda: with_laws(replace(DRIVE, own=2)), "shared-drive: no such joint; expected 0 to 1, got 2"),
    (lambda: with_laws(replace(CYLINDER, joint=2)), "gas-cylinder: no such joint"),
    (lambda: with_laws(BalancingSpring(rate=np.ones(3))), "law spring of another robot; expected 2 joints, got 3"),
    (lambda: law_from_dict({"law": "glue"}), "unknown law; expected .*, got glue"),
    (lambda: law_from_dict({"law": "spring", "stiffness": [1.0]}), "other values in this version; got stiffness"),
    (lambda: law_from_dict({"law": "spring", "rate": [[1.0]]}), "spring: the law is damaged"),
    (lambda: nominal_parameters(ROBOT).value("Wi", 0), "no such parameter; got Wi"),
    (lambda: typical_plant(ROBOT, "glue", rng=np.random.default_rng(0)), "unknown kind of plant; expected plain, "),
]


@pytest.mark.parametrize(("make", "said"), WRONG, ids=[said[:30] for _, said in WRONG])
def test_what_no_plant_can_be_is_refused(make: Callable[[], object], said: str) -> None:
    with pytest.raises(SimulationError, match=said):
        make()


def test_values_of_unlike_lengths_are_refused() -> None:
    with pytest.raises(ArrayError, match="law smooth-coulomb"):
        SmoothCoulomb(torque=TWO, width=np.ones(3))
