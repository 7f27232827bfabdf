"""The story of the study: what was done, family by family, and which estimators are to be trusted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tauhat.studies.monte_carlo.charts import error_over_cost, error_over_noise, error_over_rate
from tauhat.studies.monte_carlo.families import FAMILIES, OTHERS
from tauhat.studies.monte_carlo.figures import Figures
from tauhat.studies.monte_carlo.standings import HONEST, WITHIN, Standing
from tauhat.studies.monte_carlo.tables import every_cell, lost_fits, situations, standings
from tauhat.studies.study import Chapter, Table

_FAMILY_WORDS: Mapping[str, str] = {
    "Least squares": (
        "They take the filtered motion for exact and differ in how they weigh joints and rows. All of them share the "
        "same filtered rows here. None of these logs has outliers or noise that joints share, which some of them are "
        "made for; prior pulls to the described robot, from which the simulated ones are only about 10 % off."
    ),
    "With a simulated robot": (
        "They simulate the closed loop with the parameters they try. Law, gains, reference and control rate are those "
        "of the simulated robot, known exactly: the best case for them. Their integrator is the library's own, with "
        "ten times the plant's step."
    ),
    "Kalman filters": (
        "They begin with weighted least squares on the first 30 % of the log and filter the rest; parameter-kalman "
        "filters parameters alone, the others the robot's state, too, with positions every 20 ms."
    ),
    OTHERS: (
        "Recursions that could run while the robot moves, and friction first, the rest afterwards. They use the "
        "settings that they have by default."
    ),
}


def chapters_of(figures: Figures) -> tuple[Chapter, ...]:
    """Return all chapters; a family of which nothing was fitted has none."""
    families = [(name, keys) for name in FAMILIES if (keys := figures.estimators_of(name))]
    return (_what_was_done(figures), *(_family(figures, name, keys) for name, keys in families), _trust(figures))


def _what_was_done(figures: Figures) -> Chapter:
    study = figures.study
    done = (
        f"Each seed is a robot whose masses, centres of mass, inertias, rotors and friction are about 10 % off the "
        f"described ones, and a random motion of {study.seconds:g} s within the limits of the joints. A MuJoCo plant "
        "with a step of 0.1 ms follows it under a PD law with gravity feedforward, sampled at 2000 Hz."
    )
    noise = (
        f"Its log is thinned to {_listed(study.rates)} Hz and gets white noise: at level 1 a standard deviation of "
        f"{study.position_noise:g} rad on positions and {100 * study.torque_noise:g} % of each joint's root mean "
        f"square on torques; the levels are {_listed(study.noises)}. Levels and rates see the same robots and motions."
    )
    fitted = (
        "Filters are chosen from each log as identify chooses them, once for all estimators; the model has the true "
        "shape of friction, so that a fit can be exactly right. Fits have the default settings."
    )
    judged = (
        "Judged are: the relative error of the base parameters, |s (x - x*)| / |s x*|, where s is what a unit of each "
        "parameter does to the torques along the unseen motion, each joint in parts of its own torque; the error of "
        "the torque, without noise, on another random motion, all joints stacked; the share of 95 % intervals that "
        "hold the true value; passes; and processor time without reading and filtering the log, which all share. A fit "
        "ended well when it raised no error, the method itself did not call its end a bad one (diverged, not settled), "
        f"and its torque is at most {100 * study.usable:g} % off."
    )
    source = "The plan follows Leboutet et al., Inertial parameter identification in robotics: a survey, 2021."
    return Chapter(title="What was done", text=(done, noise, fitted, judged, source), tables=(situations(figures),))


def _family(figures: Figures, name: str, keys: Sequence[str]) -> Chapter:
    robots = figures.study.robots
    beside = keys if figures.reference in keys else (figures.reference, *keys)
    lost = lost_fits(figures, keys)
    several = len(figures.study.rates) > 1
    charts = [error_over_noise(figures, robot, beside) for robot in robots]
    return Chapter(
        title=name,
        text=(_FAMILY_WORDS[name], _found(figures, keys)),
        tables=(*(every_cell(figures, robot, keys) for robot in robots), *([lost] if lost else [])),
        charts=(*charts, *(error_over_rate(figures, robot, beside) for robot in robots if several)),
    )


def _found(figures: Figures, keys: Sequence[str]) -> str:
    """Return what the figures say of a family."""
    rows = [figures.standing_of(key) for key in keys]
    parts = []
    for place, level in enumerate(figures.study.noises):
        known = [row for row in rows if np.isfinite(row.ratios[place])]
        if known:
            best = min(known, key=lambda row: row.ratios[place])
            parts.append(f"at noise {level:g} {best.estimator} ({best.ratios[place]:.2f})")
    ended = float(np.mean([row.ended for row in rows]))
    least = f"The least error of the torque, over that of {figures.reference}: {', '.join(parts)}." if parts else ""
    return f"{least} {100 * ended:.3g} % of the fits ended well.".strip()


def _trust(figures: Figures) -> Chapter:
    rule = (
        "An estimator is trusted here when every fit ended well, its mean error of the torque is at most "
        f"{WITHIN:g} times that of {figures.reference}, and at least {100 * HONEST:g} % of its 95 % intervals hold the "
        "truth."
    )
    limits = (
        "What this cannot tell: noise is white, the model has the true terms, and the law is known. On a real robot "
        "outliers, friction that no term describes and an unknown controller decide, and the order may be another."
    )
    several = len(figures.study.rates) > 1
    charts = tuple(error_over_cost(figures, robot) for robot in figures.study.robots) if several else ()
    tables: tuple[Table, ...] = (standings(figures),)
    return Chapter(
        title="Which to trust", text=(rule, summary_of(figures), limits), tables=tables, charts=charts
    )  # fmt: skip


def summary_of(figures: Figures) -> str:
    """Return the answer in a few sentences."""
    study, rows = figures.study, figures.standings
    trusted = [row for row in rows if row.trusted]
    head = (
        f"{len(rows)} estimators, {len(figures.fits)} fits on {_listed(study.robots)}, noise {_listed(study.noises)}, "
        f"{_listed(study.rates)} Hz."
    )
    return " ".join([head, *_extremes(figures), _trusted_words(trusted), _lost_words(rows)]).strip()


def _extremes(figures: Figures) -> list[str]:
    """Return which estimator has the least error at the least and at the most noise."""
    noises, words = figures.study.noises, []
    for level in dict.fromkeys((min(noises), max(noises))):
        place = noises.index(level)
        known = [row for row in figures.standings if np.isfinite(row.ratios[place])]
        if known:
            best = min(known, key=lambda row: row.ratios[place])
            own = best.estimator == figures.reference
            beside = "" if own else f", {best.ratios[place]:.2f} times that of {figures.reference}"
            words.append(f"At noise {level:g} {best.estimator} has the least error{beside}.")
    return words


def _trusted_words(trusted: Sequence[Standing]) -> str:
    if not trusted:
        return "None is to be trusted by these rules."
    quick = min(trusted, key=lambda row: row.seconds)
    names = _listed([row.estimator for row in trusted])
    return f"To be trusted here: {names}; the quickest of them is {quick.estimator} with {quick.seconds:.2g} s a fit."


def _lost_words(rows: Sequence[Standing]) -> str:
    lost = sorted((row for row in rows if row.ended < 1.0), key=lambda row: row.ended)
    if not lost:
        return "Every fit ended well."
    return "Not every fit ended well: " + ", ".join(f"{row.estimator} {100 * row.ended:.0f} %" for row in lost) + "."


def _listed(values: Sequence[str | float]) -> str:
    words = [value if isinstance(value, str) else f"{value:g}" for value in values]
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
