"""Drawings of a motion: trajectories against limits, singular values, how well each parameter is seen."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from tauhat.arrays import IntArray
from tauhat.report.case import Plot
from tauhat.report.figures import MEASURED, PREDICTED, RESIDUAL, compact, finished, plain
from tauhat.report.motion_case import MotionCase

_WIDTH_PER_NAME = 15  # [px]
_ROOM = 1.12  # height of an axis, in parts of the limit


def trajectory_plot(case: MotionCase, joint: int, *, key: str) -> Plot:
    """Return position, velocity and acceleration of one joint between their limits."""
    limits, samples = case.limits, case.samples
    figure = make_subplots(rows=3, shared_xaxes=True, vertical_spacing=0.05)
    angle = "rad" if case.robot.joints[joint].kind == "revolute" else "m"
    velocity, acceleration = limits.velocity[joint], limits.acceleration[joint]
    rows = (
        ("position", angle, samples.q[:, joint], (limits.lower[joint], limits.upper[joint])),
        ("velocity", f"{angle}/s", samples.dq[:, joint], (-velocity, velocity)),
        ("acceleration", f"{angle}/s²", samples.ddq[:, joint], (-acceleration, acceleration)),
    )
    for row, (name, unit, values, ends) in enumerate(rows, start=1):
        figure.add_trace(
            go.Scatter(
                x=compact(samples.t), y=compact(values), mode="lines", name=name, line={"color": MEASURED, "width": 2},
                hovertemplate="%{y:.4g}",
            ),
            row=row, col=1,
        )  # fmt: skip
        for end in ends:
            figure.add_hline(y=float(end), line={"color": PREDICTED, "width": 1.5, "dash": "dash"}, row=row, col=1)
        middle, reach = 0.5 * (ends[0] + ends[1]), 0.5 * _ROOM * (ends[1] - ends[0])
        span = [float(middle - reach), float(middle + reach)]
        figure.update_yaxes(title_text=f"{name}<br>[{unit}]", range=span, row=row, col=1)
    figure.update_xaxes(title_text="time [s]", row=3, col=1)
    figure.update_layout(showlegend=False, margin_t=34)
    return finished(figure, key=key, caption=case.robot.joint_names[joint], height=470)


def spectrum_plot(case: MotionCase, *, key: str) -> Plot:
    """Return the singular values of the scaled regressor beside those of independent random states."""
    figure = go.Figure()
    order = np.arange(1, len(case.names) + 1)
    groups = (("this motion", case.singular, PREDICTED), ("independent states", case.singular_random, MEASURED))
    for name, values, colour in groups:
        figure.add_trace(
            go.Scatter(
                x=order, y=compact(values), mode="lines+markers", name=name, line={"color": colour, "width": 2},
                marker={"size": 5}, hovertemplate="%{y:.3g}",
            )
        )  # fmt: skip
    figure.update_xaxes(title_text="singular value, largest first")
    figure.update_yaxes(title_text="of the scaled regressor", type="log")
    return finished(figure, key=key, caption="Singular values", height=340)


def seen_plot(case: MotionCase, order: IntArray, *, key: str) -> Plot:
    """Return the standard deviation of each parameter over that from independent random states, in a given order."""
    names = [plain(case.names[int(index)]) for index in order]
    ratios = case.ratios[order]
    figure = go.Figure(
        go.Bar(
            x=names, y=compact(ratios), marker={"color": [PREDICTED if r <= 1 else RESIDUAL for r in ratios]},
            customdata=compact(case.deviations[order]), hovertemplate="%{x}: %{y:.2f}<extra></extra>",
        )
    )  # fmt: skip
    figure.add_hline(y=1.0, line={"width": 1.5, "dash": "dash", "color": MEASURED})
    figure.update_xaxes(
        categoryorder="array", categoryarray=names, tickangle=-90, dtick=1, tickfont={"size": 11},
        range=[-0.7, len(names) - 0.3],
    )  # fmt: skip
    figure.update_yaxes(title_text="deviation over that<br>from random states")
    figure.update_layout(showlegend=False, margin_t=34)
    caption = "Standard deviation of every parameter, in parts of that from as many independent random states"
    return finished(figure, key=key, caption=caption, height=380, width=_WIDTH_PER_NAME * len(names))
