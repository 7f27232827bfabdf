"""Sensors of typical kinds of robots: orders of magnitude to begin a rehearsal with, chosen by us.

No figure is that of a product. Errors of the torque are in parts of each joint's largest torque E (the robot's effort
limit), so that they suit large and small joints. Whoever has a data sheet should put its figures in their place.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import SimulationError
from tauhat.robots.naming import advice_on_name
from tauhat.robots.robot import Robot
from tauhat.simulation.sensors.ripple import Ripple
from tauhat.simulation.sensors.sensor_errors import SensorErrors


def industrial_arm(robot: Robot) -> SensorErrors:
    """Return the sensors of an arm with currents of its drives and encoders on its motors, no velocity logged.

    Typical magnitudes of our choosing, not those of a product:

    | error | |
    |---|---|
    | step of the position | 2e-6 rad |
    | torque | of the motor |
    | white noise of the torque | 0.5 % of E |
    | offset | 0.3 % of E, drawn |
    | drift; random walk | 0.2 % of E an hour; 0.1 % of E after an hour |
    | torque constants | 3 %, drawn |
    | ripple of the motor, cogging | 0.3 % of E, 12 in a revolution, gear 100 |
    | torque later than the position | 1 ms |

    Raises
    ------
    SimulationError
        when the robot does not state a largest torque.
    """
    largest = _largest_torques(robot)
    return SensorErrors(
        encoder_step=2e-6,
        torque_noise=5e-3 * largest,
        torque_offset_spread=3e-3 * largest,
        torque_drift=2e-3 * largest,
        torque_walk=1e-3 * largest,
        torque_factor_spread=0.03,
        ripples=(Ripple(amplitude=3e-3 * largest, order=12.0, turns="motor", gear_ratio=100.0, phase=None),),
        torque_delay=1e-3,
    )


def cobot(robot: Robot) -> SensorErrors:
    """Return the sensors of an arm with a torque sensor behind each gear, read over a network.

    The torque is that of the link: what the gear's friction and the rotor take is not in it. Typical magnitudes of our
    choosing, not those of a product:

    | error | |
    |---|---|
    | step of the position | 1e-5 rad |
    | velocity | differenced |
    | torque | of the link |
    | white noise of the torque | 0.1 % of E |
    | offset | 0.3 % of E, drawn |
    | drift; random walk | 0.2 % of E an hour; 0.1 % of E after an hour |
    | gain of the sensor | 1 %, drawn |
    | ripple of a strain wave gear | 0.2 % of E, 2 in a revolution of the motor, gear 100 |
    | torque later than the position | 1 ms |
    | instants about the clock, stamps tell them | 20 us |
    | lost rows | 0.1 %, 2 at a time |

    Raises
    ------
    SimulationError
        when the robot does not state a largest torque.
    """
    largest = _largest_torques(robot)
    return SensorErrors(
        encoder_step=1e-5,
        velocity="differenced",
        torque_side="link",
        torque_noise=1e-3 * largest,
        torque_offset_spread=3e-3 * largest,
        torque_drift=2e-3 * largest,
        torque_walk=1e-3 * largest,
        torque_factor_spread=0.01,
        ripples=(Ripple(amplitude=2e-3 * largest, order=2.0, turns="motor", gear_ratio=100.0, phase=None),),
        torque_delay=1e-3,
        sampling_jitter=2e-5,
        lost_samples=1e-3,
        lost_run=2.0,
    )


def low_cost(robot: Robot) -> SensorErrors:
    """Return the sensors of an arm of servos on a bus: coarse encoders, rough currents, stamps of a busy computer.

    Typical magnitudes of our choosing, not those of a product:

    | error | |
    |---|---|
    | step of the position | 1.5e-3 rad (12 bits) |
    | torque | of the motor |
    | white noise of the torque | 2 % of E |
    | offset | 1 % of E, drawn |
    | drift; random walk | 1 % of E an hour; 1 % of E after an hour |
    | torque constants | 10 %, drawn |
    | ripple of the motor, cogging | 1 % of E, 6 in a revolution, gear 200 |
    | torque later than the position | 5 ms |
    | stamps about the instants | 0.2 ms |
    | lost rows | 1 %, 3 at a time |

    Raises
    ------
    SimulationError
        when the robot does not state a largest torque.
    """
    largest = _largest_torques(robot)
    return SensorErrors(
        encoder_step=1.5e-3,
        torque_noise=2e-2 * largest,
        torque_offset_spread=1e-2 * largest,
        torque_drift=1e-2 * largest,
        torque_walk=1e-2 * largest,
        torque_factor_spread=0.1,
        ripples=(Ripple(amplitude=1e-2 * largest, order=6.0, turns="motor", gear_ratio=200.0, phase=None),),
        torque_delay=5e-3,
        stamp_jitter=2e-4,
        lost_samples=1e-2,
        lost_run=3.0,
    )


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


def _largest_torques(robot: Robot) -> FloatArray:
    unknown = ~(np.isfinite(robot.effort_limit) & (robot.effort_limit > 0.0))
    if unknown.any():
        raise SimulationError(
            "no largest torque that errors of typical sensors could be parts of",
            where=f"{robot.name}, joint {robot.joint_names[int(np.argmax(unknown))]}",
            remedy="state the joint's effort limit, or give the sensor errors themselves",
        )
    return robot.effort_limit
