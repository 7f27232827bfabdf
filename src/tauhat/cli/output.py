"""What goes to standard output: one JSON document, or views for people."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

import typer

from tauhat.plain_data import without_infinities

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.text import Text


def show(document: Mapping[str, Any], view: Callable[[], Iterable[RenderableType]], *, as_json: bool) -> None:
    """Print a result: its document as JSON, or what `view` makes of it."""
    if as_json:
        typer.echo(json.dumps(without_infinities(document), indent=1, allow_nan=False))
        return
    from rich.console import Console

    console = Console(highlight=False)
    for part in view():
        console.print(part)


def unbroken(text: str) -> Text:
    """Return text whose lines are never wrapped: paths and commands that are copied."""
    from rich.text import Text

    return Text(text, no_wrap=True, overflow="ignore")


def counted(counts: Mapping[str, int], *, none: str = "none") -> str:
    """Return how many there were of each name, without those of which there were none."""
    return ", ".join(f"{count} {name}" for name, count in counts.items() if count) or none
