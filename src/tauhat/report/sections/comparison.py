"""Models and estimators beside each other."""

from __future__ import annotations

import plotly.graph_objects as go

from tauhat.report.case import Plot, Section
from tauhat.report.figures import finished, plain
from tauhat.report.rendering import rendered
from tauhat.studies.comparison import Comparison


def comparison(result: Comparison) -> Section:
    """Return the table of all outcomes, the errors as bars, and what was warned of."""
    plot = _bars(result)
    sets = any(outcome.fitted_to for outcome in result.outcomes)
    html = rendered("comparison.html.j2", result=result, best=result.best, plot=plot, sets=sets)
    return Section(key="comparison", title="Error on recordings that were not fitted", html=html, plots=(plot,))


def _bars(result: Comparison) -> Plot:
    figure = go.Figure()
    done = [outcome for outcome in result.outcomes if not outcome.failure]
    names = [plain(outcome.name) for outcome in done]
    figure.add_trace(go.Bar(x=names, y=[100.0 * outcome.fit for outcome in done], name="fit"))
    for index, log in enumerate(result.judged):
        errors = [100.0 * outcome.unseen[index] for outcome in done]
        figure.add_trace(go.Bar(x=names, y=errors, name=plain(f"unseen: {log}")))
    figure.update_layout(barmode="group")
    figure.update_yaxes(title_text="error [% of torque]")
    return finished(figure, key="comparison", caption="fit and unseen error", height=420)
