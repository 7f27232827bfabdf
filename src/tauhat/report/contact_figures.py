"""Drawings of contacts and warmth: force, and torque in parts of its threshold, marked where a link is touched."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from tauhat.arrays import FloatArray
from tauhat.report.case import Plot, clock_start
from tauhat.report.figures import LINE_COLOURS, compact, finished, plain
from tauhat.report.sensing_figures import Sensed, bands_plot
from tauhat.report.thinning import thinned
from tauhat.sensing.contact import ContactEvent
from tauhat.sensing.judged_log import JudgedLog

_MOST = 3000  # points a line
_MARKED = 0.28  # opacity of a contact
_HEIGHT = 420  # [px]
_FEWEST_WIDE = 0.002  # of the log's length: no mark is narrower


def contacts_plot(judged: JudgedLog, *, key: str) -> Plot:
    """Return the size of the force, and torque in parts of its threshold, with every contact marked by its link."""
    log, contacts = judged.sensed, judged.contacts
    titles = [f"size of the force at {plain(log.frame)}", "largest joint torque, in parts of its threshold"]
    figure = make_subplots(rows=2, shared_xaxes=True, vertical_spacing=0.12, subplot_titles=titles)
    figure.update_annotations(x=1.0, xanchor="right", font={"size": 12})  # the legend is on the left
    start, force = clock_start(log.t), np.linalg.norm(log.wrench[:, :3], axis=1)
    tops = [1.05 * max(float(values[log.settled].max(initial=0.0)), least) for values, least in
            ((force, 1.0), (contacts.excess, 1.2))]  # fmt: skip
    links = dict.fromkeys(event.link for event in contacts.events)
    for place, link in enumerate(links):
        colour = LINE_COLOURS[(place + 2) % len(LINE_COLOURS)]
        spans = _spans([event for event in contacts.events if event.link == link], log.t, start)
        for row, top in enumerate(tops, start=1):
            figure.add_trace(_mark(spans, top, plain(link), colour, shown=row == 1), row=row, col=1)
    for row, values in enumerate((force, contacts.excess), start=1):
        figure.add_trace(_line(log.t, values, ("force", "torque / threshold")[row - 1]), row=row, col=1)
    figure.add_hline(y=1.0, line={"dash": "dot", "width": 1.2}, row=2, col=1)
    figure.update_yaxes(title_text="N", range=[0.0, tops[0]], row=1, col=1)
    figure.update_yaxes(title_text="threshold = 1", range=[0.0, tops[1]], row=2, col=1)
    figure.update_xaxes(title_text=f"time − {start:.0f} s [s]" if start else "time [s]", row=2, col=1)
    caption = "Contacts, by the link that is touched or the last one inside of it"
    return finished(figure, key=key, caption=caption, height=_HEIGHT)


def warmth_plot(judged: JudgedLog, *, key: str) -> Plot | None:
    """Return the warmth of every joint with its 95 % band; None where the observer follows none."""
    if judged.warmth is None or judged.warm_times is None or not judged.warm_times.size:
        return None
    errors = np.sqrt(judged.warmth.variance)
    lines = [
        Sensed(name, "", judged.warmth.theta[:, k], errors[:, k]) for k, name in enumerate(judged.sensed.joint_names)
    ]
    return bands_plot(judged.warm_times, lines, key=key, caption="Warmth of the joints")


def _spans(events: Sequence[ContactEvent], t: FloatArray, start: float) -> FloatArray:
    """Return from and to of events, no narrower than can be seen, (n, 2) [s]."""
    spans = np.array([(event.start, event.end) for event in events]) - start
    least = _FEWEST_WIDE * float(t[-1] - t[0])
    return np.stack([spans[:, 0], np.maximum(spans[:, 1], spans[:, 0] + least)], axis=1)


def _mark(spans: FloatArray, top: float, link: str, colour: str, *, shown: bool) -> Any:
    """Return all contacts of one link as one trace of boxes from the axis to the top."""
    x = [value for a, b in spans.tolist() for value in (a, a, b, b, None)]
    y = [value for _ in spans for value in (0.0, top, top, 0.0, None)]
    return go.Scatter(
        x=x, y=y, name=link, legendgroup=link, showlegend=shown, mode="lines", line={"width": 0}, fill="toself",
        fillcolor=colour, opacity=_MARKED, hoverinfo="skip",
    )  # fmt: skip


def _line(t: FloatArray, values: FloatArray, name: str) -> Any:
    kept = thinned(values, most=_MOST)
    return go.Scatter(
        x=t[kept] - clock_start(t), y=compact(values[kept]), name=name, mode="lines", showlegend=False,
        line={"color": LINE_COLOURS[0], "width": 1.2}, hovertemplate="%{y:.4g}",
    )  # fmt: skip
