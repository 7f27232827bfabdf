"""The words and numbers beside the live picture, as HTML; names from outside stay text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.report.force_marks import SURE_ON_LINE
from tauhat.sensing.touch import Touch
from tauhat.sensing.wrench import Axes

AXIS_COLOURS = ("#d1495b", "#2f9e62", "#3b7dd8")
JOINT_COLOURS = ("#3b7dd8", "#d1495b", "#2f9e62", "#d39a1a", "#8250c4", "#1b9aaa", "#7a5c3e", "#c2559d")
_STATES = {"live": "#2f9e62", "wide": "#d39a1a", "silent": "#c9483b", "waiting": "#868e96", "ended": "#868e96"}
_SHOWN = 6  # contacts
_LONGEST = 40  # letters of a name
_COUNTS = {  # one, and more
    "taken": ("sample taken", "samples taken"), "not_finite": ("not finite", "not finite"),
    "dropped": ("answer dropped", "answers dropped"), "restarts": ("restart", "restarts"),
}  # fmt: skip
STYLE = (
    "<style>.th{font:13px/1.4 system-ui,sans-serif;padding:2px 12px;font-variant-numeric:tabular-nums}"
    ".th table{width:100%;border-collapse:collapse}.th td,.th th{text-align:right;padding:0 0 0 8px;font-weight:400;"
    "white-space:nowrap}.th th{opacity:.65}.th td:first-child,.th th:first-child{text-align:left;padding-left:0}"
    ".th i{display:inline-block;width:10px;height:10px;border-radius:3px;margin-right:6px}"
    ".th .chips{display:flex;flex-wrap:wrap;gap:0 14px}.th .faint{opacity:.65}.th b{font-weight:600}</style>"
)


def boxed(inner: str) -> str:
    """Return a block in the panel's own type."""
    return f'<div class="th">{inner}</div>'


def status_html(state: str, words: str, where: str) -> str:
    """Return the line that says how a stream is and where: `live`, `wide`, `silent`, `ended` or `waiting`, in words."""
    dot = f'<i style="background:{_STATES[state]};border-radius:50%"></i>'
    return boxed(
        f'<div style="display:flex;gap:12px"><span data-state="{state}">{dot}<b>{escape(words)}</b></span>'
        f'<span class="faint" style="margin-left:auto;white-space:nowrap">{_name(where)}</span></div>'
    )


def wrench_html(wrench: FloatArray, covariance: FloatArray, *, axes: Axes) -> str:
    """Return force and moment with their 95 % error bars.

    Parameters
    ----------
    wrench, covariance : (6,), (6, 6) [N, Nm]
    axes : whose axes they are along
    """
    bars = SURE_ON_LINE * np.sqrt(np.maximum(np.diagonal(covariance), 0.0))
    rows = [
        f'<tr><td><i style="background:{AXIS_COLOURS[k]}"></i>{"xyz"[k]}</td>'
        f"<td>{_measured(wrench[k], bars[k])}</td><td>{_measured(wrench[k + 3], bars[k + 3], digits=2)}</td></tr>"
        for k in range(3)
    ]
    head = f"<tr><th>axes of the {axes}, ± 95 %</th><th>force [N]</th><th>moment [Nm]</th></tr>"
    size, bar = size_of_force(wrench, covariance)
    total = f"<tr><td><b>size</b></td><td><b>{_measured(size, bar, sign='')}</b></td><td></td></tr>"
    return boxed(f"<table>{head}{''.join(rows)}{total}</table>")


def size_of_force(wrench: FloatArray, covariance: FloatArray) -> tuple[float, float]:
    """Return the size of a force and its 95 % error bar, to first order along the force itself [N]."""
    force, size = wrench[:3], float(np.linalg.norm(wrench[:3]))
    if size == 0.0:
        return 0.0, SURE_ON_LINE * float(np.sqrt(max(float(np.linalg.eigvalsh(covariance[:3, :3])[-1]), 0.0)))
    along = force / size
    return size, SURE_ON_LINE * float(np.sqrt(max(float(along @ covariance[:3, :3] @ along), 0.0)))


def joints_html(names: Sequence[str], tau: FloatArray, deviation: FloatArray) -> str:
    """Return external joint torques with their 95 % error bars, in the colours of their lines."""
    chips = [
        f'<span><i style="background:{JOINT_COLOURS[k % len(JOINT_COLOURS)]}"></i>{_name(name)} '
        f"{_measured(tau[k], SURE_ON_LINE * deviation[k])}</span>"
        for k, name in enumerate(names)
    ]
    head = '<span class="faint">External joint torque, ± 95 %</span>'
    return boxed(f'{head}<div class="chips">{"".join(chips)}</div>')


def contacts_html(contacts: Sequence[Touch]) -> str:
    """Return the latest contacts, the newest first."""
    if not contacts:
        return boxed('<span class="faint">No contact so far.</span>')
    rows = [
        f"<tr><td>{_name(contact.link)}</td><td>{contact.start:.2f}</td>"
        f"<td>{'goes on' if contact.open else f'{contact.end:.2f}'}</td><td>{contact.peak:.1f}</td></tr>"
        for contact in contacts[:_SHOWN]
    ]
    head = "<tr><th>contact</th><th>began [s]</th><th>ended [s]</th><th>peak [N]</th></tr>"
    more = len(contacts) - _SHOWN
    return boxed(
        f"<table>{head}{''.join(rows)}</table>" + (f'<span class="faint">{more} older</span>' if more > 0 else "")
    )


def counts_html(counts: Mapping[str, int]) -> str:
    """Return what became of the samples."""
    words = [f"{int(value):,}".replace(",", " ") + f" {_counted(name, int(value))}" for name, value in counts.items()]
    return boxed(f'<div class="chips faint">{"".join(f"<span>{word}</span>" for word in words)}</div>')


def _counted(name: str, value: int) -> str:
    one, more = _COUNTS.get(name, (_name(name),) * 2)
    return one if value == 1 else more


def _measured(value: float, bar: float, *, digits: int = 1, sign: str = "+") -> str:
    value = round(float(value), digits) + 0.0  # no minus before a zero
    shown = f"{value:{sign}.{digits}f} ± {bar:.{digits}f}" if bar < 1000.0 else f"{value:{sign}.{digits}f} ± {bar:.0f}"
    return shown.replace("-", "−")


def _name(text: str) -> str:
    return escape(text if len(text) <= _LONGEST else f"{text[: _LONGEST - 1]}…")
