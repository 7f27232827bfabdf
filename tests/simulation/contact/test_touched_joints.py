"""The force of the contact is none of friction's: gears and loads feel it, dry friction and heat do not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from polishing_cells import ARM, SEED, Driver, cell_on, frictionless, plane, pose_above, pressed
from test_contact_force import SMOOTH, balance_of

from tauhat.control.force.surface import FlatSurface
from tauhat.robots import forward_kinematics
from tauhat.simulation import FrictionHeat, SensorErrors, TrueParameters, nominal_parameters
from tauhat.simulation import rows as r
from tauhat.simulation import running as running_module
from tauhat.simulation.contact import TIP, Material, start_cell


def heated(truth: TrueParameters) -> TrueParameters:
    even = np.ones(truth.n_v)
    heat = FrictionHeat(
        heating=even, time_constant=1e3 * even, viscous=0.0 * even, coulomb=0.0 * even, initial=20.0 * even
    )  # fmt: skip
    return replace(truth, heat=heat)


def without_friction() -> TrueParameters:
    return replace(frictionless(), viscous=np.zeros(ARM.n_v))


@pytest.mark.parametrize("native", [True, False])
def test_torque_sensors_behind_the_gears_show_the_force_of_the_contact(
    native: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not native:
        monkeypatch.setattr(running_module, "native_functions", lambda _: None)
    cell = cell_on(plane(), material=SMOOTH, sensors=SensorErrors(torque_side="link"))
    running = pressed(cell, hold=6.0 if native else 2.0)
    _, expected = balance_of(running)
    memory = running.plant.memory
    assert np.abs(expected - memory.rows[r.TAU]).max() < 0.1
    assert running.sample.normal_force > 20.0
    np.testing.assert_allclose(running.sample.tau, expected, atol=1e-5 if native else 0.05)
    np.testing.assert_allclose(memory.load, np.abs(expected), atol=1e-5 if native else 0.05)


def test_a_contact_does_not_warm_joints_without_friction() -> None:
    cell = cell_on(plane(), parameters=heated(without_friction()), material=Material(friction=0.3))
    q = pose_above(cell, 0.0, 0.001)
    running = start_cell(cell, q, rng=np.random.default_rng(0))
    running.begin_work()
    driver = Driver(running, q)
    driver.move(-0.01 * plane().normals(np.zeros(1))[0], 0.4)
    sample = driver.move(0.05 * plane().tangents(np.zeros(1))[0], 1.0)[-1]
    assert sample.normal_force > 20.0
    np.testing.assert_allclose(sample.temperature, 20.0, atol=1e-9)
    np.testing.assert_allclose(running.friction_power.power, 0.0, atol=1e-9)


def test_dry_friction_under_a_contact_is_that_of_the_same_motion_in_air() -> None:
    """Joints that move all have their Coulomb friction, against the motion."""
    truth = nominal_parameters(ARM)
    cell = cell_on(plane(), parameters=truth, material=SMOOTH)
    q = pose_above(cell, 0.0, 0.001)
    running = start_cell(cell, q, rng=np.random.default_rng(0))
    driver = Driver(running, q)
    driver.move(-0.01 * plane().normals(np.zeros(1))[0], 0.4)
    assert driver.move(0.1 * plane().tangents(np.zeros(1))[0], 1.0)[-1].normal_force > 20.0
    rows = running.plant.memory.rows
    moving = np.abs(rows[r.DQ]) > 0.02
    assert moving.sum() >= 3
    np.testing.assert_allclose(rows[r.DRY][moving], (truth.coulomb * np.sign(rows[r.DQ]))[moving], rtol=1e-6)


def test_a_sliding_joint_that_carries_the_tool_has_no_dry_friction_from_the_contact() -> None:
    joints = (replace(ARM.joints[0], kind="prismatic"), *ARM.joints[1:])
    robot = replace(ARM, joints=joints)
    cell = cell_on(None, robot=robot, parameters=replace(nominal_parameters(robot), coulomb=np.zeros(robot.n_v)))
    tip = forward_kinematics(cell.robot_with_tip, SEED, frame=TIP)
    below = tip.translation + 1e-6 * tip.rotation[:, 2]
    down = FlatSurface(place=below, rotation=tip.rotation @ np.diag([1.0, -1.0, -1.0]))
    running = start_cell(replace(cell, surface=down, settle=0.0), SEED, rng=np.random.default_rng(0))
    sample = Driver(running, SEED).move(0.02 * tip.rotation[:, 2], 0.2)[-1]
    assert sample.normal_force > 5.0
    np.testing.assert_allclose(running.plant.memory.rows[r.DRY], 0.0, atol=1e-9)
