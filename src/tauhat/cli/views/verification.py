"""Prediction errors as tables."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from tauhat.cli.views.tables import STYLES, aligned, graded, table

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tauhat.verification.prediction import LogPrediction, Verification


def verification_view(verification: Verification) -> Iterator[RenderableType]:
    """Yield one table and one sentence per log."""
    for log in verification.logs:
        yield _log_table(log)
        yield _verdict(log)


def _log_table(log: LogPrediction) -> RenderableType:
    from rich.markup import escape

    title = f"{log.log}: measured against predicted torque"
    made = table(title, ("joint", "unit"), ("rms error", "of torque", "R²", "worst", "at [s]"))
    joints = log.joints
    rms = aligned([*(joint.rms for joint in joints), log.rms])
    worst = aligned([joint.worst for joint in joints])
    for joint, error, largest in zip(joints, rms[:-1], worst, strict=True):
        figures = (error, graded(joint.relative_rms), f"{joint.r2:.4f}", largest, f"{joint.worst_at:.2f}")
        made.add_row(escape(joint.name), joint.unit, *figures)
    made.add_section()
    made.add_row("[bold]all joints[/bold]", "", rms[-1], graded(log.relative_rms), f"{log.r2:.4f}", "", "")
    return made


def _verdict(log: LogPrediction) -> RenderableType:
    from rich.text import Text

    from tauhat.report.grading import grade_of

    grade = grade_of(log.relative_rms)
    return Text.assemble(
        (grade.word, STYLES[grade.key]),
        f" ({grade.meaning}): {100 * log.relative_rms:.2f} % of the torque is not predicted.\n",
    )
