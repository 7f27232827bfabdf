"""The report's drawings: Plotly figures as JSON, arrays as base64, colours and fonts left to the page.

Names of joints and logs come from users, and Plotly reads text as a small HTML: every name passes `plain` first.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from tauhat.arrays import FloatArray, IntArray
from tauhat.report.case import Plot, clock_start
from tauhat.report.thinning import MOST_POINTS, thinned, thinned_cloud
from tauhat.verification.prediction import JointError, LogPrediction

MEASURED, PREDICTED, RESIDUAL = "#7db0ee", "#d9651b", "#b0447f"
_SURE, _LOOSE, _UNKNOWN = "#2f9e62", "#d39a1a", "#c9483b"
_CLOUD_POINTS = 1500
_FLOAT32_SECONDS = 1e3  # below this a float32 tells times apart to 0.06 ms
_WIDTH_PER_NAME = 15  # [px]
_LEGEND_AND_BUTTONS = 56  # [px] above a drawing
_SHOWN_RELATIVE = 2.0  # error bars longer than this part of the value are cut off at the drawing's edge
LINE_COLOURS = ("#3b7dd8", "#e07b28", "#2f9e62", "#b0447f", "#8a6bd1", "#c9a227", "#4fb3bf", "#8c8c8c")


def torque_plot(log: LogPrediction, joint: int, *, key: str, most: int = MOST_POINTS) -> Plot:
    """Return measured and predicted torque of one joint over its residual, on one time axis.

    Parameters
    ----------
    key : id of the drawing in the page
    most : largest number of points a trace
    """
    facts = log.joints[joint]
    measured, predicted = log.tau[:, joint], log.predicted[:, joint]
    figure = make_subplots(rows=2, shared_xaxes=True, row_heights=[0.62, 0.38], vertical_spacing=0.06)
    figure.add_trace(_line(log.t, measured, "measured", (MEASURED, 2.6), most), row=1, col=1)
    figure.add_trace(_line(log.t, predicted, "predicted", (PREDICTED, 1.2), most), row=1, col=1)
    figure.add_trace(_line(log.t, measured - predicted, "residual", (RESIDUAL, 1.2), most), row=2, col=1)
    figure.update_yaxes(title_text=f"{_effort(facts)} [{facts.unit}]", row=1, col=1)
    figure.update_yaxes(title_text=f"residual [{facts.unit}]", row=2, col=1)
    figure.update_xaxes(title_text=_time_title(log.t), row=2, col=1)
    return finished(figure, key=key, caption=facts.name, height=420)


def speed_plot(log: LogPrediction, joint: int, *, key: str) -> Plot:
    """Return the residual of one joint against its velocity, with the rms band of each bin of speed."""
    facts = log.joints[joint]
    error, speed = log.tau[:, joint] - log.predicted[:, joint], log.dq[:, joint]
    shown = thinned_cloud(speed, error, most=_CLOUD_POINTS)
    figure = go.Figure()
    figure.add_trace(
        go.Scatter(
            x=compact(speed[shown]), y=compact(error[shown]), mode="markers", name="samples",
            marker={"color": RESIDUAL, "size": 3, "opacity": 0.4},
            hovertemplate="%{y:.3g} at %{x:.3g}<extra></extra>",
        )
    )  # fmt: skip
    edges, rms = _mirrored_bins(facts)
    for sign in (1.0, -1.0):
        figure.add_trace(
            go.Scatter(
                x=edges, y=sign * rms, mode="lines", line={"shape": "hv", "color": PREDICTED, "width": 2},
                name="± rms by speed", connectgaps=False,
            )
        )  # fmt: skip
    figure.update_xaxes(title_text=f"velocity [{_speed_unit(facts)}]")
    figure.update_yaxes(title_text=f"residual [{facts.unit}]")
    figure.update_layout(margin_t=34, showlegend=False)
    return finished(figure, key=key, caption=facts.name, height=290)


def time_plot(log: LogPrediction, *, key: str) -> Plot:
    """Return each joint's rms residual in ten stretches of time, in percent of the joint's rms torque."""
    figure = go.Figure()
    torque = np.sqrt(np.mean(log.tau**2, axis=0))
    for joint, facts in enumerate(log.joints):
        parts = np.array_split(log.t - clock_start(log.t), len(facts.by_time))
        pairs = [(part, rms) for part, rms in zip(parts, facts.by_time, strict=True) if part.size]
        share = np.array([rms for _, rms in pairs]) / (torque[joint] if torque[joint] > 0 else np.inf)
        figure.add_trace(
            go.Scatter(
                x=compact(np.array([part.mean() for part, _ in pairs])), y=compact(100 * share), mode="lines+markers",
                name=plain(facts.name), line={"color": LINE_COLOURS[joint % len(LINE_COLOURS)], "width": 2},
                hovertemplate="%{y:.3g} %",
            )
        )  # fmt: skip
    figure.update_xaxes(title_text=_time_title(log.t))
    figure.update_yaxes(title_text="rms residual [% of rms torque]", rangemode="tozero")
    return finished(figure, key=key, caption="all joints", height=340)


def parameter_plot(names: Sequence[str], relative: FloatArray, *, key: str) -> Plot:
    """Return every parameter divided by its own value, with its 95 % interval.

    Parameters
    ----------
    names : of the parameters
    relative : (n_b,) half width of the interval over the size of the value
    """
    height = np.minimum(relative, _SHOWN_RELATIVE)
    figure = go.Figure()
    groups = (
        ("surer than ± 10 %", relative < 0.1, _SURE),
        ("± 10 to 100 %", (relative >= 0.1) & (relative < 1), _LOOSE),
        ("interval contains zero", relative >= 1, _UNKNOWN),
    )
    for label, inside, colour in groups:
        members = np.flatnonzero(inside)
        bars = {"type": "data", "array": compact(100 * height[members]), "color": colour, "thickness": 2, "width": 3}
        figure.add_trace(
            go.Scatter(
                x=[plain(names[int(k)]) for k in members], y=np.full(members.size, 100.0), mode="markers", name=label,
                error_y=bars, marker={"color": colour, "size": 6}, customdata=compact(100 * relative[members]),
                hovertemplate="%{x}: ± %{customdata:.3g} %<extra></extra>",
            )
        )  # fmt: skip
    n = len(names)
    figure.update_xaxes(
        categoryorder="array", categoryarray=[plain(name) for name in names], range=[-0.7, n - 0.3],
        tickangle=-90, dtick=1, tickfont={"size": 11},
    )  # fmt: skip
    figure.update_yaxes(title_text="value and interval [% of the value]", range=[-60, 260], zerolinewidth=2)
    caption = "Every parameter over its own value, with its 95 % interval; the longest leave the drawing"
    return finished(figure, key=key, caption=caption, height=400, width=_WIDTH_PER_NAME * n)


def _line(t: FloatArray, values: FloatArray, name: str, pen: tuple[str, float], most: int) -> Any:
    shown = thinned(values, most=most)
    x = _times(t, shown)
    return go.Scatter(
        x=x, y=compact(values[shown]), mode="lines", name=name, line={"color": pen[0], "width": pen[1]},
        hovertemplate="%{y:.4g}",
    )  # fmt: skip


def _times(t: FloatArray, shown: IntArray) -> NDArray[Any]:
    times = t[shown] - clock_start(t)
    return compact(times) if np.abs(times).max(initial=0.0) < _FLOAT32_SECONDS else times


def compact(values: FloatArray) -> NDArray[np.float32]:
    """Return the values as they are stored in the page."""
    return values.astype(np.float32)


def _mirrored_bins(facts: JointError) -> tuple[FloatArray, FloatArray]:
    """Return the edges from minus to plus top speed and the rms from each edge on."""
    rms = np.array(facts.by_speed)
    edges = np.linspace(0.0, facts.top_speed, rms.size + 1)
    both = np.concatenate([rms[::-1], rms])
    return np.concatenate([-edges[:0:-1], edges]), np.append(both, both[-1])


def _effort(facts: JointError) -> str:
    return "force" if facts.unit == "N" else "torque"


def _speed_unit(facts: JointError) -> str:
    return "m/s" if facts.unit == "N" else "rad/s"


def _time_title(t: FloatArray) -> str:
    start = clock_start(t)
    return f"time − {start:.0f} s [s]" if start else "time [s]"


def plain(name: str) -> str:
    """Return a name as text for Plotly, which would read it as HTML."""
    return escape(name)


def finished(figure: Any, *, key: str, caption: str, height: int, width: int = 0) -> Plot:
    """Return the figure as a drawing of the page, without colours and fonts of its own."""
    top = figure.layout.margin.t or _LEGEND_AND_BUTTONS
    figure.update_layout(
        template=None, height=height, margin={"l": 64, "r": 16, "t": top, "b": 44}, hovermode="closest",
        legend={"orientation": "h", "x": 0, "y": 1.0, "yanchor": "bottom"},
    )  # fmt: skip
    return Plot(key=key, caption=caption, height=height, width=width, json=figure.to_json(validate=False))
