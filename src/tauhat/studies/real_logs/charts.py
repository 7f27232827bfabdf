"""Charts of the study: error of every estimator on every case, and each model beside the reference."""

from __future__ import annotations

import numpy as np

from tauhat.studies.real_logs.figures import Figures
from tauhat.studies.study import Chart, Series

_BY_CASE = "case"
_WIDE = 5.0  # ratio from which a linear axis would squeeze the others


def over_the_best(figures: Figures, model: str) -> Chart:
    """Return each estimator's error over the least error of the case, with one model."""
    least = figures.least()
    series = []
    for estimator in figures.estimators:
        found = {fit.case: fit for fit in figures.of_pair((model, estimator)) if not fit.loss}
        ratios = tuple(found[name].error / least[name] if name in found else np.nan for name in least)
        series.append(Series(name=estimator, x=tuple(least), y=ratios))
    return Chart(
        title=f"{model}: error over the least of the case",
        kind="lines",
        x_title=_BY_CASE,
        y_title="error over the least",
        series=tuple(series),
        logarithmic=("y",) if any(ratio > _WIDE for line in series for ratio in line.y) else (),
        note="1 is the best of all models and estimators on this case. A point that is missing did not end well.",
    )


def beside_the_reference(figures: Figures) -> Chart:
    """Return the error of each model with the first estimator on every case, and the reference."""
    estimator = figures.estimators[0]
    cases = figures.unseen
    names = tuple(case.name for case in cases)
    series = []
    if any(case.reference for case in cases):
        reference = tuple(100.0 * float(np.mean(case.reference)) if case.reference else np.nan for case in cases)
        series.append(Series(name="reference", x=names, y=reference))
    for model in figures.models:
        errors = {fit.case: 100.0 * fit.error for fit in figures.of_pair((model, estimator)) if not fit.loss}
        series.append(
            Series(name=f"{model}, {estimator}", x=names, y=tuple(errors.get(name, np.nan) for name in names))
        )
    return Chart(
        title="Error of the torque on unseen logs",
        kind="bars",
        x_title=_BY_CASE,
        y_title="error over torque [%]",
        series=tuple(series),
        logarithmic=("y",),
        note="Reference: the plain baseline that the file of cases names. A bar that is missing did not end well.",
    )
