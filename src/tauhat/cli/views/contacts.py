"""Contacts along logs, as a table, and what their thresholds are worth."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from tauhat.cli.views.tables import table
from tauhat.report.formatting import number

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tauhat.sensing.contact_thresholds import ContactThresholds
    from tauhat.sensing.judged_log import JudgedLog

_SHOWN = 20


def contacts_view(judged: Sequence[JudgedLog]) -> Iterator[RenderableType]:
    """Yield the first contacts, what they are, and how far the thresholds can be trusted."""
    from rich.markup import escape
    from rich.text import Text

    from tauhat.report.contact_words import kind_of

    found = [(log.sensed.name, event) for log in judged for event in log.contacts.events]
    if found:
        several = len(judged) > 1
        texts = ("log",) * several + ("link", "what")
        made = table("Contacts", texts, ("from s", "to s", "peak N", "±", "x threshold"))
        for name, event in found[:_SHOWN]:
            sizes = (event.start, event.end), (event.peak, event.peak_std, event.excess)
            figures = (*(f"{value:.2f}" for value in sizes[0]), *(f"{value:.1f}" for value in sizes[1]))
            made.add_row(*(escape(name),) * several, escape(event.link), kind_of(event), *figures)
        yield made
    more = f", the first {_SHOWN} are shown" if len(found) > _SHOWN else ""
    yield Text(f"Contacts: {len(found)}{more}; {worth(judged[0].thresholds)}\n")


def worth(thresholds: ContactThresholds) -> str:
    """Return what is known of false contacts."""
    if not thresholds.seconds.any():
        return "no free motion was given (--free LOG), so nothing is known of false ones."
    if thresholds.keeps_rate:
        return f"thresholds allow {thresholds.rate:g} false ones an hour."
    return (
        f"{thresholds.seconds.sum():.0f} s of free motion can promise {number(thresholds.promised)} false ones "
        f"an hour; asked for: {thresholds.rate:g}."
    )
