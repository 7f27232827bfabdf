"""An estimate in two tables of its joints and a few sentences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from tauhat.cli.views.tables import aligned, graded, table

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tauhat.estimation.estimate import Estimate, ParameterRow

_WELL_KNOWN = 0.1  # relative standard error below which a parameter is called well known
_DRIVE = ("Fc", "Fv", "To")


def estimate_view(estimate: Estimate) -> Iterator[RenderableType]:
    """Yield the fit joint by joint, what drives the joints, and how far the parameters can be trusted."""
    yield _fit_table(estimate)
    rows = {row.name: row for row in estimate.summary()}
    symbols = [symbol for symbol in _DRIVE if f"{symbol}_1" in rows]
    if symbols:
        yield _drive_table(estimate, rows, symbols)
    yield _sentences(estimate)


def _fit_table(estimate: Estimate) -> RenderableType:
    from rich.markup import escape

    made = table(f"Fit of {estimate.robot.name}", ("joint", "unit"), ("torque rms", "residual rms", "of torque"))
    torques, residuals = estimate.torque_rms.tolist(), estimate.joint_rms.tolist()
    figures = zip(aligned(torques), aligned(residuals), residuals, torques, strict=True)
    for joint, (torque, residual, part, whole) in zip(estimate.robot.joints, figures, strict=True):
        made.add_row(
            escape(joint.name), joint.effort_unit, torque, residual, graded(part / whole if whole else float("inf"))
        )
    made.add_section()
    made.add_row("[bold]all joints[/bold]", "", "", "", graded(estimate.relative_rms))
    return made


def _drive_table(estimate: Estimate, rows: dict[str, ParameterRow], symbols: Sequence[str]) -> RenderableType:
    from rich.markup import escape

    joints = range(1, estimate.robot.n_v + 1)
    headers, columns = [], []
    for symbol in symbols:
        own = [rows[f"{symbol}_{joint}"] for joint in joints]
        errors = [row.standard_error for row in own]
        units = " or ".join(dict.fromkeys(row.unit for row in own))
        headers += [f"{symbol}\n[{units}]", "± se\n"]
        columns += [aligned([row.value for row in own], like=errors), aligned(errors)]
    made = table("Friction (Coulomb, viscous) and offset with standard errors", ("joint",), tuple(headers))
    for joint, *figures in zip(estimate.robot.joints, *columns, strict=True):
        made.add_row(escape(joint.name), *figures)
    return made


def _sentences(estimate: Estimate) -> RenderableType:
    from rich.text import Text

    from tauhat.report.grading import condition_grade

    n_b, processing, inputs = estimate.base.n_b, estimate.processing, estimate.inputs
    known = sum(row.relative < _WELL_KNOWN for row in estimate.summary())
    grade = condition_grade(estimate.condition, full_rank=estimate.rank >= n_b)
    delay = f", position taken as {processing.delay * 1e3:.3g} ms late" if processing.delay else ""
    logs = "one recording" if len(inputs) == 1 else f"{len(inputs)} recordings"
    return Text(
        f"From {logs} of {sum(log.seconds for log in inputs):.1f} s; low-pass {processing.cutoff:.3g} Hz, "
        f"of the motion {processing.motion_cutoff:.3g} Hz; velocity from the measured {processing.velocity}{delay}.\n"
        f"{estimate.rank} of {n_b} base parameters determined, {known} of them to better than "
        f"{100 * _WELL_KNOWN:.0f} % (standard error).\n"
        f"Scaled condition number {estimate.condition:.3g}: {grade.meaning}.\n"
    )
