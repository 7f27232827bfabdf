"""How good a prediction error is, in words."""

from __future__ import annotations

from typing import NamedTuple

from tauhat.estimation.identify import DOUBTFUL_CONDITION

GOOD_CONDITION = 100.0


class Grade(NamedTuple):
    """A word for a range of relative errors; `below` is its upper end, `key` its style in the page."""

    key: str
    word: str
    below: float
    meaning: str


GRADES = (
    Grade("best", "very good", 0.05, "feedforward and sensorless contact forces"),
    Grade("good", "good", 0.10, "feedforward and collision detection"),
    Grade("fair", "fair", 0.20, "the large effects are right; friction or a weak motion leaves its mark"),
    Grade("poor", "poor", float("inf"), "an effect is missing, or a unit, sign or delay of the log is wrong"),
)


def grade_of(relative_rms: float) -> Grade:
    """Return the grade of a relative error; what is not a number is poor."""
    return next((grade for grade in GRADES if relative_rms < grade.below), GRADES[-1])


def condition_grade(condition: float, *, full_rank: bool) -> Grade:
    """Return what a scaled condition number says about the motion that was recorded."""
    if not full_rank:
        return Grade("poor", "rank lost", float("inf"), "some parameters cannot be told apart at all with this motion")
    if condition < GOOD_CONDITION:
        return Grade("good", "good", GOOD_CONDITION, "the motion tells all parameters well apart")
    if condition < DOUBTFUL_CONDITION:
        return Grade(
            "fair", "fair", DOUBTFUL_CONDITION, "some parameters are told apart weakly; look at their error bars"
        )
    return Grade(
        "poor",
        "doubtful",
        float("inf"),
        "the model fits this motion and may be far off on another; record a richer motion",
    )
