"""What was written for other programs, and what they are told of friction."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from tauhat.cli.output import unbroken
from tauhat.cli.views.tables import aligned, table

if TYPE_CHECKING:
    from rich.console import RenderableType

_FORMATS = ("urdf", "mjcf", "c")


def export_view(document: Mapping[str, Any]) -> Iterator[RenderableType]:
    """Yield how near damping and dry friction come to the model's, and each file with what it does not say."""
    if document["approximations"]:
        yield _friction_table(document["approximations"])
        yield "Deviations in steady motion, the largest at 5 to 100 % of the recorded top speed."
    if document["without"]:
        yield f"Left out as asked: {', '.join(document['without'])}."
    for name in _FORMATS:
        told = document.get(name)
        if told is not None:
            yield unbroken(f"Written: {told['path']}")
            yield from _remarks(told)


def _friction_table(approximations: Sequence[Mapping[str, Any]]) -> RenderableType:
    from rich.markup import escape

    columns = {
        "damping": [one["damping"] for one in approximations],
        "dry friction": [one["dry_friction"] for one in approximations],
        "largest\ndeviation": [one["deviation"] for one in approximations],
    }
    made = table(
        "Friction as simulators have it: damping and dry friction",
        ("joint", "unit"),
        (*columns, "in parts\nof friction"),
    )
    rows = zip(approximations, *(aligned(values) for values in columns.values()), strict=True)
    for one, *figures in rows:
        share = f"{100.0 * one['share']:.1f} %"
        made.add_row(escape(one["joint"]), one["unit"], *figures, share)
    return made


def _remarks(told: Mapping[str, Any]) -> Iterator[RenderableType]:
    if told.get("own"):
        yield f"  links without shapes; --source {told['own']} writes into the robot's own file instead"
    if told.get("emptied"):
        yield f"  fixed to a moving link, which holds their inertia now: {', '.join(told['emptied'])}"
    if told.get("kept"):
        yield f"  behind locked joints, kept as they were: {', '.join(told['kept'])}"
    if told["set_to_zero"]:
        values = ", ".join(f"{name} ({value:.3g})" for name, value in told["set_to_zero"].items())
        yield f"  negative, and set to zero: {values}"
    if told["left_out"]:
        sizes = ", ".join(f"{key} (up to {size:.3g})" for key, size in told["left_out"].items())
        yield f"  the format has no word for: {sizes}"
    if told.get("memory"):
        yield f"  friction with a memory ({', '.join(told['memory'])}) is exact in the functions that end in _step"
