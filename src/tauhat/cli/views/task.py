"""What programs of a task are worth, for people."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from tauhat.cli.views.tables import table
from tauhat.excitation.task_design import BLOCKS
from tauhat.report.formatting import number

if TYPE_CHECKING:
    from rich.table import Table

_NONE = "–"


def stages_table(stages: Sequence[Mapping[str, Any]]) -> Table:
    """Return one row a stage: how long a run is, how often it runs, and what it is made of."""
    columns = ("one run", "repeats", "moves", "slowed", "found in")
    made = table("Programs", ("stage", "for"), columns)
    for stage in stages:
        counts = (str(stage[key]) for key in ("repeats", "moves", "slowed"))
        made.add_row(
            stage["name"],
            ", ".join(stage["counted"]),
            f"{stage['duration']:.1f} s",
            *counts,
            f"{stage['seconds']:.1f} s",
        )
    return made


def blocks_table(document: Mapping[str, Any]) -> Table:
    """Return the condition of each block of columns, stage by stage and of all together."""
    made = table("Condition of each block while all other columns are unknown", ("readings",), BLOCKS)
    for stage in document["stages"]:
        made.add_row(stage["name"], *_conditions(stage["blocks"]))
    if len(document["stages"]) > 1:
        made.add_row("together", *_conditions(document["together"]["blocks"]))
    return made


def errors_table(document: Mapping[str, Any]) -> Table:
    """Return the mean standard error of each block after each stage, and how many parameters are visible."""
    title = "Mean standard error of scaled parameters, over the noise of one reading"
    made = table(title, ("after",), (*BLOCKS, "visible"))
    seen = 0
    for stage in document["stages"]:
        seen += len(stage["became_visible"])
        errors = (_figure(stage["errors_after"].get(block)) for block in BLOCKS)
        made.add_row(stage["name"], *errors, f"{seen} of {document['together']['parameters']}")
    return made


def visible_text(document: Mapping[str, Any]) -> Iterator[str]:
    """Yield what each stage made visible, and what stays unseen."""
    for stage in document["stages"]:
        yield f"{stage['name']} makes visible: {', '.join(stage['became_visible']) or 'nothing more'}."
    unseen = document["together"]["unseen"]
    yield f"Not visible: {', '.join(unseen)}." if unseen else "Every parameter is visible."


def _conditions(blocks: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    for block in BLOCKS:
        figures = blocks[block]
        singular = figures["condition"] is None and figures["singular_values"]
        yield "singular" if singular else _figure(figures["condition"])


def _figure(value: float | None) -> str:
    return _NONE if value is None else number(value)
