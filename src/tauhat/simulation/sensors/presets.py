"""Sensors of typical kinds of robots: orders of magnitude to begin a rehearsal with, chosen by us.

No figure is that of a product. Errors of the torque are in parts of each joint's largest torque E (the robot's effort
limit), so that they suit large and small joints. Whoever has a data sheet should put its figures in their place.
`SensorErrors` has the meaning and unit of every number here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import SimulationError
from tauhat.robots.naming import advice_on_name
from tauhat.robots.robot import Robot
from tauhat.simulation.sensors.ripple import Ripple
from tauhat.simulation.sensors.sensor_errors import SensorErrors

_OF_LARGEST = ("torque_noise", "torque_offset_spread", "torque_drift", "torque_walk")


def industrial_arm(robot: Robot) -> SensorErrors:
    """Return the sensors of an arm with currents of its drives and encoders on its motors.

    Raises
    ------
    SimulationError
        when the robot does not state a largest torque.
    """
    parts = SensorErrors(
        encoder_step=2e-6,
        torque_noise=5e-3,
        torque_offset_spread=3e-3,
        torque_drift=2e-3,
        torque_walk=1e-3,
        torque_factor_spread=0.03,
        ripples=(_motor_ripple(3e-3, order=12.0, gear_ratio=100.0),),
        torque_delay=1e-3,
    )
    return _with_torques(parts, _largest_torques(robot))


def cobot(robot: Robot) -> SensorErrors:
    """Return the sensors of an arm with a torque sensor behind each gear, read over a network.

    The torque is that of the link: what the gear's friction and the rotor take is not in it.

    Raises
    ------
    SimulationError
        when the robot does not state a largest torque.
    """
    parts = SensorErrors(
        encoder_step=1e-5,
        velocity="differenced",
        torque_side="link",
        torque_noise=1e-3,
        torque_offset_spread=3e-3,
        torque_drift=2e-3,
        torque_walk=1e-3,
        torque_factor_spread=0.01,
        ripples=(_motor_ripple(2e-3, order=2.0, gear_ratio=100.0),),
        torque_delay=1e-3,
        sampling_jitter=2e-5,
        lost_samples=1e-3,
        lost_run=2.0,
    )
    return _with_torques(parts, _largest_torques(robot))


def low_cost(robot: Robot) -> SensorErrors:
    """Return the sensors of an arm of servos on a bus: coarse encoders, rough currents, stamps of a busy computer.

    Raises
    ------
    SimulationError
        when the robot does not state a largest torque.
    """
    parts = SensorErrors(
        encoder_step=1.5e-3,
        torque_noise=2e-2,
        torque_offset_spread=1e-2,
        torque_drift=1e-2,
        torque_walk=1e-2,
        torque_factor_spread=0.1,
        ripples=(_motor_ripple(1e-2, order=6.0, gear_ratio=200.0),),
        torque_delay=5e-3,
        stamp_jitter=2e-4,
        lost_samples=1e-2,
        lost_run=3.0,
    )
    return _with_torques(parts, _largest_torques(robot))


PRESETS: Mapping[str, Callable[[Robot], SensorErrors]] = {
    "low-cost": low_cost,
    "industrial-arm": industrial_arm,
    "cobot": cobot,
}
"""Sensors of a robot by name, the worst first."""


def sensor_preset(name: str, robot: Robot) -> SensorErrors:
    """Return the sensors of this name for a robot.

    Raises
    ------
    SimulationError
        when the name is unknown, or the robot does not state a largest torque.
    """
    if name not in PRESETS:
        raise SimulationError("unknown sensors", got=name[:60], remedy=advice_on_name(name, PRESETS))
    return PRESETS[name](robot)


def _motor_ripple(part: float, *, order: float, gear_ratio: float) -> Ripple:
    return Ripple(amplitude=part, order=order, turns="motor", gear_ratio=gear_ratio, phase=None)


def _with_torques(parts: SensorErrors, largest: FloatArray) -> SensorErrors:
    """Return sensors whose errors of the torque were given in parts of the largest torques, (n_v,) [Nm or N]."""
    torques: dict[str, Any] = {name: getattr(parts, name) * largest for name in _OF_LARGEST}
    ripples = tuple(replace(ripple, amplitude=ripple.amplitude * largest) for ripple in parts.ripples)
    return replace(parts, **torques, ripples=ripples)


def _largest_torques(robot: Robot) -> FloatArray:
    unknown = ~(np.isfinite(robot.effort_limit) & (robot.effort_limit > 0.0))
    if unknown.any():
        raise SimulationError(
            "no largest torque, of which the errors of typical sensors are parts",
            where=f"{robot.name}, joint {robot.joint_names[int(np.argmax(unknown))]}",
            remedy="state the joint's effort limit, or give the sensor errors themselves",
        )
    return robot.effort_limit
