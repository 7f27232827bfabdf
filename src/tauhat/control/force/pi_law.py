"""Proportional-integral force control with a low-pass inside, tuned by its bandwidth on a stated stiffness."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

from tauhat.control.force.force_law import ForceLaw, decay, require_positive


class PIMemory(NamedTuple):
    """Low-passed force error [N], and its integral [N s]."""

    filtered: float
    integral: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PIForceLaw(ForceLaw):
    """Speed from the low-passed force error x and its integral: `x' = wf (e - x)`, `speed = kp (x + wi int x)`.

    On a spring `f' = k speed` the open loop is `L(jw) = k kp / (jw) (1 + wi / (jw)) wf / (jw + wf)`, and kp is such
    that |L| = 1 at w = 2 pi bandwidth. Integral and spring together hold a force without error on a surface that comes
    nearer at constant speed: a plane tilted by nobody knows how much. The low-pass is needed: bare force noise, turned
    into speed at every sample, makes a stiff contact chatter.

    A step is exact for an error held over the period: depth at the samples is that of the continuous law. At the speed
    limit the integral stands still while the error drives it further.

    bandwidth : at which the loop gain is one [Hz]
    stiffness : of tool and surface together, for which that holds [N/m]
    integral_part : wi over the crossover, 2 pi bandwidth
    filter_part : wf over the crossover

    Source: Villani and De Schutter, "Force control", Springer Handbook of Robotics, 2nd ed. 2016, section 9.3.
    """

    bandwidth: float = 1.0
    stiffness: float = 1e4
    integral_part: float = 0.25
    filter_part: float = 5.0
    _gain: float = field(init=False, repr=False, default=0.0)

    def __post_init__(self) -> None:
        super(PIForceLaw, self).__post_init__()
        require_positive("PIForceLaw", bandwidth=self.bandwidth, stiffness=self.stiffness)
        require_positive("PIForceLaw", integral_part=self.integral_part, filter_part=self.filter_part)
        lost_in_filter = math.hypot(1.0, 1.0 / self.filter_part)
        won_by_integral = math.hypot(1.0, self.integral_part)
        object.__setattr__(self, "_gain", self.crossover / self.stiffness * lost_in_filter / won_by_integral)

    @property
    def crossover(self) -> float:
        """`2 pi bandwidth` [rad/s]."""
        return 2.0 * math.pi * self.bandwidth

    @property
    def gain(self) -> float:
        """Speed by force error, kp [m/(s N)]."""
        return self._gain

    @property
    def integral_rate(self) -> float:
        """Where the integral takes over, wi [1/s]."""
        return self.integral_part * self.crossover

    @property
    def filter_rate(self) -> float:
        """Corner of the low-pass, wf [1/s]."""
        return self.filter_part * self.crossover

    def start(self) -> PIMemory:
        """Return no error and no integral."""
        return PIMemory(0.0, 0.0)

    def step(self, memory: PIMemory, error: float, period: float) -> tuple[PIMemory, float]:
        """Return the memory behind a period of this error, and the mean speed during it."""
        end, mean = decay(self.filter_rate, period)
        above = memory.filtered - error
        filtered = error + above * end
        integral = memory.integral + period * (error + above * mean)
        mean_integral = memory.integral + 0.5 * period * error + above * (1.0 - mean) / self.filter_rate
        wanted = self._gain * (error + above * mean + self.integral_rate * mean_integral)
        speed = self._within_limit(wanted)
        if speed != wanted and (integral - memory.integral) * wanted > 0.0:
            integral = memory.integral
        return PIMemory(filtered, integral), speed
