"""Sensor errors: what a log shows of the true motion and torque, and when."""

from tauhat.simulation.sensors.measuring import Measured, Signals, measure, quantised
from tauhat.simulation.sensors.presets import PRESETS, cobot, industrial_arm, low_cost, sensor_preset
from tauhat.simulation.sensors.ripple import Ripple
from tauhat.simulation.sensors.sensor_errors import SensorErrors

__all__ = [
    "PRESETS",
    "Measured",
    "Ripple",
    "SensorErrors",
    "Signals",
    "cobot",
    "industrial_arm",
    "low_cost",
    "measure",
    "quantised",
    "sensor_preset",
]
