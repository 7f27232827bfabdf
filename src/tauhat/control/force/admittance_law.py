"""Admittance control of a force: the tool moves as a mass with a damper would under the force error."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

from tauhat.control.force.force_law import ForceLaw, decay, require_positive


@dataclass(frozen=True, slots=True, kw_only=True)
class AdmittanceLaw(ForceLaw):
    """Speed v of a virtual mass with a damper under the force error e: `m v' + d v = e`. Its memory is v [m/s].

    Without a virtual spring it rests only where the error is zero. On a surface of stiffness k the closed loop is
    `m s^2 + d s + k`; a surface that comes nearer at the speed u leaves an error of `d u`.

    A step is exact for an error held over the period. At the speed limit the mass itself is held.

    mass : m [kg]
    damping : d [N s/m]

    Source: Hogan, "Impedance control: an approach to manipulation", 1985, part I, with position-controlled joints
    beneath; Villani and De Schutter, "Force control", Springer Handbook of Robotics, 2nd ed. 2016, section 9.2.
    """

    mass: float
    damping: float

    def __post_init__(self) -> None:
        super(AdmittanceLaw, self).__post_init__()
        require_positive("AdmittanceLaw", mass=self.mass, damping=self.damping)

    @classmethod
    def tuned(
        cls, *, bandwidth: float = 1.0, stiffness: float = 1e4, filter_part: float = 5.0, speed_limit: float = 5e-3
    ) -> Self:
        """Return the law whose loop gain `k / (w |j w m + d|)` is one at w = 2 pi bandwidth on the stiffness k.

        Parameters
        ----------
        bandwidth : [Hz]
        stiffness : of tool and surface together [N/m]
        filter_part : corner of the law's own low-pass, d / m, over 2 pi bandwidth
        speed_limit : [m/s]
        """
        require_positive("AdmittanceLaw", bandwidth=bandwidth, stiffness=stiffness, filter_part=filter_part)
        crossover = 2.0 * math.pi * bandwidth
        damping = stiffness / (crossover * math.hypot(1.0, 1.0 / filter_part))
        return cls(mass=damping / (filter_part * crossover), damping=damping, speed_limit=speed_limit)

    def start(self) -> float:
        """Return a mass at rest."""
        return 0.0

    def step(self, memory: float, error: float, period: float) -> tuple[float, float]:
        """Return the speed behind a period of this error, and the mean speed during it."""
        end, mean = decay(self.damping / self.mass, period)
        settled = error / self.damping
        after, during = settled + (memory - settled) * end, settled + (memory - settled) * mean
        return self._within_limit(after), self._within_limit(during)
