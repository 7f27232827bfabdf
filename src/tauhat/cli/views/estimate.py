"""An estimate in two tables of its joints and a few sentences."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from tauhat.cli.views.tables import aligned, graded, table

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tauhat.estimation.estimate import Estimate

_WELL_KNOWN = 0.1  # relative standard error below which a parameter is called well known
_SPEEDS = (0.05, 0.5)  # parts of the top speed that friction is shown at


def estimate_view(estimate: Estimate) -> Iterator[RenderableType]:
    """Yield the fit joint by joint, what drives the joints, and how far the parameters can be trusted."""
    yield _fit_table(estimate)
    if any(term.dissipates for term in estimate.model.terms):
        yield _friction_table(estimate)
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


def _friction_table(estimate: Estimate) -> RenderableType:
    """Return friction in steady motion at low and high speed: it means the same whatever terms make it."""
    import numpy as np
    from rich.markup import escape

    limits = np.where(np.isfinite(estimate.robot.velocity_limit), estimate.robot.velocity_limit, 1.0)
    limits = limits if estimate.top_speeds is None else estimate.top_speeds
    levels = [(part, estimate.friction(part * np.where(limits > 0, limits, 1.0))) for part in _SPEEDS]
    headers, columns = [], []
    for part, friction in levels:
        headers += [f"at {100 * part:.0f} %\nof top speed", "± se\n"]
        errors = friction.standard_errors.tolist()
        columns += [aligned(friction.torque.tolist(), like=errors), aligned(errors)]
    made = table("Friction in steady motion, with standard errors", ("joint", "unit"), tuple(headers))
    for joint, *figures in zip(estimate.robot.joints, *columns, strict=True):
        made.add_row(escape(joint.name), joint.effort_unit, *figures)
    return made


def _sentences(estimate: Estimate) -> RenderableType:
    from rich.text import Text

    lines = (_terms(estimate), _source(estimate), _method(estimate), _trust(estimate), _physics(estimate))
    return Text("".join(f"{line}\n" for line in lines if line))


def _terms(estimate: Estimate) -> str:
    terms = ", ".join(term.key for term in estimate.model.terms)
    chosen = f" ({estimate.structure.words})" if estimate.structure else ""
    return f"Terms: {terms}{chosen}."


def _source(estimate: Estimate) -> str:
    processing, inputs = estimate.processing, estimate.inputs
    delay = f", position taken as {processing.delay * 1e3:.3g} ms late" if processing.delay else ""
    logs = "one recording" if len(inputs) == 1 else f"{len(inputs)} recordings"
    return (
        f"From {logs} of {sum(log.seconds for log in inputs):.1f} s; low-pass {processing.cutoff:.3g} Hz, "
        f"of the motion {processing.motion_cutoff:.3g} Hz; velocity from the measured {processing.velocity}{delay}."
    )


def _method(estimate: Estimate) -> str:
    """Return why the method stopped and what it advises; nothing where there is nothing to say."""
    if estimate.cause == "solved" and not estimate.advice:
        return ""
    advice = f"; {estimate.advice}" if estimate.advice else ""
    return f"Method {estimate.estimator['name']}: {estimate.cause}{advice}."


def _trust(estimate: Estimate) -> str:
    from tauhat.report.grading import condition_grade

    n_b, fitted = estimate.base.n_b, estimate.n_fitted
    known = sum(row.standard_error > 0.0 and row.relative < _WELL_KNOWN for row in estimate.summary())
    instead = "are zero" if estimate.physical is None else "follow from the constraints"
    dropped = f"; the other {n_b - fitted} cannot be seen in the recordings and {instead}" if fitted < n_b else ""
    grade = condition_grade(estimate.condition, full_rank=estimate.rank >= fitted)
    return (
        f"{estimate.rank} of {n_b} base parameters determined, {known} of them to better than "
        f"{100 * _WELL_KNOWN:.0f} % (standard error){dropped}.\n"
        f"Scaled condition number {estimate.condition:.3g}: {grade.meaning}."
    )


def _physics(estimate: Estimate) -> str:
    if estimate.physical is None:
        return ""
    held = "; ".join(estimate.physical["binding"][:3]) or "nothing"
    return (
        f"Every link is a possible body, which costs {100 * estimate.physical['cost']:.2f} % of the residual; "
        f"held back most by {held}."
    )
