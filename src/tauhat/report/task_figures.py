"""Drawings of a task-oriented design: region and way of the tool, speeds, singular values of each block of columns."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from tauhat.arrays import FloatArray
from tauhat.excitation.task_design import Block, StageDesign, TaskDesign
from tauhat.report.case import Plot
from tauhat.report.figures import LINE_COLOURS, compact, finished, plain
from tauhat.report.marks import marked
from tauhat.robots.kinematics import forward_kinematics

_SAMPLES = 1500
_REGION = "#8c8c8c"
_AXES = "xyz"
_VIEWS = ((0, 2, "from the side"), (0, 1, "from above"))
_ROOM = 0.08  # beside a drawing of the region, in parts of its larger side
_NOTHING = 1e-12  # of the largest singular value: no more than rounding


def region_plot(design: TaskDesign, *, key: str) -> Plot:
    """Return the region and the way of the tool in every stage, from the side and from above, lengths alike."""
    figure = make_subplots(cols=2, horizontal_spacing=0.12)
    lines = [("region", _REGION, _joined(design.region.outline()))]
    for index, found in enumerate(design.stages):
        lines.append((plain(found.stage.name), LINE_COLOURS[index % len(LINE_COLOURS)], tool_path(found)))
    for column, (across, up, view) in enumerate(_VIEWS, start=1):
        for name, colour, points in lines:
            figure.add_trace(
                go.Scatter(
                    x=compact(points[:, across]), y=compact(points[:, up]), mode="lines", name=name, legendgroup=name,
                    showlegend=column == 1, line={"color": colour, "width": 2.5 if name == "region" else 1.5},
                    hovertemplate="%{x:.3f}, %{y:.3f} m",
                ),
                row=1, col=column,
            )  # fmt: skip
        spans = [_span([points[:, axis] for _, _, points in lines]) for axis in (across, up)]
        figure.update_xaxes(
            title_text=f"{_AXES[across]} [m], {view}", range=spans[0], constrain="domain", row=1, col=column
        )
        figure.update_yaxes(
            title_text=f"{_AXES[up]} [m]", range=spans[1], constrain="domain", row=1, col=column,
            scaleanchor="x" if column == 1 else f"x{column}", scaleratio=1,
        )  # fmt: skip
    caption = "Region and way of the tool's origin in the base frame"
    return finished(figure, key=key, caption=caption, height=460, width=640)


def speed_plot(found: StageDesign, *, key: str) -> Plot:
    """Return the speed of every joint during one run, in parts of its limit."""
    motion = found.motion
    samples = motion.sample(np.linspace(0.0, motion.duration, _SAMPLES, endpoint=False))
    limit = motion.settings.joint_limits(motion.robot).velocity
    figure = go.Figure()
    for joint, name in enumerate(motion.robot.joint_names):
        figure.add_trace(
            go.Scatter(
                x=compact(samples.t), y=compact(100.0 * samples.dq[:, joint] / limit[joint]), mode="lines",
                name=plain(name), line={"color": LINE_COLOURS[joint % len(LINE_COLOURS)], "width": 1.5},
                hovertemplate="%{y:.3g} %",
            )
        )  # fmt: skip
    figure.update_xaxes(title_text="time [s]")
    figure.update_yaxes(title_text="speed [% of the limit]")
    return finished(figure, key=key, caption=f"Stage {found.stage.name}", height=330)


def block_plot(design: TaskDesign, block: Block, *, key: str) -> Plot:
    """Return the singular values of a block's regressor, all other columns unknown: of each stage and together."""
    parts = [(plain(found.stage.name), found.information) for found in design.stages]
    if len(parts) > 1:
        parts.append(("together", design.information()))
    figure, shown = go.Figure(), []
    for index, (name, information) in enumerate(parts):
        values = design.singular_values(block, information)
        values = np.where(values > _NOTHING * values[:1], values, np.nan)  # a logarithmic axis has no place for them
        shown += values.tolist()
        figure.add_trace(
            go.Bar(
                x=np.arange(1, values.size + 1), y=compact(values), name=name, hovertemplate="%{y:.3g}",
                marker={"color": LINE_COLOURS[index % len(LINE_COLOURS)]},
            )
        )  # fmt: skip
    figure.update_xaxes(title_text="singular value, largest first", dtick=1 if len(shown) < 60 else None)
    figure.update_yaxes(title_text="of the scaled regressor", type="log", **marked(shown))
    figure.update_layout(barmode="group")
    return finished(figure, key=key, caption=f"Columns of the block {block}", height=330)


def tool_path(found: StageDesign) -> FloatArray:
    """Return where the origin of the tool is during one run, (n, 3) [m]."""
    motion = found.motion
    q = motion.sample(np.linspace(0.0, motion.duration, _SAMPLES)).q
    frame = motion.settings.tool_frame(motion.robot)
    return forward_kinematics(motion.robot, q, frame=frame).translation


def _joined(lines: tuple[FloatArray, ...]) -> FloatArray:
    """Return lines as one, with gaps between."""
    gap = np.full((1, 3), np.nan)
    return np.concatenate([part for line in lines for part in (line, gap)])


def _span(parts: list[FloatArray]) -> list[float]:
    values = np.concatenate(parts)
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    room = _ROOM * max(high - low, 0.05)
    return [low - room, high + room]
