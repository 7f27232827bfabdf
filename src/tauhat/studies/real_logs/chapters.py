"""The story of the study: what was done, which pair the cases speak for, what did not end well, and every case."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from tauhat.studies.real_logs.charts import beside_the_reference, over_the_best
from tauhat.studies.real_logs.figures import Figures
from tauhat.studies.real_logs.standings import Standing
from tauhat.studies.real_logs.tables import case_table, lost_table, names_table, standings_table
from tauhat.studies.study import Chapter

DEFAULT = ("robust", "wls")
"""Model and estimator that `identify` takes where none is named."""


def chapters_of(figures: Figures) -> tuple[Chapter, ...]:
    """Return all chapters."""
    lost = [_what_was_lost(figures)] if figures.lost else []
    found = [_which_to_take(figures)] if figures.standings else []
    return (_what_was_done(figures), *found, *lost, _every_case(figures))


def summary_of(figures: Figures) -> str:
    """Return the answer in a few sentences."""
    cases = figures.unseen
    head = (
        f"{_counted(len(figures.models), 'model')} with {_counted(len(figures.estimators), 'estimator')} each on "
        f"{_counted(len(figures.cases), 'case')} of real logs; {len(cases)} of them are judged on rows that were not "
        "fitted, and only these are counted."
    )
    return " ".join([head, *_default_words(figures), _lost_words(figures)])


def _what_was_done(figures: Figures) -> Chapter:
    fitted = (
        "Each case names logs that are fitted and logs that are judged, recorded on a real robot. Every model is "
        "fitted with every estimator in its default settings, and predicts the torque of the judged logs. The error is "
        "norm(measured - predicted torque) / norm(measured torque), all joints stacked, both through the low-pass of "
        "the case; of several judged logs the mean is taken. Moving: the same over the rows in which the robot moves."
    )
    ended = (
        "A fit ended well when it raised no error, its method did not call its own end a bad one (diverged, not "
        "settled, no solution), and its error is below 100 %. Passes is how often the problem was solved. Time is of a "
        "processor core for a whole identification: choice of filters, of terms where the model is auto, and the fit."
    )
    real = (
        "There is no true parameter here. What is judged is prediction: of another log of the same robot, or another "
        "part of the same log. Whether a method is right about its error bars is for the study on simulated robots."
    )
    return Chapter(title="What was done", text=(fitted, ended, real), tables=(names_table(figures),))


def _which_to_take(figures: Figures) -> Chapter:
    rule = (
        "The rule: of the pairs of model and estimator that ended well on every unseen case, take the one that is "
        "within 2 % of the best most often; between equals the one whose error is the smaller multiple of the best on "
        "average."
    )
    text = (rule, *_default_words(figures), *_by_estimator(figures), *_what_matters(figures), *_limits(figures))
    charts = (beside_the_reference(figures), *(over_the_best(figures, model) for model in figures.models))
    return Chapter(title="Which to take", text=text, tables=(standings_table(figures),), charts=charts)


def _default_words(figures: Figures) -> list[str]:
    """Return the pair that the rule takes, and how the default of `identify` stands beside it."""
    taken = figures.recommended
    if taken is None:
        return ["No pair of model and estimator ended well on every unseen case."]
    words = [f"By the rule the default is {_named(taken)}: {_standing_words(taken)}."]
    present = figures.standing_of(DEFAULT)
    if present is not None and present.pair != taken.pair:
        words.append(f"What identify takes where nothing is asked for, {_named(present)}: {_standing_words(present)}.")
    if present is not None and present.pair == taken.pair:
        words.append("That is what identify takes where nothing is asked for.")
    return words


def _named(row: Standing) -> str:
    return f"{row.model} with {row.estimator}"


def _standing_words(row: Standing) -> str:
    if not row.ended:
        return f"it ended well on none of {row.cases} cases"
    worst = f", at worst {row.worst:.2f} times as far off ({row.worst_case})" if row.worst > 1.005 else ""
    return (
        f"within 2 % of the best on {row.close} of {row.cases} cases, the best on {row.best}, median error "
        f"{100.0 * row.median:.3g} %{worst}"
    )


def _by_estimator(figures: Figures) -> list[str]:
    """Return, model by model, the estimators and on how many cases each is within 2 % of the best."""
    words = []
    for model in figures.models:
        rows = sorted((row for row in figures.standings if row.model == model), key=lambda row: -row.close)
        counts = ", ".join(f"{row.estimator} {row.close} (best on {row.best})" for row in rows)
        words.append(f"Within 2 % of the best with the model {model}, of {rows[0].cases} cases: {counts}.")
    return words


def _what_matters(figures: Figures) -> list[str]:
    """Return whether the choice of model or that of estimator makes the larger difference, and how firm the rule is."""
    estimators, models = figures.spread_over_estimators(), figures.spread_over_models()
    words = []
    if np.isfinite(estimators):
        words.append(
            f"With one model, the largest error of all estimators that ended well is {estimators:.2f} times the least "
            "(median over the cases)."
        )
    if np.isfinite(models):
        words.append(f"With one estimator, that of all models is {models:.2f} times the least.")
    without = figures.taken_without_one()
    counts = ", ".join(f"{model} with {estimator} {_times(times)}" for (model, estimator), times in without.items())
    firm = [f"Leaving out one case after the other, the rule takes {counts}."] if without else []
    return [*([" ".join(words)] if words else []), *firm]


def _limits(figures: Figures) -> list[str]:
    undecided, above = figures.undecided(), figures.above_reference()
    words = []
    if undecided:
        words.append(f"On {_listed(undecided)} all are within 2 %: that tells nothing of methods.")
    if above:
        words.append(f"None is as good as the reference on {_listed(above)}.")
    return words


def _what_was_lost(figures: Figures) -> Chapter:
    table = lost_table(figures)
    return Chapter(
        title="What was refused or ended badly", text=(_lost_words(figures),), tables=(table,) if table else ()
    )


def _lost_words(figures: Figures) -> str:
    if not figures.lost:
        return f"All {len(figures.fits)} fits ended well."
    each = len(figures.fits) // len(figures.estimators)
    counts = Counter(fit.outcome.estimator for fit in figures.lost)
    listed = ", ".join(f"{key} {count} of {each}" for key, count in counts.most_common())
    return f"{len(figures.lost)} of {len(figures.fits)} fits did not end well: {listed}."


def _every_case(figures: Figures) -> Chapter:
    text = ("Error over torque in per cent: of the judged logs, of their rows in motion, and of the fitted logs.",)
    return Chapter(title="Every case", text=text, tables=tuple(case_table(figures, case) for case in figures.cases))


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"


def _counted(count: int, name: str) -> str:
    return f"{count} {name}" if count == 1 else f"{count} {name}s"


def _listed(values: Sequence[str]) -> str:
    return values[0] if len(values) == 1 else f"{', '.join(values[:-1])} and {values[-1]}"
