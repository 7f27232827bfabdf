"""Tables of the study: every cell, what failed and why, and how the estimators stand."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from tauhat.studies.monte_carlo.cells import Cell
from tauhat.studies.monte_carlo.families import family_of
from tauhat.studies.monte_carlo.figures import Figures
from tauhat.studies.study import Cell as TableCell
from tauhat.studies.study import Table


def situations(figures: Figures) -> Table:
    """Return what the logs of each robot were like."""
    rows: list[tuple[TableCell, ...]] = []
    for robot in figures.study.robots:
        fits = [fit for fit in figures.fits if fit.robot == robot and not fit.failure]
        conditions = [fit.condition for fit in fits if fit.estimator == figures.reference]
        rows.append(
            (
                robot,
                max((fit.n_parameters for fit in fits), default=0),
                float(np.median(conditions)) if conditions else float("nan"),
                max((fit.seed for fit in figures.fits if fit.robot == robot), default=-1) + 1,
                len([fit for fit in figures.fits if fit.robot == robot]),
            )
        )
    return Table(
        title="Robots",
        header=("robot", "base parameters", "condition number, median", "simulated robots and motions", "fits"),
        rows=tuple(rows),
        note="Condition number of the scaled regressor; below 100 a motion tells the parameters apart well.",
    )


def every_cell(figures: Figures, robot: str, estimators: Sequence[str]) -> Table:
    """Return the figures of some estimators on one robot, a row for each noise and rate."""
    cells = [cell for key in estimators for cell in figures.cells_where(robot=robot, estimator=key)]
    fewer = sorted({cell.seeds for cell in cells})
    seeds = "" if len(fewer) == 1 else f" Seeds of estimators that take above about a second a fit: {fewer[0]}."
    return Table(
        title=robot,
        header=(
            *("estimator", "noise", "rate [Hz]", "parameters off by [%]", "unseen torque off by [%]"),
            *("passes", "time [s]", "ended well [%]", "truth inside 95 % intervals [%]", "bias", "seeds"),
        ),
        rows=tuple(_row(cell) for cell in cells),
        note="Medians over seeds; shares over all. Time is of one processor core. Bias is the mean error over its "
        f"standard error, about 1 where there is none.{seeds}",
    )


def _row(cell: Cell) -> tuple[TableCell, ...]:
    return (
        cell.estimator, cell.noise, cell.rate, 100.0 * cell.parameter_error, 100.0 * cell.torque_error, cell.passes,
        cell.seconds, 100.0 * cell.ended, 100.0 * cell.inside, cell.bias, cell.seeds,
    )  # fmt: skip


def lost_fits(figures: Figures, estimators: Sequence[str]) -> Table | None:
    """Return the fits that did not end well with their commonest reason; None where all did."""
    rows = tuple(
        (cell.estimator, cell.robot, cell.noise, cell.rate, f"{len(cell.losses)} of {cell.seeds}", _commonest(cell))
        for cell in figures.cells
        if cell.estimator in estimators and cell.losses
    )
    if not rows:
        return None
    return Table(
        title="Fits that did not end well",
        header=("estimator", "robot", "noise", "rate [Hz]", "fits", "reason"),
        rows=rows,
        note="The commonest reason of each row, in the words of the library.",
    )


def _commonest(cell: Cell) -> str:
    return Counter(cell.losses).most_common(1)[0][0]


def standings(figures: Figures) -> Table:
    """Return how all estimators stand, the least error first."""
    ordered = sorted(figures.standings, key=lambda row: row.ratio if np.isfinite(row.ratio) else np.inf)
    levels = tuple(f"noise {level:g}" for level in figures.study.noises)
    return Table(
        title=f"Error of the torque over that of {figures.reference}",
        header=("estimator", "family", *levels, "all", "ended well [%]", "inside [%]", "time [s]", "against it"),
        rows=tuple(
            (
                row.estimator,
                family_of(row.estimator),
                *row.ratios,
                row.ratio,
                100.0 * row.ended,
                100.0 * row.inside,
                row.seconds,
                ", ".join(row.reasons) or "nothing",
            )
            for row in ordered
        ),
        note=f"Geometric means over logs that both fitted; below 1 is better than {figures.reference}.",
    )
