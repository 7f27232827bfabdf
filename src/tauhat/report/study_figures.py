"""The drawings of a study: lines over numbers with bands, values over names with error bars, and bars."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go

from tauhat.arrays import FloatArray
from tauhat.report.case import Plot
from tauhat.report.figures import LINE_COLOURS, finished, plain
from tauhat.report.marks import marked
from tauhat.studies.study import Chart, Series

_BAND_OPACITY = 0.18
_HEIGHT = 420
_MOST_MARKED = 60  # points of a line that are marked
_WIDTH_PER_VALUE = 7  # [px] of a value over a name
_MOST_TICKS = 12  # places that are all marked on a logarithmic axis
_HOVER = "%{x}: %{y:.3g}"


def study_plot(chart: Chart, *, key: str) -> Plot:
    """Return a chart as a drawing of the page.

    Series over numbers are lines with their intervals as bands; series over names are points, or bars, with their
    intervals as error bars. What cannot stand on a logarithmic axis is left out.

    Parameters
    ----------
    key : id of the drawing in the page
    """
    figure = go.Figure()
    for index, series in enumerate(chart.series):
        colour = LINE_COLOURS[index % len(LINE_COLOURS)]
        for trace in _traces(chart, series, colour):
            figure.add_trace(trace)
    names = max((len(series.x) for series in chart.series if _is_named(series)), default=0)
    _arrange(figure, chart)
    width = _WIDTH_PER_VALUE * names * len(chart.series)
    return finished(figure, key=key, caption=chart.title, height=_HEIGHT, width=width)


def _arrange(figure: Any, chart: Chart) -> None:
    """Name the axes; series over the same names stand beside each other."""
    beside = any(_is_named(series) for series in chart.series)
    figure.update_layout(barmode="group", scattermode="group" if beside else "overlay", scattergap=0.3)
    figure.update_xaxes(title_text=plain(chart.x_title), type="log" if "x" in chart.logarithmic else None)
    figure.update_yaxes(title_text=plain(chart.y_title), type="log" if "y" in chart.logarithmic else None)
    if "y" in chart.logarithmic:
        values = [value for series in chart.series for value in (*series.y, *series.low, *series.high)]
        figure.update_yaxes(**marked(values))
    places = sorted({float(place) for series in chart.series for place in series.x if not isinstance(place, str)})
    if "x" in chart.logarithmic and len(places) <= _MOST_TICKS:
        figure.update_xaxes(tickvals=places, ticktext=[f"{place:g}" for place in places])


def _traces(chart: Chart, series: Series, colour: str) -> list[Any]:
    y, low, high = (_drawable(values, chart) for values in (series.y, series.low, series.high))
    name = plain(series.name)
    if chart.kind == "bars" or _is_named(series):
        places = [plain(place) if isinstance(place, str) else place for place in series.x]
        errors = _error_bars(y, low, high) if low.size and high.size else None
        if chart.kind == "bars":
            return [go.Bar(x=places, y=y, name=name, marker={"color": colour}, error_y=errors, hovertemplate=_HOVER)]
        marker = {"color": colour, "size": 6}
        return [
            go.Scatter(
                x=places, y=y, name=name, mode="markers", marker=marker, error_y=errors, offsetgroup=name,
                hovertemplate=_HOVER,
            )
        ]  # fmt: skip
    x = np.array(series.x, dtype=np.float64)
    mode = "lines+markers" if x.size <= _MOST_MARKED else "lines"
    line = go.Scatter(
        x=x, y=y, name=name, mode=mode, line={"color": colour, "width": 2}, legendgroup=name,
        hovertemplate=_HOVER,
    )  # fmt: skip
    return [*_band(x, low, high, colour=colour, name=name), line]


def _band(x: FloatArray, low: FloatArray, high: FloatArray, *, colour: str, name: str) -> list[Any]:
    """Return the area between two lines, where both are there; nothing where none is given."""
    if not (low.size and high.size):
        return []
    both = np.isfinite(low) & np.isfinite(high)
    outline = {"x": np.append(x[both], x[both][::-1]), "y": np.append(high[both], low[both][::-1])}
    return [
        go.Scatter(
            **outline, name=name, mode="lines", line={"width": 0}, fill="toself", fillcolor=colour,
            opacity=_BAND_OPACITY, legendgroup=name, showlegend=False, hoverinfo="skip",
        )
    ]  # fmt: skip


def _error_bars(y: FloatArray, low: FloatArray, high: FloatArray) -> dict[str, Any]:
    return {"type": "data", "symmetric": False, "array": high - y, "arrayminus": y - low, "thickness": 1.5, "width": 2}


def _drawable(values: tuple[float, ...], chart: Chart) -> FloatArray:
    """Return the values with nan where the chart's upright axis has no place for them."""
    numbers = np.array(values, dtype=np.float64)
    lowest = 0.0 if "y" in chart.logarithmic else -np.inf
    return np.where(np.isfinite(numbers) & (numbers > lowest), numbers, np.nan)


def _is_named(series: Series) -> bool:
    return any(isinstance(place, str) for place in series.x)
