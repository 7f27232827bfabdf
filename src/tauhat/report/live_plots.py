"""Rolling plots of the last seconds: force with its error band, and external joint torques."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.report.force_marks import SURE_ON_LINE, full_scale
from tauhat.report.live_panel import AXIS_COLOURS, JOINT_COLOURS, boxed

SPAN = 12.0  # [s] that are shown
_SPACING = 0.05  # [s] between points
_LEAST_FORCE, _LEAST_TORQUE = 5.0, 2.0  # [N, Nm] full scale of a quiet plot
_ROOM = 1.1  # of the largest value
_HEIGHT = 140  # [px]
_BAND = 0.16  # opacity
_TIMES = (
    '<div class="faint" style="display:flex;justify-content:space-between;margin:-8px 0 0 44px;font-size:11px">'
    f"<span>{SPAN:.0f} s ago</span><span>{SPAN / 2:.0f} s ago</span><span>now</span></div>"
)


class History:
    """The last seconds of one stream.

    Parameters
    ----------
    n_v : joints
    """

    def __init__(self, n_v: int) -> None:
        self._rows: deque[FloatArray] = deque(maxlen=int(SPAN / _SPACING) + 2)
        self._n_v = n_v

    def add(self, t: float, force: FloatArray, bars: FloatArray, tau: FloatArray) -> None:
        """Keep one moment, unless it follows too closely; time that runs backwards begins anew.

        Parameters
        ----------
        force, bars : (3,) and their standard errors [N]
        tau : (n_v,) [Nm or N]
        """
        if self._rows and t < self._rows[-1][0]:
            self._rows.clear()
        if not self._rows or t - self._rows[-1][0] >= _SPACING:
            self._rows.append(np.concatenate([[t], force, SURE_ON_LINE * bars, tau]))

    @property
    def table(self) -> FloatArray:
        """Columns (7 + n_v, n): seconds before now, force, its 95 % error bars, torques; at least two samples."""
        rows = list(self._rows) or [np.zeros(7 + self._n_v)]
        table = np.array(rows if len(rows) > 1 else rows * 2).T
        table[0] -= table[0, -1]
        return np.asarray(table[:, table[0] >= -SPAN])

    def largest_force(self) -> float:
        """Return the largest size of the force meanwhile [N]."""
        return float(np.linalg.norm(self.table[1:4], axis=0).max())


class Plots:
    """Two plots of viser's panel, drawn from a history.

    Parameters
    ----------
    gui : viser's
    n_v : joints
    """

    def __init__(self, gui: Any, n_v: int) -> None:
        lines, bands = [_line("s", "")], []
        for k, colour in enumerate(AXIS_COLOURS):
            lines += [_line("xyz"[k], colour), _line("high", "transparent"), _line("low", "transparent")]
            bands.append({"series": (2 + 3 * k, 3 + 3 * k), "fill": _faint(colour)})
        gui.add_html(boxed('<span class="faint">Force [N] with its 95 % band</span>'))
        empty = History(n_v)
        force = _plot(gui, force_columns(empty.table), lines, bands=tuple(bands))
        joints = [_line(str(k + 1), JOINT_COLOURS[k % len(JOINT_COLOURS)]) for k in range(n_v)]
        self.words = gui.add_html("")
        torque = _plot(gui, torque_columns(empty.table), [_line("s", ""), *joints], bands=None)
        self._plots, self._scales = (force, torque), [0.0, 0.0]

    def show(self, history: History) -> None:
        """Draw the last seconds."""
        table = history.table
        self._draw(0, force_columns(table), largest=float(np.abs(table[1:4]).max()), least=_LEAST_FORCE)
        self._draw(1, torque_columns(table), largest=float(np.abs(table[7:]).max()), least=_LEAST_TORQUE)

    def _draw(self, index: int, columns: tuple[FloatArray, ...], *, largest: float, least: float) -> None:
        scale = full_scale(_ROOM * largest, least=least, current=self._scales[index])
        if scale != self._scales[index]:
            self._plots[index].scales = _scales(scale)
            self._scales[index] = scale
        self._plots[index].data = columns


def force_columns(table: FloatArray) -> tuple[FloatArray, ...]:
    """Return time, then each component with the upper and the lower edge of its band."""
    edges = [(table[k], table[k] + table[k + 3], table[k] - table[k + 3]) for k in (1, 2, 3)]
    return (table[0], *(column for three in edges for column in three))


def torque_columns(table: FloatArray) -> tuple[FloatArray, ...]:
    """Return time, then the torque of each joint."""
    return (table[0], *table[7:])


def _plot(gui: Any, columns: tuple[FloatArray, ...], series: list[dict[str, Any]], *, bands: Any) -> Any:
    # uPlot leaves the labels of an axis out whose range is fixed, until it changes: words below stand for them.
    axes = ({"show": False}, {"size": 58, "space": 26, "font": "11px sans-serif"})
    plot = gui.add_uplot(
        data=columns,
        series=tuple(series),
        bands=bands,
        scales=_scales(1.0),
        axes=axes,
        legend={"show": False},
        cursor={"show": False},
        height=_HEIGHT,
        padding=(8, 10, 8, 0),
    )
    gui.add_html(boxed(_TIMES))
    return plot


def _line(label: str, colour: str) -> dict[str, Any]:
    return {"label": label, "stroke": colour, "width": 1.5, "points": {"show": False}}


def _scales(full: float) -> dict[str, Any]:
    return {"x": {"time": False, "range": (-SPAN, 0.0)}, "y": {"range": (-full, full)}}


def _faint(colour: str) -> str:
    red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return f"rgba({red},{green},{blue},{_BAND})"
