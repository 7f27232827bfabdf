"""The drawing of what residuals hold: shares of the squared residual, one bar an effect and joint."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from tauhat.report.case import Plot
from tauhat.report.figures import LINE_COLOURS, compact, finished, plain
from tauhat.verification.residual_tests import LogResiduals

_MOST = 4  # effects of each joint
_ROW = 20  # [px]


def missing_plot(log: LogResiduals, *, key: str) -> Plot:
    """Return the strongest effects of every joint by themselves; what was not named is pale.

    Parameters
    ----------
    key : id of the drawing in the page
    """
    figure = go.Figure()
    rows = 0
    for index, joint in enumerate(log.joints):
        named = {effect.effect for effect in (*joint.changed, *joint.missing)}
        shown = [*joint.changed, *joint.tried][: _MOST + len(joint.changed)]
        rows += len(shown)
        figure.add_trace(
            go.Bar(
                x=compact(100.0 * np.maximum([effect.share for effect in shown], 0.0)),
                y=[plain(f"{joint.name}: {effect.effect}") for effect in shown],
                error_x={"type": "data", "array": compact(100.0 * np.array([e.standard_error for e in shown]))},
                orientation="h", showlegend=False, hovertemplate="%{y}: %{x:.3g} %<extra></extra>",
                marker={
                    "color": LINE_COLOURS[index % len(LINE_COLOURS)],
                    "opacity": [1.0 if effect.effect in named else 0.25 for effect in shown],
                },
            )
        )  # fmt: skip
    figure.update_xaxes(title_text="share of the squared residual on unseen stretches [%]", range=[0, 105])
    figure.update_yaxes(autorange="reversed", automargin=True, tickfont={"size": 11})
    caption = "Effects by themselves, the strongest of each joint; strong colours: large, sure and named"
    return finished(figure, key=key, caption=caption, height=110 + _ROW * rows)
