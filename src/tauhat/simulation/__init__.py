"""Simulated experiments: a MuJoCo plant, sensor errors, and recordings that know their truth."""

from tauhat.simulation.attached import AttachedBody
from tauhat.simulation.closed_loop import Encoder, Environment
from tauhat.simulation.elasticity import ElasticJoints
from tauhat.simulation.experiment import ExperimentSettings, Simulation, Truth, logged, simulate
from tauhat.simulation.gains import tracking_gains
from tauhat.simulation.heat import FrictionHeat
from tauhat.simulation.parameters import TrueParameters, nominal_parameters, perturbed
from tauhat.simulation.plant import Plant, build_plant, plant_gravity_torque, plant_torque
from tauhat.simulation.running import Reaction, RunningPlant, started
from tauhat.simulation.sensors import PRESETS, Measured, Ripple, SensorErrors, Signals, measure, sensor_preset
from tauhat.simulation.truth_file import load_true_parameters
from tauhat.simulation.typical import KINDS, matching_model, typical_plant, with_true_shapes

__all__ = [
    "KINDS",
    "PRESETS",
    "AttachedBody",
    "ElasticJoints",
    "Encoder",
    "Environment",
    "ExperimentSettings",
    "FrictionHeat",
    "Measured",
    "Plant",
    "Reaction",
    "Ripple",
    "RunningPlant",
    "SensorErrors",
    "Signals",
    "Simulation",
    "TrueParameters",
    "Truth",
    "build_plant",
    "load_true_parameters",
    "logged",
    "matching_model",
    "measure",
    "nominal_parameters",
    "perturbed",
    "plant_gravity_torque",
    "plant_torque",
    "sensor_preset",
    "simulate",
    "started",
    "tracking_gains",
    "typical_plant",
    "with_true_shapes",
]
