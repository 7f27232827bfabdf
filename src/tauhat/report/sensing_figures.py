"""Drawings of what was sensed: forces and joint torques over time, each with its 95 % band."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from tauhat.arrays import FloatArray
from tauhat.report.case import Plot, clock_start
from tauhat.report.figures import LINE_COLOURS, MEASURED, compact, finished, plain
from tauhat.report.thinning import thinned

NORMAL = 1.96  # standard errors to either side that hold 95 %
_MOST = 3000  # points a line
_OPACITY = 0.22
_ROW, _TITLE, _EDGES = 150, 36, 110  # [px] of one component, of its title, and around all of them


class Sensed(NamedTuple):
    """One line with its error: name, unit, values and standard errors (n,), and what a sensor measured, if any."""

    name: str
    unit: str
    values: FloatArray
    errors: FloatArray
    measured: FloatArray | None = None


def bands_plot(t: FloatArray, lines: Sequence[Sensed], *, key: str, caption: str) -> Plot:
    """Return components over one time axis, each in a row of its own with its 95 % band.

    Parameters
    ----------
    t : (n,) [s]
    key : id of the drawing in the page
    """
    titles = [plain(line.name) for line in lines]
    gap = _TITLE / (_ROW * len(lines))
    figure = make_subplots(rows=len(lines), shared_xaxes=True, vertical_spacing=gap, subplot_titles=titles)
    figure.update_annotations(x=1.0, xanchor="right", font={"size": 12})  # the legend is on the left
    for row, line in enumerate(lines, start=1):
        for trace in _traces(t, line, shown=row == 1):
            figure.add_trace(trace, row=row, col=1)
        figure.update_yaxes(title_text=line.unit, row=row, col=1, range=_range(line))
    start = clock_start(t)
    figure.update_xaxes(title_text=f"time − {start:.0f} s [s]" if start else "time [s]", row=len(lines), col=1)
    return finished(figure, key=key, caption=caption, height=_EDGES + _ROW * len(lines))


def _traces(t: FloatArray, line: Sensed, *, shown: bool) -> list[Any]:
    kept = thinned(line.values, most=_MOST)
    x, y, half = t[kept] - clock_start(t), line.values[kept], NORMAL * line.errors[kept]
    colour = LINE_COLOURS[1]
    outline = {"x": np.append(x, x[::-1]), "y": compact(np.append(y + half, (y - half)[::-1]))}
    traces = [
        go.Scatter(
            **outline, name="95 % band", mode="lines", line={"width": 0}, fill="toself", fillcolor=colour,
            opacity=_OPACITY, legendgroup="band", showlegend=shown, hoverinfo="skip",
        )
    ]  # fmt: skip
    if line.measured is not None:
        seen = thinned(line.measured, most=_MOST)
        traces.append(_line(t[seen] - clock_start(t), line.measured[seen], "measured", (MEASURED, 2.4), shown))
    return [*traces, _line(x, y, "sensed", (colour, 1.3), shown)]


def _line(x: FloatArray, y: FloatArray, name: str, pen: tuple[str, float], shown: bool) -> Any:
    return go.Scatter(
        x=x, y=compact(y), name=name, mode="lines", line={"color": pen[0], "width": pen[1]}, legendgroup=name,
        showlegend=shown, hovertemplate="%{y:.4g}",
    )  # fmt: skip


def _range(line: Sensed) -> list[float] | None:
    """Return an axis that shows every value and the usual band: behind starts the band is far wider."""
    half = NORMAL * float(np.quantile(line.errors, 0.9))
    settled = line.values[line.errors <= 2.0 * np.quantile(line.errors, 0.9)]
    parts = [settled] if line.measured is None else [settled, line.measured[np.isfinite(line.measured)]]
    both = np.concatenate(parts)
    if not both.size:
        return None
    low, high = float(both.min()) - half, float(both.max()) + half
    rim = 0.05 * (high - low) or 1.0
    return [low - rim, high + rim]
