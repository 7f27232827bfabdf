"""Contacts along logs, as a table, and what their thresholds are worth."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from tauhat.cli.views.tables import table
from tauhat.report.formatting import number

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tauhat.sensing.contact import ContactEvent
    from tauhat.sensing.contact_thresholds import ContactThresholds

_SHOWN = 20


def contacts_view(
    found: Sequence[tuple[int, ContactEvent]], names: Sequence[str], thresholds: ContactThresholds
) -> Iterator[RenderableType]:
    """Yield the first contacts, and how far the thresholds can be trusted."""
    from rich.markup import escape
    from rich.text import Text

    if found:
        made = table("Contacts", ("log", "link"), ("from s", "to s", "peak N", "x threshold"))
        for place, event in found[:_SHOWN]:
            figures = (f"{event.start:.2f}", f"{event.end:.2f}", f"{event.peak:.1f}", f"{event.excess:.1f}")
            made.add_row(escape(names[place]), escape(event.link), *figures)
        yield made
    more = f", the first {_SHOWN} are shown" if len(found) > _SHOWN else ""
    yield Text(f"Contacts: {len(found)}{more}; {_worth(thresholds)}\n")


def _worth(thresholds: ContactThresholds) -> str:
    if not thresholds.seconds.any():
        return "no free motion was given (--free LOG), so nothing is known of false ones."
    if thresholds.keeps_rate:
        return f"thresholds allow {thresholds.rate:g} false ones an hour."
    return (
        f"{thresholds.seconds.sum():.0f} s of free motion can promise {number(thresholds.promised)} false ones "
        f"an hour, {thresholds.rate:g} were asked for."
    )
