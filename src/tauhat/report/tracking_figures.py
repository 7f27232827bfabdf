"""Drawings of the model in use: tracking errors as bars, motion and error over time, motion simulated again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from tauhat.arrays import FloatArray
from tauhat.report.case import Plot, clock_start
from tauhat.report.figures import LINE_COLOURS, MEASURED, compact, finished, plain
from tauhat.report.marks import marked
from tauhat.report.thinning import MOST_POINTS, thinned
from tauhat.verification.motion_forward import ForwardMotion, ForwardRun
from tauhat.verification.motion_tracking import TrackingComparison, TrackingRun

COLOURS = {
    "none": LINE_COLOURS[7],
    "nominal": LINE_COLOURS[1],
    "identified": LINE_COLOURS[2],
    "learnt": LINE_COLOURS[4],
}
_WIDTH_PER_BAR = 14  # [px]


class _Line(NamedTuple):
    """A line over time: name, values (n,), colour and width."""

    name: str
    values: FloatArray
    colour: str
    width: float


def tracking_bars(result: TrackingComparison, *, key: str) -> Plot:
    """Return the error of every controller on every joint as bars on a logarithmic axis."""
    figure = go.Figure()
    joints = [plain(name) for name in result.names]
    done = [run for run in result.runs if not run.failure]
    for index, run in enumerate(done):
        figure.add_trace(
            go.Bar(
                x=joints, y=compact(1e3 * run.rms), name=plain(run.name), hovertemplate="%{y:.3g}",
                marker={"color": LINE_COLOURS[index % len(LINE_COLOURS)]},
            )
        )  # fmt: skip
    figure.update_layout(barmode="group")
    sizes = [1e3 * run.rms for run in done]
    figure.update_yaxes(title_text=f"rms error [{_thousandths(result.units)}]", type="log", **marked(sizes))
    width = _WIDTH_PER_BAR * len(done) * len(joints)
    return finished(figure, key=key, caption="Tracking error of every joint", height=400, width=width)


def tracking_plot(result: TrackingComparison, runs: Sequence[TrackingRun], joint: int, *, key: str) -> Plot:
    """Return the position of one joint under some controllers beside the reference, over the errors."""
    reference = result.reference[:, joint]
    lines = [_Line("reference", reference, MEASURED, 3.0)]
    lines += [_Line(run.name, reference - run.error[:, joint], COLOURS[run.knows], 1.3) for run in runs]
    errors = [_Line(run.name, 1e3 * run.error[:, joint], COLOURS[run.knows], 1.3) for run in runs]
    unit = result.units[joint]
    return _two_rows(result.t, lines, errors, (unit, "error", f"m{unit}"), (key, result.names[joint]))


def forward_plot(result: ForwardMotion, runs: Sequence[ForwardRun], joint: int, *, key: str) -> Plot:
    """Return the simulated positions of one joint beside the measured one, over their deviations."""
    measured = result.q[:, joint]
    lines = [_Line("measured", measured, MEASURED, 3.0)]
    lines += [_Line(run.model, run.q[:, joint], COLOURS[run.model], 1.3) for run in runs]
    apart = [_Line(run.model, 1e3 * (run.q[:, joint] - measured), COLOURS[run.model], 1.3) for run in runs]
    unit = result.units[joint]
    return _two_rows(result.t, lines, apart, (unit, "deviation", f"m{unit}"), (key, result.names[joint]))


def _two_rows(
    t: FloatArray,
    upper: Sequence[_Line],
    lower: Sequence[_Line],
    words: tuple[str, str, str],
    names: tuple[str, str],
) -> Plot:
    """Return two drawings over one time axis; `words` are position's unit, what is below, and its unit."""
    figure = make_subplots(rows=2, shared_xaxes=True, row_heights=[0.5, 0.5], vertical_spacing=0.06)
    for line in upper:
        figure.add_trace(_trace(t, line), row=1, col=1)
    for line in lower:
        figure.add_trace(_trace(t, line, shown=False), row=2, col=1)
    figure.update_yaxes(title_text=f"position [{words[0]}]", row=1, col=1)
    figure.update_yaxes(title_text=f"{words[1]} [{words[2]}]", row=2, col=1)
    figure.update_xaxes(title_text="time [s]", row=2, col=1)
    return finished(figure, key=names[0], caption=names[1], height=440)


def _trace(t: FloatArray, line: _Line, *, shown: bool = True) -> Any:
    kept = thinned(line.values, most=MOST_POINTS)
    return go.Scatter(
        x=t[kept] - clock_start(t), y=compact(line.values[kept]), mode="lines", name=plain(line.name),
        line={"color": line.colour, "width": line.width}, hovertemplate="%{y:.4g}", showlegend=shown,
        legendgroup=plain(line.name),
    )  # fmt: skip


def _thousandths(units: Sequence[str]) -> str:
    return " or ".join(f"m{unit}" for unit in dict.fromkeys(units))


def finite_runs(runs: Sequence[ForwardRun]) -> tuple[ForwardRun, ...]:
    """Return the runs that could be simulated."""
    return tuple(run for run in runs if np.isfinite(run.rms).all())
