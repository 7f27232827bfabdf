"""Measured against predicted torque: the verification table and one drawing a joint."""

from __future__ import annotations

from tauhat.report.case import Case, Section, clock_start
from tauhat.report.figures import torque_plot
from tauhat.report.grading import grade_of
from tauhat.report.rendering import rendered
from tauhat.report.thinning import MOST_POINTS


def torque(case: Case) -> Section:
    """Return for every log the errors per joint and the drawings of torque over time."""
    plots = [
        tuple(torque_plot(log, joint, key=f"torque-{number}-{joint}") for joint in range(len(log.joints)))
        for number, log in enumerate(case.logs)
    ]
    logs = [
        {
            "log": log,
            "fitted": case.was_fitted(log),
            "unfolded": case.is_unfolded(log),
            "start": clock_start(log.t),
            "grades": [grade_of(facts.relative_rms) for facts in log.joints],
            "thinned": log.t.size > MOST_POINTS,
            "plots": drawn,
        }
        for log, drawn in zip(case.logs, plots, strict=True)
    ]
    html = rendered("torque.html.j2", logs=logs, most=MOST_POINTS)
    return Section(
        key="torque",
        title="Measured against predicted torque",
        html=html,
        plots=tuple(p for group in plots for p in group),
    )
