"""Figures over all arms of a study of the virtual force sensor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tauhat.studies.force_sensing.scene import Pace, SceneSettings, Warmth
from tauhat.studies.force_sensing.trials import Outcome

STEADY, REFRESH, THERMAL = "momentum", "refresh", "thermal"


@dataclass(frozen=True, slots=True, kw_only=True)
class Findings:
    """What became of all observers on all arms."""

    scene: SceneSettings
    outcomes: tuple[Outcome, ...]

    @property
    def observers(self) -> tuple[str, ...]:
        """Names in the order in which they were tried."""
        return tuple(dict.fromkeys(outcome.observer for outcome in self.outcomes))

    @property
    def seeds(self) -> int:
        """Number of arms."""
        return len({outcome.seed for outcome in self.outcomes})

    def of(self, observer: str, *, pace: Pace | None = None, warmth: Warmth | None = None) -> list[Outcome]:
        """Return the outcomes of an observer, at one pace or temperature or at all."""
        return [
            outcome
            for outcome in self.outcomes
            if outcome.observer == observer and pace in {None, outcome.pace} and warmth in {None, outcome.warmth}
        ]

    def drift(self, observer: str) -> list[float]:
        """Return how much friction torque is off, cold against warm, joints in root mean square, arm by arm [Nm]."""
        cold, warm = (self.of(observer, pace="moving", warmth=warmth) for warmth in ("cold", "warm"))
        pairs = zip(cold, warm, strict=True)
        return [float(np.sqrt(np.mean(np.subtract(a.friction, b.friction) ** 2))) for a, b in pairs]


def median(outcomes: list[Outcome], figure: str) -> float:
    """Return the median of a figure."""
    return float(np.median([getattr(outcome, figure) for outcome in outcomes]))


def mean(outcomes: list[Outcome], figure: str) -> float:
    """Return the mean of a figure."""
    return float(np.mean([getattr(outcome, figure) for outcome in outcomes]))
