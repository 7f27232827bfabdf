"""What the robots of a rehearsal say together about a length of motion with a kind of sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tauhat.studies.rehearsal.trials import Outcome

SURE = 0.9  # share of the robots that must be within the target


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """Figures of one length and one kind of sensors over the robots that gave a model.

    seconds : of the motion
    robots, models : how many were tried, and gave a model
    error, low, high : median, and what a tenth and nine tenths of the robots stay below; nan where none gave a model
    as_sensed, on_log : medians of the error without the sensors' constant ones, and as `tauhat verify` shows it
    inside : mean share of the 95 % intervals that hold the truth
    condition : median condition number of the fits
    joints : median error joint by joint
    """

    sensors: str
    seconds: float
    robots: int
    models: int
    error: float
    low: float
    high: float
    as_sensed: float
    on_log: float
    inside: float
    condition: float
    joints: tuple[float, ...]

    def meets(self, target: float) -> bool:
        """Return whether nine of ten robots are within the target, and every robot gave a model."""
        return self.models == self.robots and self.high <= target


def cells_of(outcomes: Sequence[Outcome]) -> tuple[Cell, ...]:
    """Return a cell for every kind of sensors and length, the sensors in the order of the outcomes, lengths rising."""
    order = list(dict.fromkeys(outcome.sensors for outcome in outcomes))
    groups: dict[tuple[int, float], list[Outcome]] = {}
    for outcome in outcomes:
        groups.setdefault((order.index(outcome.sensors), outcome.seconds), []).append(outcome)
    return tuple(_cell(groups[key]) for key in sorted(groups))


def cheapest(cells: Sequence[Cell], target: float) -> Cell | None:
    """Return the cell with the worst sensors that meet the target, and of theirs the shortest motion; None where none.

    Sensors are bought, time is not: a longer motion is the cheaper remedy.
    """
    return next((cell for cell in cells if cell.meets(target)), None)


def best(cells: Sequence[Cell]) -> Cell | None:
    """Return the cell with the least error; None where there is no model at all."""
    known = [cell for cell in cells if np.isfinite(cell.high)]
    return min(known, key=lambda cell: cell.high) if known else None


def _cell(outcomes: Sequence[Outcome]) -> Cell:
    first, solved = outcomes[0], [outcome for outcome in outcomes if not outcome.failure]
    low, error, high = np.quantile([outcome.error for outcome in solved], [1.0 - SURE, 0.5, SURE]) if solved else _NONE
    return Cell(
        sensors=first.sensors,
        seconds=first.seconds,
        robots=len(outcomes),
        models=len(solved),
        error=float(error),
        low=float(low),
        high=float(high),
        as_sensed=_median([outcome.as_sensed for outcome in solved]),
        on_log=_median([outcome.on_log for outcome in solved]),
        inside=float(np.mean([outcome.inside for outcome in solved])) if solved else float("nan"),
        condition=_median([outcome.condition for outcome in solved]),
        joints=tuple(np.median([outcome.joints for outcome in solved], axis=0).tolist()) if solved else (),
    )


_NONE = (float("nan"),) * 3


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if values else float("nan")
