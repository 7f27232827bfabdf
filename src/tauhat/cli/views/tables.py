"""The look that all tables share."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table

STYLES = {
    "best": "green", "good": "green", "fair": "yellow", "poor": "red",
    "ok": "green", "note": "cyan", "warning": "yellow", "error": "bold red",
}  # fmt: skip
_HUGE = 1e7  # from here on a number says only that it is absurd
_MOST_DECIMALS = 6
_NOTHING = "–"


def table(title: str, text_columns: tuple[str, ...], number_columns: tuple[str, ...] = ()) -> Table:
    """Return an empty table: texts to the left, then numbers to the right."""
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    made = Table(title=escape(title), title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False)
    for name in text_columns:
        made.add_column(escape(name), overflow="fold", min_width=min(len(name), 12))
    for name in number_columns:
        made.add_column(escape(name), justify="right", no_wrap=True)
    return made


def aligned(values: Sequence[float], *, like: Sequence[float] | None = None, digits: int = 2) -> list[str]:
    """Return numbers with as many decimals as show `digits` of the smallest, so that their points are in line.

    Parameters
    ----------
    like : decides about the decimals instead, as standard errors do for values
    """
    sizes = [abs(value) for value in (values if like is None else like) if value and math.isfinite(value)]
    decimals = min(max(0, digits - 1 - math.floor(math.log10(min(sizes)))), _MOST_DECIMALS) if sizes else 0
    return [_written(value, decimals) if math.isfinite(value) else _NOTHING for value in values]


def _written(value: float, decimals: int) -> str:
    return f"{value:.{decimals}f}" if abs(value) < _HUGE else f"{value:.0e}"


def graded(relative: float) -> str:
    """Return a relative error as percent with two decimals, coloured by its grade."""
    from tauhat.report.grading import grade_of

    style = STYLES[grade_of(relative).key]
    text = f"{100 * relative:.2f} %" if math.isfinite(relative) else _NOTHING
    return f"[{style}]{text}[/{style}]"
