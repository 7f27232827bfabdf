"""A cell without its workpiece is the plain plant; its controller, its kernel and its errors."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from polishing_cells import ARM, Driver, barrel, cell_on, plane, pose_above, started_above

from tauhat.arrays import FloatArray
from tauhat.control.model_torque import nominal_torque
from tauhat.errors import ArrayError, SimulationError
from tauhat.robots import Joint, Limits, Robot, forward_kinematics, inertia_at_origin
from tauhat.simulation import (
    AttachedBody,
    ElasticJoints,
    Encoder,
    FrictionHeat,
    TrueParameters,
    build_plant,
    nominal_parameters,
    sensor_preset,
    started,
    typical_plant,
)
from tauhat.simulation import rows as r
from tauhat.simulation import running as running_module
from tauhat.simulation.contact import (
    TIP,
    Cell,
    CellSample,
    CompliantTool,
    FeedforwardTorque,
    JointControl,
    LoadCell,
    Material,
    Region,
    in_the_air,
    loaded_robot,
    start_cell,
)
from tauhat.simulation.laws import BalancingSpring, Bristles, StribeckBump

STILL = np.zeros(ARM.n_v)
PRESET = sensor_preset("industrial-arm", ARM)


def numbers(samples: list[CellSample]) -> FloatArray:
    return np.array([np.hstack([np.ravel(value) for value in sample]) for sample in samples])


def strokes(cell: Cell, *, seed: int = 0, seconds: float = 0.4) -> list[CellSample]:
    """Return the samples of an arm that comes down on the workpiece and goes along it."""
    q = pose_above(cell, 0.0, 0.001, surface=plane())
    driver = Driver(start_cell(cell, q, rng=np.random.default_rng(seed)), q)
    normal, tangent = plane().normals(np.zeros(1))[0], plane().tangents(np.zeros(1))[0]
    return [*driver.move(-0.01 * normal, seconds), *driver.move(0.05 * tangent, seconds)]


def seven_joints(tool: CompliantTool) -> Robot:
    """Return the arm with the tool's tip as one more joint of its description."""
    frame = ARM.frames[-1]
    ball = 0.4 * tool.tip_mass * tool.tip_radius**2 * np.eye(3)
    slide = Joint(
        name="slide", kind="prismatic", parent=frame.joint, rotation=frame.rotation,
        translation=tool.tip_body(frame).centre, axis=np.array([0.0, 0.0, -1.0]),
        inertia=inertia_at_origin(mass=tool.tip_mass, com=np.zeros(3), inertia_at_com=ball), limits=Limits(),
    )  # fmt: skip
    return replace(ARM, joints=(*ARM.joints, slide))


def with_laws(truth: TrueParameters, *, last: FloatArray) -> TrueParameters:
    """Return the truth with friction of every memory and with heat, its values at further joints those of `last`."""
    values: Callable[[float], FloatArray] = lambda value: np.append(np.full(ARM.n_v, value), value * last)  # noqa: E731
    n = ARM.n_v + last.size
    lengths = np.full(n, 1e-3)
    laws = (
        Bristles(fine=values(4.0), coarse=values(2.0), fine_length=lengths, coarse_length=3.0 * lengths),
        StribeckBump(torque=values(3.0), speed=np.full(n, 0.1), width=np.full(n, 0.01)),
    )
    heat = FrictionHeat(
        heating=values(0.1), time_constant=np.full(n, 5.0), viscous=values(-0.01), coulomb=values(-0.01),
        initial=np.full(n, 20.0), laws=np.tile(values(-0.02), (2, 1)),
    )  # fmt: skip
    return replace(truth, laws=laws, heat=heat)


@pytest.mark.parametrize("surface", [None, plane()])
def test_a_cell_that_touches_nothing_is_the_plain_plant_of_an_arm_with_one_more_joint(surface: Any) -> None:
    tool = CompliantTool(damping=8.0)
    robot, nothing = seven_joints(tool), np.zeros(1)
    truth = with_laws(nominal_parameters(ARM), last=np.zeros(0))
    cell = cell_on(surface, parameters=truth, tool=tool, settle=0.0)
    q = pose_above(cell, 0.0, 0.05, surface=plane())
    running = start_cell(cell, q, rng=np.random.default_rng(0))
    spring = BalancingSpring(rate=np.append(STILL, tool.stiffness))
    own = with_laws(nominal_parameters(robot), last=nothing)
    held = running.plant.simulator.model.qpos_spring[-1] * tool.stiffness
    own = replace(
        own, laws=(*own.laws, spring), viscous=np.append(own.viscous[:-1], tool.damping),
        offset=np.append(STILL, -held), heat=replace(own.heat, laws=np.vstack([own.heat.laws, np.zeros(7)])),
    )  # fmt: skip
    plain = started(build_plant(robot, parameters=own, timestep=cell.timestep), np.append(q, 0.0))
    swing, torque = 0.1 * np.ones(ARM.n_v), running.plant.memory.rows[r.TAU].copy()
    for k in range(1, 251):
        t = k / cell.sample_rate
        running.advance(q + swing * (1.0 - np.cos(3.0 * t)), 3.0 * swing * np.sin(3.0 * t))
        for torques in (torque, *running._tally.heard[:-1, 2]):
            plain.advance(np.append(torques, 0.0))
        torque = running._tally.heard[-1, 2].copy()
    assert abs(running.compression) > 1e-5
    assert running.sample.temperature.max() > 20.1
    np.testing.assert_allclose(np.append(running.plant.state[0], running.compression), plain.state[0], atol=1e-9)
    np.testing.assert_allclose(running.sample.temperature, plain.temperature[:-1], atol=1e-9)


@pytest.mark.parametrize("effects", ["plain", "cube-root-dahl-load", "elastic", "link-torque"])
def test_the_kernel_is_the_same_sample_in_python(effects: str, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(4)
    changes: dict[str, Any] = {}
    if effects == "elastic":
        elastic = ElasticJoints(joints=(1, 2), stiffness=np.full(2, 4e4), damping=np.full(2, 20.0), gap=np.zeros(2))
        truth = replace(nominal_parameters(ARM), elasticity=elastic)
        changes = {"encoder": Encoder(side="motor", step=1e-6, velocity="differenced")}
    elif effects == "link-torque":
        truth = typical_plant(ARM, "plain", rng=rng)
        changes = {"sensors": sensor_preset("cobot", ARM)}
    else:
        truth = with_laws(typical_plant(ARM, "plain", rng=rng), last=np.zeros(0))
        truth = truth if effects == "plain" else typical_plant(ARM, effects, rng=rng)
    cell = cell_on(plane(), parameters=truth, settle=0.1, **changes)
    native = numbers(strokes(cell, seconds=0.2))
    monkeypatch.setattr(running_module, "native_functions", lambda _: None)
    in_python = numbers(strokes(cell, seconds=0.2))
    assert np.abs(native).max() > 1.0
    np.testing.assert_allclose(native, in_python, rtol=1e-7, atol=1e-7)


def test_equal_seeds_give_equal_runs_and_others_do_not() -> None:
    cell = cell_on(plane(), sensors=PRESET, load_cell=LoadCell())
    first, again, other = (numbers(strokes(cell, seed=seed)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


def test_sensor_errors_do_not_reach_the_arm() -> None:
    noisy = strokes(cell_on(plane(), sensors=PRESET, load_cell=LoadCell()), seed=5)
    quiet = strokes(cell_on(plane()), seed=6)
    for one, two in zip(noisy, quiet, strict=True):
        np.testing.assert_array_equal(one.force, two.force)
        np.testing.assert_array_equal(one.tip, two.tip)


def test_the_log_without_errors_is_position_and_torque_of_the_truth() -> None:
    cell = cell_on(plane())
    q = pose_above(cell, 0.0, 0.001)
    running = start_cell(cell, q, rng=np.random.default_rng(0))
    driver = Driver(running, q)
    for _ in range(25):
        sample = driver.move(np.array([0.05, 0.0, -0.01]), 0.004)[0]
        np.testing.assert_array_equal(sample.q, running.plant.state[0])
        np.testing.assert_array_equal(sample.tau, running.plant.memory.rows[r.TAU])
    assert running.sample.t == pytest.approx(0.1)


def test_the_tip_is_where_kinematics_put_the_frame_less_the_way_of_the_spring() -> None:
    cell = cell_on(plane())
    q = pose_above(cell, 0.02, 0.001)
    running = start_cell(cell, q, rng=np.random.default_rng(0))
    sample = Driver(running, q).move(-0.01 * plane().normals(np.zeros(1))[0], 0.4)[-1]
    pose = forward_kinematics(cell.robot_with_tip, sample.q, frame=TIP)
    assert running.compression > 1e-3
    np.testing.assert_allclose(sample.tip, pose.translation - running.compression * pose.rotation[:, 2], atol=1e-12)


def test_the_arm_follows_its_reference_and_the_delay_is_whole_control_periods() -> None:
    """Shown with a step of the reference: torque answers so many control periods after the period it came in."""
    for delay in (0, 1, 3):
        cell = cell_on(None, control=JointControl(delay=delay), sample_rate=1000.0)
        running = start_cell(cell, pose_above(cell, 0.0, 0.01, surface=plane()), rng=np.random.default_rng(0))
        before = running.sample.tau
        q = running.reference + 1e-3
        changes = [np.abs(running.advance(q, STILL).tau - before).max() for _ in range(6)]
        assert [change > 1.0 for change in changes] == [k >= delay for k in range(6)]
        for _ in range(1000):
            running.advance(q, STILL)
        np.testing.assert_allclose(running.sample.q, q, atol=1e-6)


def test_the_feedforward_is_the_described_robot_with_its_loads_and_a_smooth_sign() -> None:
    gripper = AttachedBody(name="gripper", mass=3.0, centre=np.array([0.0, 0.02, 0.1]))
    cell = cell_on(None, parameters=replace(nominal_parameters(ARM), attached=(gripper,)))
    known = cell.known_robot
    np.testing.assert_allclose(
        known.inertia[-1], ARM.inertia[-1] + gripper.parameters + cell.tool.tip_body(cell.carrier).parameters
    )
    q, dq, ddq = (np.random.default_rng(k).uniform(-1.0, 1.0, ARM.n_v) for k in range(3))
    sharp = replace(cell.control, friction_width=1e-6)
    described = nominal_torque(known).along(q[None], dq[None], ddq[None])[0]
    np.testing.assert_allclose(FeedforwardTorque(sharp, known).at(q, dq, ddq), described, rtol=1e-9)
    still = nominal_torque(known).along(q[None], STILL[None], STILL[None])[0]
    gravity = replace(cell.control, feedforward="gravity")
    np.testing.assert_allclose(FeedforwardTorque(gravity, known).at(q, dq, ddq), still, rtol=1e-9)
    nothing = replace(cell.control, feedforward="nothing")
    np.testing.assert_array_equal(FeedforwardTorque(nothing, known).at(q, dq, ddq), STILL)


def test_the_truth_for_experiments_in_the_air_carries_the_tip() -> None:
    cell = cell_on(plane())
    np.testing.assert_allclose(
        cell.truth_with_tip.carried_inertia, loaded_robot(ARM, [cell.tool.tip_body(cell.carrier)]).inertia
    )
    assert in_the_air(cell).surface is None


def test_a_pass_in_the_air_has_neither_contact_nor_force() -> None:
    cell = in_the_air(cell_on(plane()))
    samples = strokes(cell)
    assert not any(sample.contact for sample in samples)
    assert all(sample.normal_force == 0.0 for sample in samples)


def test_settings_are_read_only_and_pickle() -> None:
    cell = cell_on(barrel(), material=Material(regions=(Region(0.0, 0.1, 2e4),)))
    assert pickle.loads(pickle.dumps(cell)).material == cell.material  # noqa: S301 (our own bytes)
    sample = started_above(cell).sample
    for values in (sample.q, sample.tau, sample.force, sample.tip, sample.temperature):
        assert not values.flags.writeable


def base_frame_arm() -> Robot:
    return replace(ARM, frames=ARM.frames[:1])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: cell_on(plane(), timestep=0.0), "cell, timestep; expected a positive number"),
        (lambda: cell_on(plane(), settle=-1.0), "cell, settle; expected a time >= 0"),
        (lambda: cell_on(plane(), timestep=7e-4), "cell, timesteps in a control period"),
        (lambda: cell_on(plane(), sample_rate=300.0), "cell, control periods in a sample period"),
        (lambda: cell_on(plane(), tool=CompliantTool(stiffness=1e6)), "spring is too stiff for the timestep"),
        (lambda: cell_on(plane(), robot=base_frame_arm()), "frame that does not move"),
        (lambda: cell_on(plane(), robot=replace(ARM, frames=())), "no frame that could carry the tool"),
        (lambda: cell_on(barrel(-0.3)), "no body for a hollow cylinder"),
        (lambda: CompliantTool(stiffness=0.0), "compliant tool, stiffness"),
        (lambda: CompliantTool(length=0.005), "at least the radius of the tip"),
        (lambda: Material(friction=-0.1), "material, friction"),
        (lambda: Material(stiffness=0.0), "material, stiffness"),
        (lambda: Material(regions=((0.1, 0.0, 1e5),)), "material, region"),  # type: ignore[arg-type]
        (lambda: JointControl(bandwidth=0.0), "joint control, bandwidth"),
        (lambda: JointControl(delay=-1), "joint control, delay"),
        (lambda: JointControl(feedforward="all"), "joint control, feedforward"),  # type: ignore[arg-type]
        (lambda: LoadCell(noise=-1.0), "load cell, noise"),
        (lambda: started_above(cell_on(plane(), material=Material(stiffness=1e6))), "material is too stiff"),
        (lambda: started_above(cell_on(plane()), gap=-0.002), "tip starts inside the workpiece"),
    ],
)
def test_settings_that_cannot_be_are_refused(make: Callable[[], object], words: str) -> None:
    with pytest.raises(SimulationError, match=words):
        make()


def test_references_must_be_numbers_of_this_arm() -> None:
    running = started_above(cell_on(plane()))
    with pytest.raises(ArrayError, match="q_ref is not finite"):
        running.advance(np.full(ARM.n_v, np.nan), STILL)
    with pytest.raises(ArrayError, match="dq_ref has the wrong shape"):
        running.advance(STILL, np.zeros(5))


def test_an_arm_that_diverges_is_named_with_its_joint() -> None:
    free = [replace(joint, limits=replace(joint.limits, effort=np.inf)) for joint in ARM.joints]
    cell = cell_on(None, robot=replace(ARM, joints=tuple(free)))
    running = start_cell(cell, pose_above(cell, 0.0, 0.01, surface=plane()), rng=np.random.default_rng(0))
    with pytest.raises(SimulationError, match=r"ur10e, joint .*: the simulated robot went unstable; .* at t = 0\.00"):
        running.advance(running.reference, 1e9 * np.ones(ARM.n_v))


def test_a_tip_that_diverges_is_named() -> None:
    running = started_above(cell_on(plane()))
    running.plant.simulator.data.joint("slide").qvel[0] = 1e7
    with pytest.raises(SimulationError, match="ur10e, tip: the tool's tip went unstable"):
        running.advance(running.reference, STILL)
