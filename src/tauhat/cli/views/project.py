"""What became of the steps of a project, as a table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from tauhat.cli.views.tables import graded, table

if TYPE_CHECKING:
    from rich.console import RenderableType

_STYLES = {"kept": "dim", "made": "green", "to make": "cyan", "waits": "yellow", "not reached": "dim"}
_MOST_REASONS = 3


def project_view(document: Mapping[str, Any]) -> Iterator[RenderableType]:
    """Yield the table of steps, and the errors on unseen logs."""
    from rich.markup import escape

    made = table(document["project"], ("step", "state", "why, or what it left"), ("s",))
    for step in document["steps"]:
        style = _STYLES[step["state"]]
        seconds = f"{step['seconds']:.1f}" if step["state"] == "made" else ""
        made.add_row(step["name"], f"[{style}]{step['state']}[/{style}]", escape(_told(step)), seconds)
    yield made
    for log in document["logs"]:
        yield f"{escape(log['log'])}: {graded(log['relative_rms'])} of the torque is not predicted"


def _told(step: Mapping[str, Any]) -> str:
    reasons = step["reasons"]
    if step["state"] != "to make":
        return ", ".join(step["outputs"]) if step["state"] in {"kept", "made"} else ""
    more = f", and {len(reasons) - _MOST_REASONS} more" if len(reasons) > _MOST_REASONS else ""
    return ", ".join(reasons[:_MOST_REASONS]) + more
