"""Findings about a log, the gravest first."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import zip_longest
from typing import TYPE_CHECKING

from tauhat.cli.views.tables import STYLES

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.text import Text

    from tauhat.recordings.findings import Finding


def findings_view(findings: Iterable[Finding]) -> RenderableType:
    """Return one block per finding: how grave, what, and what to do; advice that repeats is given once."""
    from rich.table import Table

    made = Table.grid(padding=(0, 2))
    made.add_column(no_wrap=True)
    made.add_column(overflow="fold")
    listed = list(findings)
    for finding, after in zip_longest(listed, listed[1:]):
        repeated = after is not None and after.advice == finding.advice
        made.add_row(
            f"[{STYLES[finding.severity]}]{finding.severity}", _told(finding, "" if repeated else finding.advice)
        )
    return made


def _told(finding: Finding, advice: str) -> Text:
    from rich.text import Text

    about = finding.joint if finding.joint and finding.joint not in finding.message else ""
    text = Text(f"{about}: {finding.message}" if about else finding.message)
    if advice:
        text.append(f"\n→ {advice}", style="dim")
    return text
