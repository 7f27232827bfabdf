"""Elastic joints, backlash, heat and tools: closed forms, SciPy and Pinocchio as judges, and energy that adds up."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio
import pytest
from effect_plants import (
    LINK,
    ROTOR,
    TOOL,
    heat_of,
    loaded_model,
    spring_gear,
    turntable,
    turntable_truth,
    with_every_effect,
)
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from tauhat.arrays import FloatArray
from tauhat.errors import SimulationError
from tauhat.excitation import random_fourier
from tauhat.robots import load_robot
from tauhat.robots.kinematics import pinocchio_model
from tauhat.simulation import (
    AttachedBody,
    ElasticJoints,
    Encoder,
    ExperimentSettings,
    RunningPlant,
    TrueParameters,
    build_plant,
    load_true_parameters,
    nominal_parameters,
    plant_torque,
    simulate,
    started,
)
from tauhat.simulation.laws import GasCylinder, SharedDrive, SmoothCoulomb
from tauhat.simulation.truth_file import plant_document

ARM = load_robot("ur5e")
TABLE = turntable()


def turning(truth: TrueParameters, *, timestep: float = 1e-3, twist: float = 0.0) -> RunningPlant:
    """The turntable at rest, its motor `twist` ahead of it."""
    running = started(build_plant(TABLE, parameters=truth, timestep=timestep), np.zeros(1))
    running.memory.shaft[:] = twist
    return running


def trace(running: RunningPlant, steps: int, tau: float = 0.0) -> dict[str, FloatArray]:
    reactions = [running.advance(np.array([tau])) for _ in range(steps)]
    return {name: np.array([getattr(row, name)[0] for row in reactions]) for name in reactions[0]._fields}


def two_masses(stiffness: float, damping: float) -> FloatArray:
    """The matrix of d(q, motor, dq, motor_dq)/dt."""
    k = stiffness * np.array([[-1.0, 1.0], [1.0, -1.0]]) / np.array([[LINK], [ROTOR]])
    return np.block([[np.zeros((2, 2)), np.eye(2)], [k, damping / stiffness * k]])


def oscillation_error(timestep: float, damping: float) -> float:
    """Worst error of the positions; the plant's speeds are those half a step before its positions."""
    stiffness, seconds = 2000.0, 0.2
    rate, state = two_masses(stiffness, damping), np.array([0.0, 0.01, 0.0, 0.0])
    running = turning(turntable_truth(elasticity=spring_gear(stiffness, damping)), timestep=timestep, twist=0.01)
    running.machine.engine.qvel[0], running.memory.shaft_dq[0] = (expm(-0.5 * timestep * rate) @ state)[2:]
    found = trace(running, round(seconds / timestep) + 1)
    step, errors = expm(rate * timestep), []
    for q, motor in zip(found["q"], found["motor_q"], strict=True):
        errors.append(np.abs([q - state[0], motor - state[1]]).max())
        state = step @ state
    return float(max(errors))


@pytest.mark.parametrize("damping", [0.0, 0.4])
def test_an_elastic_joint_rings_as_two_masses_on_a_spring_to_second_order(damping: float) -> None:
    coarse, fine = oscillation_error(1e-3, damping), oscillation_error(2.5e-4, damping)
    assert coarse < 6e-4
    assert fine == pytest.approx(coarse / 16.0, rel=0.2)


@pytest.mark.parametrize("timestep", [1e-3, 2e-3])
def test_the_natural_frequency_is_that_of_the_trapezoidal_rule_and_nothing_is_damped(timestep: float) -> None:
    stiffness = 2000.0
    natural = np.sqrt(stiffness * (1.0 / LINK + 1.0 / ROTOR))
    warped = 2.0 / timestep * np.arctan(0.5 * natural * timestep)
    running = turning(turntable_truth(elasticity=spring_gear(stiffness)), timestep=timestep, twist=0.01)
    found = trace(running, 4000)
    bent = found["motor_q"] - found["q"]
    crossings = np.flatnonzero(bent[1:] * bent[:-1] < 0.0)
    exact = crossings + bent[crossings] / (bent[crossings] - bent[crossings + 1])
    frequency = np.pi * (exact.size - 1) / ((exact[-1] - exact[0]) * timestep)
    assert frequency == pytest.approx(warped, rel=2e-4)
    assert frequency == pytest.approx(natural, rel=(0.3 * natural * timestep) ** 2)
    assert np.abs(bent[-500:]).max() == pytest.approx(np.abs(bent[:500]).max(), rel=1e-2)


def test_a_spring_of_any_stiffness_is_stable_and_moves_as_one_rigid_body() -> None:
    running = turning(turntable_truth(elasticity=spring_gear(1e9, 1e3)))
    found = trace(running, 2000, tau=1.0)
    t = 1e-3 * np.arange(2000)
    np.testing.assert_allclose(found["q"], 0.5 * t * (t + 1e-3) / (LINK + ROTOR), atol=1e-6)


def test_coupled_elastic_joints_have_the_modes_of_their_mass_matrix() -> None:
    robot = load_robot("two_link").with_gravity((0.0, 0.0, 0.0))
    stiffness, rotor, pose = np.array([3000.0, 800.0]), np.array([0.2, 0.05]), np.array([0.3, 0.9])
    gears = ElasticJoints(joints=(0, 1), stiffness=stiffness, damping=np.zeros(2))
    free = replace(nominal_parameters(robot), rotor=rotor, viscous=np.zeros(2), coulomb=np.zeros(2), elasticity=gears)
    running = started(build_plant(robot, parameters=free, timestep=1e-4), pose)
    twist = np.array([1e-4, -5e-5])
    running.memory.shaft[:] += twist
    model = pinocchio_model(robot)
    mass = pinocchio.crba(model, model.createData(), pose)
    mass = np.triu(mass) + np.triu(mass, 1).T
    whole = np.block([[mass, np.zeros((2, 2))], [np.zeros((2, 2)), np.diag(rotor)]])
    spring = np.block([[np.diag(stiffness), -np.diag(stiffness)], [-np.diag(stiffness), np.diag(stiffness)]])
    rate = np.block([[np.zeros((4, 4)), np.eye(4)], [-np.linalg.solve(whole, spring), np.zeros((4, 4))]])
    state, step = np.concatenate([np.zeros(2), twist, np.zeros(4)]), expm(rate * 1e-4)
    for _ in range(1500):
        reaction = running.advance(np.zeros(2))
        found = np.concatenate([reaction.q - pose, reaction.motor_q - pose])
        np.testing.assert_allclose(found, state[:4], atol=3e-6)
        state = step @ state


def test_a_motor_with_dry_friction_holds_its_spring_for_ever() -> None:
    truth = turntable_truth(elasticity=spring_gear(500.0, 1.0), coulomb=np.array([2.0]))
    found = trace(turning(truth), 3000, tau=1.5)
    assert not found["motor_dq"].any()
    assert not found["q"].any()
    np.testing.assert_allclose(found["coulomb_torque"], 1.5, rtol=1e-12)
    moved = trace(turning(truth), 3000, tau=2.5)
    assert moved["q"][-1] > 1.0
    assert moved["coulomb_torque"][-1] == pytest.approx(2.0)


def test_an_elastic_arm_starts_at_rest_with_its_springs_bent_by_gravity() -> None:
    truth = replace(
        with_every_effect(ARM), coulomb=np.zeros(6), laws=(), heat=None, viscous=np.zeros(6), offset=np.zeros(6)
    )
    pose = np.array([0.1, -1.0, 1.2, 0.3, 0.2, 0.0])
    plant = build_plant(ARM, parameters=truth, timestep=1e-3)
    still = plant_torque(plant, pose[None], np.zeros((1, 6)), np.zeros((1, 6)))[0]
    reaction = started(plant, pose).advance(still)
    np.testing.assert_allclose(reaction.gear_torque, still, atol=1e-9)
    np.testing.assert_allclose(reaction.ddq, 0.0, atol=1e-6)
    np.testing.assert_allclose(reaction.motor_ddq, 0.0, atol=1e-6)


GAP = 0.02


def test_inside_the_gap_the_motor_turns_freely_and_the_link_stands() -> None:
    running = turning(turntable_truth(elasticity=spring_gear(5000.0, gap=GAP)), timestep=2e-4)
    found = trace(running, 400, tau=0.5)
    free = found["motor_q"] < 0.5 * GAP
    t = 2e-4 * np.arange(400)
    np.testing.assert_allclose(found["motor_q"][free], 0.5 * 0.5 / ROTOR * (t * (t + 2e-4))[free], rtol=1e-9)
    assert free.sum() == pytest.approx(np.sqrt(GAP * ROTOR / 0.5) / 2e-4, abs=2)
    assert not found["q"][free].any()
    assert not found["gear_torque"][free].any()
    assert found["q"][-1] > 0.0


def rebound(damping: float) -> tuple[FloatArray, FloatArray]:
    """Speeds (motor, link) before and after the motor, turning in the gap, has hit the link's tooth."""
    gears = spring_gear(5000.0, damping, gap=GAP)
    running = turning(turntable_truth(elasticity=gears), timestep=1e-4)
    running.memory.shaft_dq[:] = 1.0
    found = trace(running, 1200)
    touching = np.flatnonzero(found["gear_torque"])
    before, after = touching[0] - 1, touching[touching < touching[0] + 200][-1] + 2
    return (
        np.array([found["motor_dq"][before], found["dq"][before]]),
        np.array([found["motor_dq"][after], found["dq"][after]]),
    )


def test_an_undamped_tooth_throws_back_all_energy_and_momentum() -> None:
    masses = np.array([ROTOR, LINK])
    before, after = rebound(0.0)
    assert masses @ after == pytest.approx(masses @ before, rel=1e-9)
    assert masses @ after**2 == pytest.approx(masses @ before**2, rel=1e-2)
    assert after[0] - after[1] == pytest.approx(-(before[0] - before[1]), rel=1e-2)


def test_a_damped_tooth_keeps_momentum_and_loses_energy_as_the_integrated_impact_does() -> None:
    damping, masses = 20.0, np.array([ROTOR, LINK])
    before, after = rebound(damping)
    reduced = 1.0 / (1.0 / ROTOR + 1.0 / LINK)

    def rate(_: float, x: FloatArray) -> list[float]:
        return [x[1], -max(0.0, 5000.0 * x[0] + damping * x[1]) / reduced]

    impact = solve_ivp(rate, (0.0, 0.2), [0.0, 1.0], rtol=1e-8, atol=1e-10)
    assert masses @ after == pytest.approx(masses @ before, rel=1e-9)
    assert after[0] - after[1] == pytest.approx(impact.y[1, -1], rel=2e-2)
    assert abs(after[0] - after[1]) < 0.8


def test_friction_heats_its_joint_as_the_differential_equation_says() -> None:
    heat = heat_of(1, heating=np.array([0.4]), time_constant=np.array([3.0]), initial=np.array([30.0]))
    truth = turntable_truth(viscous=np.array([0.8]), coulomb=np.array([1.2]), heat=heat)
    found = trace(turning(truth), 8000, tau=4.0)

    def rate(_: float, x: FloatArray) -> list[float]:
        kelvin = x[1] - heat.reference
        friction = 0.8 * (1.0 - 0.01 * kelvin) * x[0] + 1.2 * (1.0 - 0.005 * kelvin)
        return [(4.0 - friction) / (LINK + ROTOR), 0.4 * friction * x[0] - (x[1] - heat.ambient) / 3.0]

    t = 1e-3 * np.arange(8000)
    judge = solve_ivp(rate, (0.0, 8.0), [0.0, 30.0], t_eval=t, rtol=1e-9, atol=1e-9)
    rise = np.ptp(judge.y[1])
    assert rise > 5.0
    assert np.abs(found["temperature"] - judge.y[1]).max() < 2e-3 * rise
    assert np.abs(found["dq"] - judge.y[0]).max() < 2e-3 * np.ptp(judge.y[0])


def test_a_joint_at_rest_cools_exponentially() -> None:
    truth = turntable_truth(heat=heat_of(1, initial=np.array([60.0])))
    found = trace(turning(truth), 2000)
    np.testing.assert_allclose(found["temperature"], 20.0 + 40.0 * np.exp(-1e-3 * np.arange(2000) / 20.0), rtol=1e-12)


def test_a_law_is_as_warm_as_its_row_says() -> None:
    laws = (SmoothCoulomb(torque=np.ones(1), width=np.full(1, 0.01)),) * 2
    heat = heat_of(1, initial=np.array([70.0]), laws=np.array([[-0.01], [0.0]]))
    running = turning(turntable_truth(laws=laws, heat=heat))
    running.place(np.zeros(1), np.ones(1))
    assert running.advance(np.zeros(1)).law_torque[0] == pytest.approx(0.5 + 1.0, rel=1e-12)
    frozen_up = replace(heat, laws=np.array([[-1.0], [-1.0]]))
    running = turning(turntable_truth(laws=laws, heat=frozen_up))
    running.place(np.zeros(1), np.ones(1))
    assert running.advance(np.zeros(1)).law_torque[0] == 0.0


@pytest.mark.parametrize("joint", [-1, 2])
def test_a_payload_is_pinocchios_appended_body(joint: int) -> None:
    rng = np.random.default_rng(5)
    truth = replace(nominal_parameters(ARM), attached=(TOOL, replace(TOOL, name="box", joint=joint)))
    model, data = loaded_model(ARM, truth)
    states = rng.standard_normal((3, 10, 6))
    expected = np.array([pinocchio.rnea(model, data, *state) for state in zip(*states, strict=True)])
    expected += truth.rotor * states[2]
    found = plant_torque(build_plant(ARM, parameters=truth), *states)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    assert truth.value("m", joint) > nominal_parameters(ARM).value("m", joint) + 1.9


def test_a_point_mass_is_a_body() -> None:
    point = AttachedBody(name="weight", mass=3.0, centre=np.array([0.1, 0.0, 0.2]))
    np.testing.assert_allclose(point.parameters[:4], [3.0, 0.3, 0.0, 0.6])
    np.testing.assert_allclose(point.parameters[4:], [0.12, 0.0, 0.15, -0.06, 0.0, 0.03], atol=1e-15)


def springs_of(truth: TrueParameters, q: FloatArray) -> FloatArray:
    """Torque of the arm's springs and cylinders by differences of their energy."""
    step, torque = 1e-6, np.zeros(6)
    for joint in range(6):
        moved = step * np.eye(6)[joint]
        torque[joint] = (spring_energy(truth, q + moved) - spring_energy(truth, q - moved)) / (2.0 * step)
    return torque


def spring_energy(truth: TrueParameters, q: FloatArray) -> float:
    energy = 0.0
    for law in truth.laws:
        if law.key == "spring":
            energy += 0.5 * float(law.rate @ q**2)  # type: ignore[attr-defined]
        if isinstance(law, GasCylinder):
            d = q[law.joint] + law.angle
            length = np.hypot(law.distance - law.lever * np.cos(d), law.lever * np.sin(d))
            energy -= law.energy * float(np.log(law.volume - law.area * (length - law.distance + law.lever)))
    return energy


def gear_energy(truth: TrueParameters, bent: FloatArray) -> float:
    gears = truth.elasticity
    assert gears is not None
    beyond = np.maximum(0.0, np.abs(bent[list(gears.joints)]) - 0.5 * gears.gap)
    return 0.5 * float(gears.stiffness @ beyond**2)


def test_the_truths_equation_holds_with_every_effect_and_the_gear_is_its_spring() -> None:
    truth = with_every_effect(ARM)
    motion = random_fourier(ARM, period=2.0, harmonics=3, rng=np.random.default_rng(6), margin=0.2)
    settings = ExperimentSettings(timestep=1e-3, control_rate=1000.0, settle=0.2, encoder=Encoder(side="motor"))
    done = simulate(ARM, motion, rng=np.random.default_rng(7), parameters=truth, settings=settings)
    known, gears = done.truth, truth.elasticity
    model, data = loaded_model(ARM, truth)
    rigid = np.array([pinocchio.rnea(model, data, *row) for row in zip(known.q, known.dq, known.ddq, strict=True)])
    own = truth.rotor * known.motor_ddq + truth.viscous * known.motor_dq + truth.offset
    expected = rigid + own + known.coulomb_torque + known.law_torque
    np.testing.assert_allclose(known.tau, expected, rtol=0, atol=1e-8 * np.abs(expected).max())
    springs = np.array([springs_of(truth, q) for q in known.q])
    np.testing.assert_allclose(known.gear_torque, rigid + springs, atol=1e-5)
    assert gears is not None
    e = list(gears.joints)
    bent, rate = (known.motor_q - known.q)[:, e], (known.motor_dq - known.dq)[:, e]
    beyond = np.sign(bent) * np.maximum(0.0, np.abs(bent) - 0.5 * gears.gap)
    spring = gears.stiffness * beyond + gears.damping * rate
    loose = (gears.gap > 0.0) & (spring * beyond <= 0.0)
    np.testing.assert_allclose(known.gear_torque[:, e], np.where(loose, 0.0, spring), atol=1e-9)
    np.testing.assert_array_equal(done.recording.q, known.motor_q)
    np.testing.assert_array_equal(done.recording.temperature, known.temperature)
    assert np.ptp(known.temperature, axis=0).min() > 0.01
    assert 0.0 < loose.mean() < 0.5
    np.testing.assert_array_equal(known.motor_q[:, 4:], known.q[:, 4:])


def balance(timestep: float) -> tuple[float, float]:
    """Return the worst error of the energy balance of a driven arm with every effect, and its turnover [J]."""
    truth = with_every_effect(ARM)
    shared = next(law for law in truth.laws if isinstance(law, SharedDrive))
    running = started(build_plant(ARM, parameters=truth, timestep=timestep), np.array([0.0, -1.2, 1.0, 0.2, 0.3, 0.0]))
    model, data = loaded_model(ARM, truth)
    running.push(np.array([1.0, -2.0, 0.5, 0.2, 0.1, 0.0]))

    def energy() -> float:
        (q, dq), (motor, motor_dq) = running.state, running.motor_state
        links = pinocchio.computeKineticEnergy(model, data, q, dq) + pinocchio.computePotentialEnergy(model, data, q)
        wrist = dq[shared.own] + shared.ratio * dq[shared.other]
        rotors = 0.5 * float(truth.rotor @ motor_dq**2) + 0.5 * shared.inertia * float(wrist) ** 2
        return float(links + rotors + spring_energy(truth, q) + gear_energy(truth, motor - q))

    start, given, worst, turnover = energy(), 0.0, 0.0, 0.0
    for step in range(round(1.0 / timestep)):
        t = step * timestep
        tau = np.array([30.0, 45.0, 20.0, 6.0, 3.0, 1.0]) * np.cos(np.array([3, 4, 5, 6, 7, 8]) * t)
        before = *running.state, *running.motor_state
        reaction = running.advance(tau)
        moved, turned = running.state[0] - before[0], running.motor_state[0] - before[2]
        springs = springs_of(truth, reaction.q)
        passive = reaction.law_torque - running.shared_inertia @ reaction.ddq - springs
        lost = reaction.coulomb_torque + passive + truth.viscous * reaction.motor_dq + truth.offset
        damped = np.where(reaction.gear_torque != 0.0, damping_of(truth) * (reaction.motor_dq - reaction.dq), 0.0)
        given += float(tau @ turned + reaction.external_torque @ moved - lost @ turned - damped @ (turned - moved))
        turnover += float(np.abs(tau @ turned))
        worst = max(worst, abs(energy() - start - given))
    return worst, turnover


def damping_of(truth: TrueParameters) -> FloatArray:
    gears = truth.elasticity
    assert gears is not None
    return gears.spread(gears.damping, truth.n_v)


def test_work_is_stored_or_lost_with_every_effect_and_what_is_missing_shrinks_with_the_step() -> None:
    coarse, turnover = balance(1e-3)
    fine, _ = balance(2.5e-4)
    assert coarse < 0.03 * turnover
    assert fine < 0.4 * coarse


def test_plain_data_holds_every_effect_exactly(tmp_path: Any) -> None:
    truth = with_every_effect(ARM)
    again = TrueParameters.from_dict(json.loads(json.dumps(truth.to_dict())))
    assert again.to_dict() == truth.to_dict()
    path = tmp_path / "run.truth.json"
    path.write_text(json.dumps(plant_document(truth), allow_nan=False))
    assert load_true_parameters(path).to_dict() == truth.to_dict()


def test_a_file_of_version_two_is_a_plant_without_the_new_effects(tmp_path: Any) -> None:
    truth = replace(with_every_effect(ARM), elasticity=None, heat=None, attached=())
    old = {key: value for key, value in truth.to_dict().items() if key not in {"elasticity", "heat", "attached"}}
    path = tmp_path / "run.truth.json"
    path.write_text(json.dumps({"schema": "tauhat.truth", "schema_version": 2, "plant": old}))
    assert load_true_parameters(path).to_dict() == truth.to_dict()


NOMINAL = nominal_parameters(ARM)
DRIVE = next(law for law in with_every_effect(ARM).laws if isinstance(law, SharedDrive))
GEARS = ElasticJoints(joints=(4,), stiffness=np.array([1e3]), damping=np.zeros(1))
WRONG: list[tuple[Callable[[], object], str]] = [
    (lambda: replace(GEARS, joints=(1, 1)), "elastic joints; expected different joints"),
    (lambda: replace(GEARS, stiffness=np.zeros(1)), "joint 5: stiffness must be above zero; got 0"),
    (lambda: replace(GEARS, damping=-np.ones(1)), "joint 5: damping must be at least zero"),
    (lambda: replace(NOMINAL, elasticity=replace(GEARS, joints=(6,))), "no such joint; expected 0 to 5, got 6"),
    (lambda: replace(NOMINAL, elasticity=GEARS, rotor=np.zeros(6)), "joint 5: an elastic joint needs a rotor"),
    (lambda: replace(NOMINAL, elasticity=GEARS, laws=(DRIVE,)), "a shared motor needs rigid joints"),
    (lambda: heat_of(1, heating=-np.ones(1)), "heating is negative"),
    (lambda: heat_of(1, time_constant=np.zeros(1)), "time_constant must be above zero"),
    (lambda: heat_of(1, ambient=np.nan), "temperature; expected finite"),
    (lambda: replace(NOMINAL, heat=heat_of(2)), "of another robot; expected 6 joints, got 2"),
    (lambda: replace(NOMINAL, heat=heat_of(6, laws=np.zeros((1, 6)))), "rows of laws; expected 0, got 1"),
    (
        lambda: replace(NOMINAL, laws=(DRIVE,), heat=heat_of(6, laws=np.ones((1, 6)))),
        "only friction of single joints can depend on heat; got shared-drive",
    ),
    (lambda: replace(TOOL, mass=0.0), "attached body gripper: mass must be above zero"),
    (lambda: replace(TOOL, inertia=np.diag([1.0, 1.0, 3.0])), "attached body gripper: inertia breaks the triangle"),
    (lambda: replace(TOOL, inertia=np.triu(np.ones((3, 3)))), "attached body gripper: inertia is not symmetric"),
    (lambda: replace(NOMINAL, attached=(replace(TOOL, joint=6),)), "gripper: no such joint; expected -1 to 5, got 6"),
    (
        lambda: turning(turntable_truth(elasticity=spring_gear(1e6, gap=1e-3))),
        "joint table: the gap's teeth are too stiff for the timestep; expected a timestep below",
    ),
]


@pytest.mark.parametrize(("make", "said"), WRONG, ids=[said[:40] for _, said in WRONG])
def test_effects_that_cannot_be_are_refused(make: Callable[[], object], said: str) -> None:
    with pytest.raises(SimulationError, match=said):
        make()
