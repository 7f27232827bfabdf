"""Feed along a pass: from rest to constant speed and back to rest, with an acceleration that is never stepped."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from tauhat.control.force.force_law import require_positive


@dataclass(frozen=True, slots=True, kw_only=True)
class FeedProfile:
    """One pass from -half to half over its own time: speed rises as `v (1 - cos(pi t / T)) / 2`, and falls so.

    The largest acceleration is `pi v / (2 T)`, which gives T. A pass too short for v runs at the speed whose two ramps
    fill it, `v = sqrt(4 half acceleration / pi)`.

    half : [m]
    speed : wanted [m/s]
    acceleration : largest [m/s^2]
    """

    half: float
    speed: float
    acceleration: float
    _fastest: float = field(init=False, repr=False, default=0.0)
    _ramp: float = field(init=False, repr=False, default=0.0)
    _duration: float = field(init=False, repr=False, default=0.0)

    def __post_init__(self) -> None:
        require_positive("feed profile", half=self.half, speed=self.speed, acceleration=self.acceleration)
        fastest = min(self.speed, math.sqrt(4.0 * self.half * self.acceleration / math.pi))
        ramp = 0.5 * math.pi * fastest / self.acceleration
        object.__setattr__(self, "_fastest", fastest)
        object.__setattr__(self, "_ramp", ramp)
        object.__setattr__(self, "_duration", ramp + 2.0 * self.half / fastest)

    @property
    def duration(self) -> float:
        """Time of a pass without pauses [s]."""
        return self._duration

    def at(self, t: float) -> tuple[float, float]:
        """Return position [m] and speed [m/s] at a time of the pass; before it and after it, those of its ends."""
        if t > 0.5 * self._duration:
            position, speed = self._first_half(max(0.0, self._duration - t))
            return -position, speed
        return self._first_half(max(0.0, t))

    def _first_half(self, t: float) -> tuple[float, float]:
        if t >= self._ramp:
            return -self.half + self._fastest * (t - 0.5 * self._ramp), self._fastest
        angle = math.pi * t / self._ramp
        passed = 0.5 * self._fastest * (t - self._ramp / math.pi * math.sin(angle))
        return -self.half + passed, self._fastest * math.sin(0.5 * angle) ** 2
