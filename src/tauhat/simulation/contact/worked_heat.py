"""Hours of work in one step: the temperatures that joints reach when a measured stretch of work goes on.

dT/dt = heating P(T) - (T - ambient) / time_constant,  P(T) = P_m + c (T - T_m)

P_m is the mean power that friction turned to heat over the stretch, T_m the mean temperature in it, and c its slope:
friction of part i is `base_i (1 + slope_i (T - reference))`, hence `c = sum_i P_i slope_i / (1 + slope_i (T_m -
reference))`. The equation is linear, its solution an exponential. Laws whose slopes differ on one joint count with
the mean of those that have one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.simulation.contact.contact_kernel import DRY_WORK, LAW_WORK, VISCOUS_WORK, WARM_TIME
from tauhat.simulation.heat import FrictionHeat

_LEAST_LEFT = 1e-3  # of friction, below which its slope is not told from its power


class FrictionPower(NamedTuple):
    """What friction turned to heat in a stretch of work, on average, (n_v,) each.

    power : of all friction [W]
    slope : change of the power by a kelvin [W/K]
    temperature : at which it was that [deg C]
    """

    power: FloatArray
    slope: FloatArray
    temperature: FloatArray


def friction_power(heat: FrictionHeat, work: FloatArray, seconds: float) -> FrictionPower:
    """Return the mean power from the kernel's sums of work (WORK_ROWS, n_v) over a time [s]."""
    parts = work[[VISCOUS_WORK, DRY_WORK, LAW_WORK]] / seconds
    temperature = work[WARM_TIME] / seconds
    slopes = np.array([heat.viscous, heat.coulomb, _slope_of_laws(heat)])
    left = 1.0 + slopes * (temperature - heat.reference)
    told = left > _LEAST_LEFT
    slope = np.where(told, parts * slopes / np.where(told, left, 1.0), 0.0)
    return FrictionPower(parts.sum(axis=0), slope.sum(axis=0), temperature)


def constant_power(power: FloatArray) -> FrictionPower:
    """Return a power (n_v,) that no temperature changes [W]."""
    nothing = np.zeros(power.shape)
    return FrictionPower(power, nothing, nothing)


def warmed(heat: FrictionHeat, temperature: FloatArray, power: FrictionPower, *, seconds: float) -> FloatArray:
    """Return the temperatures (n_v,) after a time of work that heats with this power [deg C]."""
    rate = 1.0 / heat.time_constant - heat.heating * power.slope
    gain = heat.heating * (power.power - power.slope * power.temperature) + heat.ambient / heat.time_constant
    # exp(-rate t) and its integral; a rate of nothing is growth along a straight line
    still = np.abs(rate * seconds) < 1e-12
    safe = np.where(still, 1.0, rate)
    integral = np.where(still, seconds, -np.expm1(-safe * seconds) / safe)
    return np.asarray(temperature * np.exp(-rate * seconds) + gain * integral)


def _slope_of_laws(heat: FrictionHeat) -> FloatArray:
    """Return the mean slope of the laws that have one, (n_v,) [1/K]."""
    count = np.count_nonzero(heat.laws, axis=0)
    return np.asarray(heat.laws.sum(axis=0) / np.maximum(count, 1))
