"""What was sensed along a log, as tables and a sentence on what was left out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from tauhat.cli.output import counted
from tauhat.cli.views.tables import aligned, table

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tauhat.cli.contact_choice import Source
    from tauhat.sensing.judged_log import JudgedLog

_ERRORS = {
    "fit": "of the model's fit; --free LOG learns that of the work.",
    "free motion": "learnt on the free motion.",
    "thresholds": "those that the thresholds file has learnt on free motion.",
}
_UNITS = ("N", "N", "N", "Nm", "Nm", "Nm")


def sensing_view(judged: JudgedLog) -> Iterator[RenderableType]:
    """Yield external torque and wrench with their typical error bars, and what became of the samples."""
    from rich.text import Text

    from tauhat.report.contact_words import hidden_words, zero_words

    log = judged.sensed
    data = log.to_dict()
    units = ["N" if name in log.prismatic else "Nm" for name in log.joint_names]
    yield _sizes(f"{log.name}: external torque", data["joints"], units, "joint", {})
    asked = [(part, unit) for part, unit, seen in zip(data["wrench"], _UNITS, log.solved, strict=True) if seen]
    where = f"Wrench at {log.frame}, axes of the {log.axes}"
    hidden = [f"{100.0 * part:.1f}" for part, seen in zip(judged.hidden.parts, log.solved, strict=True) if seen]
    more = {"hidden %": hidden} if judged.hidden.share else {}
    yield _sizes(where, [part for part, _ in asked], [unit for _, unit in asked], "component", more)
    for words in filter(None, (zero_words(judged), hidden_words(judged.hidden))):
        yield Text(words + "\n")
    yield _sentence(judged)


def error_view(source: Source) -> RenderableType:
    """Return where the error bars come from."""
    from rich.text import Text

    return Text(f"Error bars: {_ERRORS[source]}")


def _sizes(
    title: str, parts: list[dict[str, float]], units: list[str], what: str, more: Mapping[str, list[str]]
) -> RenderableType:
    """Return a table of sizes; `more` holds further columns by their headings."""
    from rich.markup import escape

    made = table(title, (what, "unit"), ("rms", "peak", "± there", "usually ±", *more))
    sizes = [part["std"] for part in parts]
    columns = [aligned([part[key] for part in parts], like=sizes) for key in ("rms", "peak", "peak_std", "std")]
    for part, unit, *figures in zip(parts, units, *columns, *more.values(), strict=True):
        made.add_row(escape(str(part["name"])), unit, *figures)
    return made


def _sentence(judged: JudgedLog) -> RenderableType:
    from rich.text import Text

    log = judged.sensed
    counts, untold = log.counts, "behind starts or off the pass in air" if judged.air else "behind starts"
    skipped = {"late": counts.late, "repeated": counts.repeated, "not finite": counts.not_finite}
    frozen = f" Frozen, as of a controller that hangs: {counts.frozen}." if counts.frozen else ""
    return Text(
        f"{log.n_t} samples at {1.0 / log.step:.6g} Hz; skipped: {counted(skipped)}; "
        f"started again {counts.restarts} times.{frozen}\n"
        f"± is one standard error. {log.n_t - int(log.settled.sum())} samples {untold} are not in the tables.\n"
    )
