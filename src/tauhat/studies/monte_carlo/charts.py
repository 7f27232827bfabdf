"""Charts of the study: error over noise, over rate and over cost."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from tauhat.studies.monte_carlo.cells import Cell
from tauhat.studies.monte_carlo.figures import Figures
from tauhat.studies.study import Chart, Series

_ERROR = "error of the torque on an unseen motion [%]"


def error_over_noise(figures: Figures, robot: str, estimators: Sequence[str]) -> Chart:
    """Return one line an estimator at the middle rate, with the quartiles over the seeds."""
    rate = figures.middle_rate
    return Chart(
        title=f"{robot}, {rate:g} Hz: error over noise",
        kind="lines",
        x_title="noise, in parts of the usual one",
        y_title=_ERROR,
        series=_lines(figures, robot, estimators, lambda cell: cell.noise if cell.rate == rate else None),
        logarithmic=("x", "y"),
        note=f"Medians over seeds, and the quartiles of {figures.reference}. A line that flattens to the left has "
        "errors that do not come from noise.",
    )


def error_over_rate(figures: Figures, robot: str, estimators: Sequence[str]) -> Chart:
    """Return one line an estimator at the middle level of noise."""
    noise = figures.middle_noise
    return Chart(
        title=f"{robot}, noise {noise:g}: error over sampling rate",
        kind="lines",
        x_title="rate of the log [Hz]",
        y_title=_ERROR,
        series=_lines(figures, robot, estimators, lambda cell: cell.rate if cell.noise == noise else None),
        logarithmic=("x", "y"),
        note=f"Medians over seeds, and the quartiles of {figures.reference}.",
    )


def error_over_cost(figures: Figures, robot: str) -> Chart:
    """Return for every estimator its error over its processor time, along the rates."""
    noise = figures.middle_noise
    series = _lines(
        figures, robot, figures.study.estimators, lambda cell: cell.seconds if cell.noise == noise else None
    )  # fmt: skip
    return Chart(
        title=f"{robot}, noise {noise:g}: error over cost",
        kind="lines",
        x_title="processor time of a fit [s]",
        y_title=_ERROR,
        series=series,
        logarithmic=("x", "y"),
        note="Each line is one estimator, from the lowest to the highest rate; best is low and to the left.",
    )


def _lines(
    figures: Figures, robot: str, estimators: Sequence[str], place: Callable[[Cell], float | None]
) -> tuple[Series, ...]:
    """Return a line an estimator through the cells that have a place on the axis; bands of all hid each other."""
    lines = []
    for key in estimators:
        cells = figures.cells_where(robot=robot, estimator=key)
        points = [(x, cell) for cell in cells if (x := place(cell)) is not None]
        banded = points if key == figures.reference else []
        lines.append(
            Series(
                name=key,
                x=tuple(x for x, _ in points),
                y=tuple(100.0 * cell.torque_error for _, cell in points),
                low=tuple(100.0 * cell.low for _, cell in banded),
                high=tuple(100.0 * cell.high for _, cell in banded),
            )
        )
    return tuple(lines)
