"""Tables of the study: every case, how the pairs stand, and what did not end well."""

from __future__ import annotations

import numpy as np

from tauhat.dynamics.model import MODELS
from tauhat.dynamics.named_model import AUTO
from tauhat.estimation.estimators import ESTIMATORS
from tauhat.studies.comparison import PHYSICAL
from tauhat.studies.real_logs.case_file import RealCase
from tauhat.studies.real_logs.figures import Figures
from tauhat.studies.real_logs.fitting import CaseFit
from tauhat.studies.study import Cell, Table

_AUTO_WORDS = "the terms of robust, more or fewer of them as cross-validation on the fitted logs says"
_REFUSED, _BAD = "refused", "bad end"


def names_table(figures: Figures) -> Table:
    """Return what the names of models and estimators stand for."""
    models = [("model", name, _model_words(name)) for name in figures.models]
    methods = [("estimator", key, (ESTIMATORS[key].__doc__ or "").partition("\n")[0]) for key in figures.estimators]
    return Table(title="Names", header=("", "name", "what it is"), rows=(*models, *methods))


def _model_words(name: str) -> str:
    terms = name.removesuffix(PHYSICAL)
    words = _AUTO_WORDS if terms == AUTO else ", ".join(MODELS.get(terms, ("as the file says",)))
    return words if terms == name else f"{words}; every link a possible body"


def case_table(figures: Figures, case: RealCase) -> Table:
    """Return the figures of every fit of one case."""
    judged = "judged [%]" if not case.unseen else "unseen [%]"
    return Table(
        title=case.name,
        header=("model", "estimator", judged, "moving [%]", "fitted [%]", "passes", "time [s]", "end"),
        rows=tuple(_case_row(fit) for fit in figures.of_case(case)),
        note=_case_note(case),
    )


def _case_row(fit: CaseFit) -> tuple[Cell, ...]:
    outcome = fit.outcome
    if outcome.failure:
        return (*fit.pair, np.nan, np.nan, np.nan, np.nan, np.nan, _REFUSED)
    moving = float(np.mean(outcome.moving))
    errors = (100.0 * fit.error, 100.0 * moving, 100.0 * outcome.fit)
    end = _BAD if fit.loss else outcome.cause.partition(";")[0].partition(":")[0]
    return (*fit.pair, *errors, outcome.passes, outcome.processor_seconds, end)


def _case_note(case: RealCase) -> str:
    fitted, judged = len(case.fit), len(case.judge)
    words = [
        f"{_logs(fitted)} fitted, {_logs(judged)} judged{', mean' if judged > 1 else ''}; low-pass {case.cutoff:g} Hz."
    ]
    if not case.unseen:
        words.append("The judged rows are the fitted ones: this case is shown, not counted.")
    if case.reference:
        words.append(f"Reference, a plain baseline: {100.0 * float(np.mean(case.reference)):.3g} %.")
    if case.aim is not None:
        words.append(f"An experiment with the same scoring reached {100.0 * case.aim:.3g} %.")
    if case.waits:
        words.append(f"The model does not have: {case.waits}.")
    return " ".join(words)


def _logs(count: int) -> str:
    return "1 log" if count == 1 else f"{count} logs"


def standings_table(figures: Figures) -> Table:
    """Return how all pairs stand, the one to take first."""
    ordered = sorted(
        figures.standings,
        key=lambda row: (not row.everywhere, -row.ended, -row.close, row.ratio if np.isfinite(row.ratio) else np.inf),
    )
    return Table(
        title="All unseen cases",
        header=(
            *("model", "estimator", "ended well", "best", "within 2 %"),
            *("median [%]", "over the best", "at worst", "where", "time [s]"),
        ),
        rows=tuple(
            (
                *row.pair,
                f"{row.ended} of {row.cases}",
                row.best,
                row.close,
                100.0 * row.median,
                row.ratio,
                row.worst,
                row.worst_case,
                row.seconds,
            )
            for row in ordered
        ),
        note="Best, within 2 %: on how many cases the error is the least of all to 0.1 %, or at most 1.02 times "
        "that. Median: of the errors over the cases. Over the best, at worst: geometric mean and largest of the error "
        "over the least of the same case. Fits that did not end well count in no column but the time.",
    )


def lost_table(figures: Figures) -> Table | None:
    """Return the fits that did not end well with their reasons, alike ones in a row; None where all did."""
    groups: dict[tuple[str, str, str], list[str]] = {}
    for fit in figures.lost:
        groups.setdefault((fit.case, fit.outcome.estimator, fit.loss), []).append(fit.outcome.model)
    if not groups:
        return None
    return Table(
        title="Fits that did not end well",
        header=("case", "estimator", "models", "reason"),
        rows=tuple((case, key, ", ".join(models), reason) for (case, key, reason), models in groups.items()),
        note="In the words of the library. A fit with an error above 100 % of the torque is among them, whatever its "
        "method says.",
    )
