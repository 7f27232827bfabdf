"""The force of the contact is that of springs, skins and Coulomb friction, and the arm carries exactly it."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pinocchio
import pytest
from polishing_cells import ARM, Driver, barrel, cell_on, plane, pose_above, pressed, started_above

from tauhat.arrays import FloatArray
from tauhat.control.force.surface import Surface
from tauhat.robots.kinematics import pinocchio_model
from tauhat.simulation import rows as r
from tauhat.simulation.contact import CompliantTool, Material, Region, RunningCell, start_cell
from tauhat.simulation.contact.workpiece import arc_length, height

SMOOTH = Material(friction=0.0)


def balance_of(running: RunningCell) -> tuple[FloatArray, FloatArray]:
    """Return the torque of the motors at rest, and that of gravity less J'F at the contact, by Pinocchio; (n_v,) each.

    The tip hangs at its true place on the last link of Pinocchio's arm.
    """
    cell, (q, _) = running.cell, running.plant.state
    data = running.plant.simulator.data
    body = cell.tool.tip_body(cell.carrier)
    model, joint = pinocchio_model(cell.robot), cell.carrier.joint + 1
    centre = body.centre - running.compression * cell.carrier.rotation[:, 2]
    model.appendBodyToJoint(joint, pinocchio.Inertia(body.mass, centre, np.zeros((3, 3))), pinocchio.SE3.Identity())
    of_model = model.createData()
    gravity = pinocchio.computeGeneralizedGravity(model, of_model, q).copy()
    pinocchio.forwardKinematics(model, of_model, q)
    point = of_model.oMi[joint].actInv(data.contact.pos[0])
    touch = pinocchio.Frame("touch", joint, pinocchio.SE3(np.eye(3), point), pinocchio.FrameType.OP_FRAME)
    frame = model.addFrame(touch)
    axes = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
    jacobian = pinocchio.computeFrameJacobian(model, model.createData(), q, frame, axes)
    return running.plant.memory.rows[r.TAU].copy(), gravity - jacobian[:3].T @ running.sample.force


def test_a_pressed_spring_gives_its_stiffness_times_its_way() -> None:
    running = pressed(cell_on(plane(), material=SMOOTH))
    assert running.compression > 0.002
    np.testing.assert_allclose(running.sample.normal_force, 1e4 * running.compression, rtol=2e-5)


def test_the_skin_yields_by_force_over_its_stiffness() -> None:
    for stiffness in (2e4, 1.3e5):
        cell = cell_on(plane(), material=Material(friction=0.0, stiffness=stiffness))
        running = pressed(cell, hold=1.0)
        centre = running.plant.simulator.data.geom_xpos[running.plant.simulator.model.geom("tip").id]
        depth = cell.tool.tip_radius - height(plane(), centre)
        np.testing.assert_allclose(depth, running.sample.normal_force / stiffness, rtol=1e-6)


@pytest.mark.parametrize("surface", [plane(), barrel()])
def test_motors_carry_gravity_and_the_force_of_the_contact_and_nothing_else(surface: Surface) -> None:
    running = pressed(cell_on(surface, material=SMOOTH), s=0.05, hold=6.0)
    torque, expected = balance_of(running)
    assert np.abs(torque).max() > 10.0
    np.testing.assert_allclose(torque, expected, atol=1e-6)


def test_a_heavy_tip_spoils_neither_the_true_force_nor_the_balance_but_the_spring_shows_its_weight() -> None:
    tool = CompliantTool(tip_mass=2.0, damping=100.0)
    cell = cell_on(barrel(0.15), material=SMOOTH, tool=tool)
    q = pose_above(cell, 0.0, 0.03)
    running = start_cell(cell, q, rng=np.random.default_rng(0))
    assert abs(running.compression) < 1e-6  # the spring carries the tip's weight in the start pose
    driver = Driver(running, q)
    turned = pose_above(cell, 0.1, 0.002)  # 38 degrees farther round, where the weight pulls less at the spring
    for part in np.linspace(0.0, 1.0, 500):
        driver.q = q + part * (turned - q)
        running.advance(driver.q, (turned - q) / 2.0 if part < 1.0 else np.zeros(ARM.n_v))
    driver.hold(1.0)
    driver.move(-0.01 * barrel(0.15).normals(np.array([0.1]))[0], 0.5)
    driver.hold(6.0)
    torque, expected = balance_of(running)
    np.testing.assert_allclose(torque, expected, atol=1e-6)
    by_spring = tool.stiffness * running.compression
    assert abs(by_spring - running.sample.normal_force) > 2.0


@pytest.mark.parametrize("surface", [plane(), barrel(), barrel(0.12)])
def test_without_friction_the_force_is_along_the_outward_normal_of_the_surface(surface: Surface) -> None:
    running = pressed(cell_on(surface, material=SMOOTH), s=-0.08, hold=0.5)
    sample = running.sample
    s = arc_length(surface, running.plant.simulator.data.contact.pos[0])
    assert abs(s + 0.08) < 0.003
    assert sample.normal_force > 10.0
    np.testing.assert_allclose(sample.force, sample.normal_force * surface.normals(np.array([s]))[0], atol=1e-4)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_sliding_friction_is_its_coefficient_times_the_normal_force_against_the_motion(way: float) -> None:
    cell = cell_on(plane(), material=Material(friction=0.3))
    q = pose_above(cell, 0.0, 0.001)
    driver = Driver(start_cell(cell, q, rng=np.random.default_rng(0)), q)
    normal, tangent = plane().normals(np.zeros(1))[0], plane().tangents(np.zeros(1))[0]
    driver.move(-0.01 * normal, 0.4)
    sample = driver.move(way * 0.05 * tangent, 1.5)[-1]
    np.testing.assert_allclose(sample.force @ normal, sample.normal_force, rtol=1e-9)
    along = sample.force - sample.normal_force * normal
    np.testing.assert_allclose(np.linalg.norm(along), 0.3 * sample.normal_force, rtol=1e-3)
    np.testing.assert_allclose(along @ tangent, -way * np.linalg.norm(along), rtol=1e-3)


def test_the_tip_sticks_while_its_push_is_inside_the_cone() -> None:
    """The reference of the tip goes 0.3 mm aside, which bends the position controller by less than 0.8 N."""
    running = pressed(cell_on(plane(), material=Material(friction=0.8)), hold=1.0)
    before, tangent = running.sample.tip, plane().tangents(np.zeros(1))[0]
    driver = Driver(running, running.reference)
    driver.move(0.003 * tangent, 0.1)
    sample = driver.hold(1.0)[-1]
    push = abs(sample.force @ tangent)
    assert 1.0 < push < 0.7 * sample.normal_force
    assert abs((sample.tip - before) @ tangent) < 1e-5


def test_force_pushes_the_tool_out_while_it_touches_and_is_nothing_before_and_after() -> None:
    cell = cell_on(plane())
    q = pose_above(cell, 0.0, 0.005)
    driver = Driver(start_cell(cell, q, rng=np.random.default_rng(0)), q)
    normal = plane().normals(np.zeros(1))[0]
    samples = [*driver.move(-0.02 * normal, 0.4), *driver.move(0.02 * normal, 0.4)]
    touching = np.array([sample.contact for sample in samples])
    force = np.array([sample.force for sample in samples]) @ normal
    assert 0 < touching.sum() < len(samples)
    assert not touching[0]
    assert not touching[-1]
    assert force[0] == force[-1] == 0.0
    assert force.min() >= 0.0
    assert force[touching].max() > 10.0


def test_the_contact_gives_no_energy_to_a_falling_tip() -> None:
    """The tip of an arm that stands oscillates on skin and spring, each time less."""
    cell = cell_on(plane(), tool=CompliantTool(damping=0.0), material=Material(friction=0.0, relaxation=1e-4))
    running = pressed(cell, hold=2.0)
    data = running.plant.simulator.data
    data.joint("slide").qvel[0] = 0.05
    driver = Driver(running, running.reference)
    forces = np.array([sample.normal_force for sample in driver.hold(1.0)]) - running.sample.normal_force
    swing = [np.ptp(forces[k : k + 50]) for k in range(0, 250, 50)]
    assert all(later <= earlier + 1e-6 for earlier, later in pairwise(swing))
    assert swing[-1] < 0.1 * swing[0]


def test_a_softer_stretch_of_the_path_lets_the_tip_in_deeper() -> None:
    soft = Material(friction=0.0, regions=(Region(0.02, 0.06, 2e4),))
    cell = cell_on(plane(), material=soft)
    q = pose_above(cell, 0.0, 0.001)
    driver = Driver(start_cell(cell, q, rng=np.random.default_rng(0)), q)
    normal, tangent = plane().normals(np.zeros(1))[0], plane().tangents(np.zeros(1))[0]
    driver.move(-0.01 * normal, 0.4)
    samples = driver.move(0.05 * tangent, 1.8)
    s = np.array([arc_length(plane(), sample.tip) for sample in samples])
    depth = -np.array([height(plane(), sample.tip) for sample in samples])
    force = np.array([sample.normal_force for sample in samples])
    for low, high, stiffness in ((0.005, 0.018, 1e5), (0.03, 0.055, 2e4), (0.07, 0.085, 1e5)):
        inside = (s > low) & (s < high)
        assert inside.any()
        np.testing.assert_allclose(depth[inside], force[inside] / stiffness, rtol=0.03)


def test_the_force_of_a_sample_is_its_mean_over_the_period() -> None:
    """Shown: the same bouncing tip, sampled four times as often."""
    coarse = cell_on(plane())
    forces = []
    for cell in (replace(coarse, sample_rate=1000.0), coarse):
        running = started_above(cell, gap=0.0)
        running.plant.simulator.data.joint("slide").qvel[0] = -0.2
        driver = Driver(running, running.reference)
        forces.append(np.array([sample.force for sample in driver.hold(0.2)]))
    assert np.linalg.norm(forces[0], axis=1).max() > 5.0
    np.testing.assert_allclose(forces[0].reshape(-1, 4, 3).mean(axis=1), forces[1], atol=1e-9)
