"""What is missing in a model, static torque and a known payload, as tables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from tauhat.cli.views.tables import STYLES, aligned, table

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tauhat.verification.joint_search import Effect
    from tauhat.verification.known_payload import PayloadCheck
    from tauhat.verification.residual_tests import LogResiduals
    from tauhat.verification.static import StaticCheck


def residuals_view(logs: Sequence[LogResiduals]) -> Iterator[RenderableType]:
    """Yield for each log what its residuals hold, strongest first, and how white they are."""
    from rich.text import Text

    for log in logs:
        yield _whiteness_table(log)
        if log.ranked:
            yield _effects_table(log)
            yield Text("".join(f"{line}\n" for line in dict.fromkeys(_advice(effect) for _, effect in log.ranked)))
        else:
            yield Text(f"{log.log}: {log.silence}\n")


def _advice(effect: Effect) -> str:
    return f"{effect.effect}: {effect.advice}."


def _whiteness_table(log: LogResiduals) -> RenderableType:
    from rich.markup import escape

    figures = ("rms residual", "rows", "independent", "memory [s]", "colour")
    made = table(f"{log.log}: residuals; colour 0 is white noise", ("joint", "unit"), figures)
    rms = aligned([joint.rms for joint in log.joints])
    for joint, text in zip(log.joints, rms, strict=True):
        white = joint.whiteness
        made.add_row(
            escape(joint.name), joint.unit, text, str(joint.rows), f"{white.effective:.0f}",
            f"{white.correlation_time:.2f}", f"{white.colour:.2f}",
        )  # fmt: skip
    return made


def _effects_table(log: LogResiduals) -> RenderableType:
    from rich.markup import escape

    made = table(
        f"{log.log}: what the residuals hold", ("joint", "effect", "term"), ("of the residual", "±")
    )  # fmt: skip
    for name, effect in log.ranked:
        order = f", {effect.order:g} a revolution" if effect.order else ""
        others = f" (or {', '.join(effect.alternatives)})" if effect.alternatives else ""
        made.add_row(
            escape(name), f"{effect.effect}{order}{others}", effect.term or "none",
            f"{100 * effect.share:.1f} %", f"{100 * effect.standard_error:.1f} %",
        )  # fmt: skip
    return made


def static_view(check: StaticCheck) -> Iterator[RenderableType]:
    """Yield gravity and friction of each joint beside the model's, then what was found."""
    from rich.markup import escape
    from rich.text import Text

    if check.pairs:
        figures = ("poses", "gravity rms", "less model", "± (95 %)", "friction", "of model", "± (95 %)")
        made = table("Poses reached from both sides", ("joint", "unit"), figures)
        for joint in (joint for joint in check.joints if joint.poses):
            gravity = aligned([joint.gravity_difference, joint.gravity_half], like=[joint.gravity_half])
            friction = aligned(
                [joint.friction, joint.model_friction, joint.friction_half], like=[joint.friction_half]
            )  # fmt: skip
            friction[0] = f"≥ {friction[0]}" if joint.held else friction[0]
            made.add_row(
                escape(joint.name), joint.unit, str(joint.poses), f"{joint.gravity_rms:.4g}", *gravity, *friction
            )  # fmt: skip
        yield made
    for finding in check.findings:
        advice = f"; {finding.advice}" if finding.advice else ""
        yield Text.assemble((finding.severity, STYLES[finding.severity]), f": {finding.message}{advice}")
    if not check.findings:
        yield Text("Gravity and friction of the model agree with the held poses.\n")


def payload_check_view(check: PayloadCheck) -> Iterator[RenderableType]:
    """Yield what was known of the payload beside what the model found."""
    from rich.text import Text

    made = table(
        f"Known payload on the link of {check.payload.link}",
        ("quantity", "unit"),
        ("known", "found", "± (95 %)", "inside"),
    )
    words = {True: "yes", False: "no", None: "not visible"}
    for number in check.numbers:
        found = "–" if number.found is None else f"{number.found:.4g}"
        half = "–" if number.half is None else f"{number.half:.2g}"
        made.add_row(number.quantity, number.unit, f"{number.known:.4g}", found, half, words[number.inside])
    yield made
    yield Text(
        f"Error of the torque: {100 * check.ignored:.2f} % without it, {100 * check.found:.2f} % with what was found.\n"
    )
