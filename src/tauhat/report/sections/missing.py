"""What the residuals still hold: effects by name, the strongest first."""

from __future__ import annotations

from tauhat.report.case import Case, Section
from tauhat.report.missing_figure import missing_plot
from tauhat.report.rendering import rendered
from tauhat.verification.residual_tests import FALSE_ALARMS


def missing(case: Case) -> Section:
    """Return for every log the effects that its residuals hold as a table and a drawing, and how white they are."""
    plots = tuple(missing_plot(log, key=f"missing-{number}") for number, log in enumerate(case.residuals))
    logs = [{"log": log, "plot": plot} for log, plot in zip(case.residuals, plots, strict=True)]
    html = rendered("missing.html.j2", logs=logs, false_alarms=FALSE_ALARMS)
    return Section(key="missing", title="What the residuals still hold", html=html, plots=plots)
