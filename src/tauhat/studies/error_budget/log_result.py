"""The error budget of real logs as tables and a drawing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from tauhat.estimation.estimate import Estimate
from tauhat.studies.study import Cell, Chapter, Chart, Series, StudyResult, Table
from tauhat.verification.error_budget import LogBudget, LogShare


class _Part(NamedTuple):
    """A part of a squared residual; no standard error where none is known."""

    name: str
    share: float
    standard_error: float
    joints: str
    advice: str


def log_budget_result(estimate: Estimate, budgets: Sequence[LogBudget]) -> StudyResult:
    """Return the page of the budgets of logs that an estimate was held against."""
    chapters = [chapter for budget in budgets for chapter in (_ranked(budget), _to_do(budget))]
    return StudyResult(
        name="error-budget",
        title=f"Error budget: {estimate.robot.name}",
        summary=" ".join(_sentence(budget) for budget in budgets),
        chapters=(*chapters, _meaning()),
        settings={
            "robot": estimate.robot.name,
            "terms": [term.key for term in estimate.model.terms],
            "cutoff": estimate.processing.cutoff,
            "logs": [budget.log for budget in budgets],
        },
    )


def _parts(budget: LogBudget) -> list[_Part]:
    """Return every part, the largest first."""
    parts = [
        _Part(share.effect, share.share, share.standard_error, _joints(share), _sentence_of(share.advice))
        for share in budget.missing
    ]
    if budget.source == "periods":
        noise, rest = "noise: what does not repeat", "repeats, but has no name"
        quiet = "No model can predict it; average periods before identifying."
        unknown = "Model error of a kind that the catalogue of effects does not have."
    else:
        noise, rest = "white noise of the torque", "has no name"
        quiet = "No model can predict it. This is the least that noise makes: a repeated motion and --period tell all."
        unknown = "Coloured noise, or model error of a kind that the catalogue of effects does not have."
    unsure = "Noise and the motion of the fitted logs leave them so: identify from more logs, or a motion of excite."
    others = (
        "They are others on this log than in the fit, or were bent to make up for an effect: add terms that are named "
        "here and identify again, from logs at the temperature and with the payload of the task."
    )
    parts += [
        _Part(noise, budget.noise, 0.0, "", quiet),
        _Part("uncertain parameters", budget.uncertain, 0.0, "", unsure),
        _Part("parameters that are others here", budget.refitted, 0.0, "", others),
        _Part(rest, budget.unnamed, 0.0, "", unknown),
    ]
    return sorted(parts, key=lambda part: -part.share)


def _sentence(budget: LogBudget) -> str:
    first = _parts(budget)[0]
    return (
        f"{budget.log}: the model is off by {100 * budget.relative_rms:.3g} %. Largest part: {first.name}, "
        f"{100 * first.share:.0f} % of the squared residual. {first.advice}"
    )


def _ranked(budget: LogBudget) -> Chapter:
    parts = _parts(budget)
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (place, part.name, _percent(part.share), _percent(part.standard_error) if part.standard_error else "")
        for place, part in enumerate(parts, start=1)
    )
    compared = f"Noise from {budget.periods} periods. " if budget.periods else ""
    ranked = Table(
        title=f"{budget.log}: parts of the residual, the largest first",
        header=("", "part", "share [%]", "standard error [%]"),
        rows=rows,
        note=f"{compared}Residual over torque: {100 * budget.relative_rms:.3g} %.",
    )
    changed = (_changed(budget),) if budget.changed else ()
    return Chapter(
        title=budget.log, text=(), tables=(ranked, _of_joints(budget), *changed), charts=(_chart(budget, parts),)
    )


def _of_joints(budget: LogBudget) -> Table:
    return Table(
        title="Where the residual is",
        header=("joint", "share [%]"),
        rows=tuple((name, _percent(share)) for name, share in budget.joints),
        note="Of the squared residual, all joints stacked: joints with large torques count most.",
    )


def _changed(budget: LogBudget) -> Table:
    return Table(
        title="Parameters that are others than in the fit",
        header=("what", "share [%]", "on joints"),
        rows=tuple((share.effect, _percent(share.share), _joints(share)) for share in budget.changed),
        note="What refitting these parameters on this log would remove. These shares overlap with one another and with "
        "the parts above. Behind a joint: share of its own squared residual.",
    )


def _chart(budget: LogBudget, parts: Sequence[_Part]) -> Chart:
    series = Series(
        name=budget.log,
        x=tuple(part.name for part in parts),
        y=tuple(100.0 * part.share for part in parts),
        low=tuple(100.0 * (part.share - part.standard_error) for part in parts),
        high=tuple(100.0 * (part.share + part.standard_error) for part in parts),
    )
    return Chart(
        title="Parts of the residual",
        kind="bars",
        x_title="part",
        y_title="share of the squared residual [%]",
        series=(series,),
        note="Error bars: one standard error.",
    )


def _to_do(budget: LogBudget) -> Chapter:
    text = [
        f"{part.name[:1].upper()}{part.name[1:]} ({100 * part.share:.0f} %"
        f"{f'; on {part.joints}' if part.joints else ''}): {part.advice}"
        for part in _parts(budget)
    ]
    text += [f"{_sentence_of(share.effect)} {_sentence_of(share.advice)}" for share in budget.changed]
    return Chapter(title=f"What to do about {budget.log}", text=tuple(text))


def _meaning() -> Chapter:
    shares = (
        "An effect's share is what it removes of the squared residual on stretches of the log on which it was not "
        "fitted, beside the model's own parameters, refitted, and the effects before it. Noise is the variance of the "
        "residual from period to period, less named effects that change over time; without a period only the white "
        "part of the torque's noise is known, and what drives filter before they log is not even in that. Uncertain "
        "parameters: what refitting them removes, as far as their error bars let expect; beyond that, they are others "
        "here."
    )
    unseen = "Factors of the torque that are wrong in all logs alike show in no residual: see calibrate-drives."
    return Chapter(title="What it means", text=(shares, unseen))


def _joints(share: LogShare) -> str:
    return ", ".join(f"{name} {100 * own:.0f} %" for name, own in share.joints)


def _sentence_of(text: str) -> str:
    sentence = (text[:1].upper() + text[1:]).replace("`", "")
    return sentence if sentence.endswith((".", "?", "!")) else f"{sentence}."


def _percent(part: float) -> float:
    """Return a share in percent to a tenth; what is smaller says nothing."""
    return round(100.0 * part, 1) + 0.0  # no minus before a zero
