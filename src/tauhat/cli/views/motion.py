"""What designed motions are worth, for people."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from tauhat.cli.views.tables import table
from tauhat.report.formatting import number, percent

if TYPE_CHECKING:
    from rich.table import Table

GOOD_MOTION = 10.0  # of one motion by itself, columns scaled by constants


def condition_alone(condition: float) -> str:
    """Return how good the condition number of one motion by itself is, in words."""
    return f"condition number {condition:.2f} (columns scaled by constants; good: below {GOOD_MOTION:g})"


def quality(document: Mapping[str, Any], *, after: str | None) -> str:
    """Return how good designed motions are; only one by itself is held against a bound.

    Parameters
    ----------
    document : what `excite` prints as JSON
    after : the estimate they were designed after
    """
    took = f"found in {document['seconds']:.1f} s with {document['evaluations']} evaluations"
    count = len(document["motions"])
    if after is None and count == 1:
        return f"C{condition_alone(document['condition'])[1:]}, log det {document['log_det']:.1f}, {took}."
    motions, were = ("the motion", "was") if count == 1 else (f"the {count} motions", "were")
    told = f"Of {motions} together" if after is None else f"Together with what {after} knows"
    known = document["motions"][0]["mean_error"] if after is None else document["mean_error_before"]
    whose = "of the first motion alone" if after is None else "before"
    return (
        f"{told}: condition number {document['condition']:.2f}, log det {document['log_det']:.1f}; the mean standard "
        f"error of the parameters is {percent(document['mean_error'] / known)} of that {whose}. {motions.capitalize()} "
        f"{were} {took}."
    )


def motions_table(motions: Sequence[Mapping[str, Any]]) -> Table:
    """Return one row a motion, with the figures of it and those before it together."""
    from rich.markup import escape

    made = table("Each together with those before it", ("motion",), ("condition", "log det", "mean error"))
    for motion in motions:
        figures = (f"{motion['condition']:.2f}", f"{motion['log_det']:.1f}", number(motion["mean_error"]))
        made.add_row(escape(motion["motion"]), *figures)
    return made


def limits_table(margins: Mapping[str, float], distances: frozenset[str]) -> Table:
    """Return what is left of each limit, in percent or, for those among `distances`, in millimetres."""
    from rich.markup import escape

    from tauhat.excitation import FAR

    made = table("Limits", ("limit",), ("left unused",))
    for name, margin in margins.items():
        beyond = f"{1e3 * FAR * margin:.0f} mm{' or more' if margin >= 1.0 else ''} beyond the clearance"
        made.add_row(escape(name), beyond if name in distances else f"{100 * margin:.1f} %")
    return made
