"""Simulated experiments: a MuJoCo plant, sensor errors, and recordings that know their truth."""

from tauhat.simulation.experiment import ExperimentSettings, Simulation, Truth, simulate
from tauhat.simulation.gains import tracking_gains
from tauhat.simulation.parameters import TrueParameters, nominal_parameters, perturbed
from tauhat.simulation.plant import Plant, build_plant, plant_gravity_torque
from tauhat.simulation.sensors import Measured, SensorErrors, measure

__all__ = [
    "ExperimentSettings",
    "Measured",
    "Plant",
    "SensorErrors",
    "Simulation",
    "TrueParameters",
    "Truth",
    "build_plant",
    "measure",
    "nominal_parameters",
    "perturbed",
    "plant_gravity_torque",
    "simulate",
    "tracking_gains",
]
