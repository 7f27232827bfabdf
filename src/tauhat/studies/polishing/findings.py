"""Figures over all arms of the polishing study."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tauhat.studies.polishing.arm import ArmSettings, Warmth
from tauhat.studies.polishing.trials import GLOBAL, Drawn, Outcome
from tauhat.studies.polishing.truth import Difficulty


class Spread(NamedTuple):
    """A figure over jobs: median, quartiles and the largest; nan where there is none."""

    median: float
    low: float
    high: float
    largest: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Findings:
    """What became of the jobs of all arms.

    drawn : jobs of one arm to be drawn
    """

    arm: ArmSettings
    outcomes: tuple[Outcome, ...]
    drawn: tuple[Drawn, ...] = ()

    @property
    def arms(self) -> int:
        """Number of arms of each difficulty."""
        return len({outcome.seed for outcome in self.outcomes})

    @property
    def difficulties(self) -> tuple[Difficulty, ...]:
        """In the order in which they were tried."""
        return tuple(dict.fromkeys(outcome.difficulty for outcome in self.outcomes))

    def sensors(self, difficulty: Difficulty) -> tuple[str, ...]:
        """Return ways of sensing that were tried in all scenes of a difficulty, in order."""
        curved = (o.sensor for o in self.outcomes if o.difficulty == difficulty and o.shape == "curved")
        return tuple(dict.fromkeys(curved))

    def others(self) -> tuple[str, ...]:
        """Return ways of sensing that were tried on flat workpieces only, in order."""
        everywhere = self.sensors("easy")
        flat = (o.sensor for o in self.outcomes if o.difficulty == "easy" and o.calibration == GLOBAL)
        names = dict.fromkeys(name for name in flat if name not in everywhere)
        return tuple(name for name in names if not self.near(name))

    def near(self, sensor: str) -> bool:
        """Return whether a way of sensing was tried with both calibrations."""
        return any(o.sensor == sensor and o.calibration != GLOBAL for o in self.outcomes)

    def of(
        self,
        sensor: str,
        difficulty: Difficulty,
        warmth: Warmth,
        *,
        shape: str = "",
        calibration: str = GLOBAL,
    ) -> list[Outcome]:
        """Return the outcomes of a way of sensing, on one shape or on all."""
        return [
            o
            for o in self.outcomes
            if (o.sensor, o.difficulty, o.warmth, o.calibration) == (sensor, difficulty, warmth, calibration)
            and shape in {"", o.shape}
        ]


def spread(outcomes: list[Outcome], figure: str = "rms", scale: float = 100.0) -> Spread:
    """Return the spread of a figure over the jobs that were done to their end."""
    values = [scale * getattr(o, figure) for o in outcomes if o.phase == "done" and np.isfinite(getattr(o, figure))]
    if not values:
        return Spread(np.nan, np.nan, np.nan, np.nan)
    low, median, high = np.percentile(values, [25.0, 50.0, 75.0]).tolist()
    return Spread(median, low, high, max(values))


def finished(outcomes: list[Outcome]) -> str:
    """Return how many jobs were done to their end, and why others were not."""
    done = sum(o.phase == "done" for o in outcomes)
    reasons = sorted({o.reason for o in outcomes if o.phase != "done"})
    return f"{done} of {len(outcomes)}" + (f" ({', '.join(reasons)})" if reasons else "")
