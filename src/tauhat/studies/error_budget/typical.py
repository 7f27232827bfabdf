"""A typical experiment with a robot, in which every cause of error is there; magnitudes of our choosing."""

from __future__ import annotations

import numpy as np

from tauhat.robots.robot import Robot
from tauhat.simulation.closed_loop import Encoder
from tauhat.simulation.elasticity import ElasticJoints
from tauhat.simulation.experiment import ExperimentSettings
from tauhat.simulation.heat import FrictionHeat
from tauhat.simulation.planned_experiment import PlannedExperiment
from tauhat.simulation.sensors import sensor_preset

SENSORS = "industrial-arm"
_RATE = 500.0  # [Hz] of the log
_BEND = 5e-3  # [rad or m] of an elastic joint under its largest torque
_DAMPING = 0.05  # of the motor on the spring alone, relative to critical
_VISCOUS, _COULOMB = -0.01, -0.003  # [1/K] change of friction
_HEATING, _COOLING = 1e-3, 3600.0  # [K/J, s]


def typical_experiment(robot: Robot) -> PlannedExperiment:
    """Return an experiment with the sensors of an industrial arm, elastic joints, heat, and friction by direction.

    Typical magnitudes of our choosing, not those of a product: joints bend by 5 mrad under their largest torque;
    viscous friction falls by 1 % and Coulomb friction by 0.3 % a kelvin; viscous friction differs by up to 30 %
    between the directions; encoders sit on the motors.

    Raises
    ------
    SimulationError
        when the robot does not state a largest torque.
    """
    every = np.ones(robot.n_v)
    heat = FrictionHeat(
        heating=_HEATING * every,
        time_constant=_COOLING * every,
        viscous=_VISCOUS * every,
        coulomb=_COULOMB * every,
        initial=20.0 * every,
    )
    sensors = sensor_preset(SENSORS, robot)
    return PlannedExperiment(
        robot=robot,
        friction="viscous-asymmetry",
        elasticity=_elasticity(robot),
        heat=heat,
        settings=ExperimentSettings(sample_rate=_RATE, encoder=Encoder(side="motor"), sensors=sensors),
        sensors=SENSORS,
    )


def _elasticity(robot: Robot) -> ElasticJoints | None:
    """Return springs in all joints that have a rotor; None where none has."""
    rotor = np.array([joint.rotor_inertia for joint in robot.joints])
    joints = np.flatnonzero(rotor > 0.0)
    if not joints.size:
        return None
    stiffness = robot.effort_limit[joints] / _BEND
    damping = 2.0 * _DAMPING * np.sqrt(stiffness * rotor[joints])
    return ElasticJoints(joints=tuple(joints.tolist()), stiffness=stiffness, damping=damping)
