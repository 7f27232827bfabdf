"""The chapters of an error budget: ranked causes, what to do, how causes work together, what was done."""

from __future__ import annotations

from tauhat.studies.doubts import doubts_chapter
from tauhat.studies.study import Chapter, Chart, Series, Table
from tauhat.verification.error_budget import WORTH, BudgetSettings, ErrorBudget

_SHARE = "share of the squared error [%]"


def summary_of(settings: BudgetSettings, budget: ErrorBudget) -> str:
    """Return the answer in a few sentences."""
    first, name = budget.shares[0], settings.experiment.robot.name
    solved = sum(not robot.failure for robot in budget.robots)
    size = (
        f"{name}: the torque of an unseen motion is off by {_percent(budget.error)} % (median of {solved} robots), and "
        f"a log of it shows {_percent(budget.on_log)} %."
    )
    cause = (
        f"Largest cause: {first.title}, {100 * first.share:.0f} % of the squared error; without it the model is off by "
        f"{_percent(first.error_without)} %."
    )
    words = [size, cause, first.advice] if first.worth else [size]
    failed = len(budget.robots) - solved
    if failed:
        words.append(f"{failed} of {len(budget.robots)} robots gave no model in one of their cases and are left out.")
    return " ".join(words)


def chapters_of(settings: BudgetSettings, budget: ErrorBudget) -> tuple[Chapter, ...]:
    """Return all chapters."""
    doubts = doubts_chapter(
        (robot.failure for robot in budget.robots),
        (doubt for robot in budget.robots for doubt in robot.doubts),
        of="robots",
    )
    return (_ranked(budget), _to_do(budget), _together(budget), *((doubts,) if doubts else ()), _done(settings, budget))


def _ranked(budget: ErrorBudget) -> Chapter:
    rule = (
        "Squared error of the predicted torque, in parts of the torque's square: against the true torque along the "
        "true motion (of the model), and against a log as tauhat verify shows it (on the log), while the robot moves. "
        "A share is the mean of what goes when only this cause is switched off and what comes when it is the only one. "
        "A cause that works by magnifying others, such as a short motion, shares with them. Below zero: it hides part "
        "of another one."
    )
    rows = tuple(
        (
            place, share.title, _share(share.share), _share(share.low), _share(share.high), 100.0 * share.error_without,
            _share(share.on_log),
        )
        for place, share in enumerate(budget.shares, start=1)
    )  # fmt: skip
    left = (
        ("", "left without any cause", _share(budget.floor), "", "", "", _share(budget.log_floor)),
        ("", "of three or more causes together", _share(budget.rest), "", "", "", _share(budget.log_rest)),
    )
    table = Table(
        title="Causes, the largest first",
        header=(
            *("", "cause", "of the model [%]", "a tenth below [%]", "nine tenths below [%]"),
            *("error without it [%]", "on the log [%]"),
        ),
        rows=(*rows, *left),
        note=f"Error with every cause: {_percent(budget.error)} %, on the log {_percent(budget.on_log)} %; medians. "
        "Shares: means over the robots, and what a tenth and nine tenths of them stay below.",
    )
    return Chapter(title="Causes", text=(rule,), tables=(table,), charts=(_chart(budget),))


def _chart(budget: ErrorBudget) -> Chart:
    titles = tuple(share.title for share in budget.shares)
    fields = {
        "of the model": ("share", "low", "high"),
        "on the log": ("on_log", "log_low", "log_high"),
    }
    series = [
        Series(
            name=name,
            x=titles,
            y=tuple(100.0 * getattr(share, value) for share in budget.shares),
            low=tuple(100.0 * getattr(share, low) for share in budget.shares),
            high=tuple(100.0 * getattr(share, high) for share in budget.shares),
        )
        for name, (value, low, high) in fields.items()
    ]
    return Chart(
        title="Causes of the error",
        kind="bars",
        x_title="cause",
        y_title=_SHARE,
        series=tuple(series),
        note="Bars that are high of the model and low on the log are errors that no log can show; the other way round, "
        "the log is worse than the model.",
    )


def _to_do(budget: ErrorBudget) -> Chapter:
    worth = [share for share in budget.shares if share.worth]
    text = [
        f"{share.title[:1].upper()}{share.title[1:]} ({100 * share.share:.0f} %): {share.advice}" for share in worth
    ]
    others = [share.title for share in budget.shares if not share.worth]
    if others:
        text.append(f"Leave alone what makes less than {100 * WORTH:g} % of either error: {', '.join(others)}.")
    return Chapter(title="What to do", text=tuple(text))


def _together(budget: ErrorBudget) -> Chapter:
    rows = tuple(
        (share.title, _share(share.alone), _share(share.removed), _share(share.removed - share.alone))
        for share in budget.shares
    )
    table = Table(
        title="Alone and among the others",
        header=("cause", "adds alone [%]", "takes with it [%]", "with others [%]"),
        rows=rows,
        note="Adds alone: as the only cause there is. Takes with it: when only this one is switched off. The "
        "difference is what it does together with others.",
    )
    return Chapter(title="Alone and together", text=(), tables=(table,))


def _done(settings: BudgetSettings, budget: ErrorBudget) -> Chapter:
    experiment = settings.experiment
    cases = 2 * len(budget.shares) + 2
    robots = (
        f"{settings.seeds} true robots of {experiment.robot.name}: parameters {100 * experiment.spread:g} % about the "
        f"description, friction of the kind {experiment.friction}, {experiment.sensors} sensors. Each was identified "
        f"{cases} times from {settings.motions.fitted.duration:.3g} s of motion with the {settings.terms} model by "
        f"{settings.estimator}: with every cause, with none, with each one off, and with each one alone. All cases of "
        "a robot have the same truth, the same sensors, the same noise and the same low-pass."
    )
    meaning = (
        "Switched off means: sensors without that error; plain friction, no heat, rigid joints in the plant; the true "
        "velocity instead of filtered positions; for length and conditioning, a second, designed motion of the same "
        "length that is identified from as well."
    )
    judged = (
        f"Judged on {settings.motions.unseen.duration:.3g} s of motion from pose to pose that was not fitted, with "
        f"joints {settings.warmer:+g} K from where they were, where the experiment has heat."
    )
    missing = f"Not in this experiment: {', '.join(budget.absent)}." if budget.absent else ""
    limits = (
        "What it cannot tell: whatever the rehearsed experiment does not have. On a real log, see the residual tests."
    )
    text = tuple(words for words in (robots, meaning, judged, missing, limits) if words)
    return Chapter(title="What was done", text=text)


def _percent(fraction: float) -> str:
    return f"{100.0 * fraction:.3g}"


def _share(part: float) -> float:
    """Return a share in percent to a tenth; what is smaller says nothing."""
    return round(100.0 * part, 1) + 0.0  # no minus before a zero
