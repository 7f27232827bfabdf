"""What a force law is: a pure step from a force error to a speed into the surface."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

from tauhat.errors import ControlError


@dataclass(frozen=True, slots=True, kw_only=True)
class ForceLaw(ABC):
    """Turns a force error into a speed into the surface, never faster than its limit.

    A stiff contact turns speed into force rate, `df/dt = stiffness speed`, so the limit bounds the force rate too.

    speed_limit : [m/s]
    """

    speed_limit: float = 5e-3

    def __post_init__(self) -> None:
        require_positive(type(self).__name__, speed_limit=self.speed_limit)

    @abstractmethod
    def start(self) -> Any:
        """Return the memory before the first step, at rest."""

    @abstractmethod
    def step(self, memory: Any, error: float, period: float) -> tuple[Any, float]:
        """Return the memory behind a period, and the mean speed into the surface during it [m/s].

        Parameters
        ----------
        error : wanted force less the force that is there [N], finite; positive presses deeper
        period : over which the error is held [s]
        """

    def _within_limit(self, speed: float) -> float:
        return max(-self.speed_limit, min(self.speed_limit, speed))


def decay(rate: float, period: float) -> tuple[float, float]:
    """Return `exp(-rate period)`, and the mean of `exp(-rate t)` over the period.

    rate : [1/s], positive
    """
    passed = rate * period
    return math.exp(-passed), -math.expm1(-passed) / passed


def require_positive(where: str, **settings: float) -> None:
    """Refuse settings that are not positive numbers, by name.

    Raises
    ------
    ControlError
        names the first.
    """
    for name, value in settings.items():
        if not 0.0 < value < math.inf:
            raise ControlError(f"{name} is not positive", where=where, expected="a finite number > 0", got=value)
