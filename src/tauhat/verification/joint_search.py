"""The search on one joint: every effect by itself, then the strongest, and what is left beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray, IntArray
from tauhat.dynamics.model import TERMS
from tauhat.verification.effects import Candidate, Dependence
from tauhat.verification.fold_gains import Folds, chance_of_gain, gain
from tauhat.verification.whiteness import Whiteness, correlated_rows

LEAST_SHARE = 0.02  # of the squared residual that an effect must remove to be named
LEAST_ERRORS = 2.0  # standard errors that it must remove
_MOST_FOLDS, _FEWEST_FOLDS = 16, 10
_ROWS_OF_FOLD = 30
_MOST_NAMED = 4  # of one joint


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """An effect that the residual of a joint holds.

    effect, dependence, term, advice : see `effects.Candidate`
    share, standard_error : of the squared residual that it removes on stretches on which it was not fitted
    p : of removing as much by chance
    order : of a ripple, periods a revolution of the joint
    alternatives : effects that do as well within one standard error
    """

    effect: str
    dependence: Dependence
    term: str
    advice: str
    share: float
    standard_error: float
    p: float
    order: float | None = None
    alternatives: tuple[str, ...] = ()

    def passes(self, threshold: float) -> bool:
        """Return whether it is large, sure, and among the p-values that count."""
        sure = self.share > LEAST_ERRORS * self.standard_error
        return self.share > LEAST_SHARE and sure and self.p <= threshold


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointCase:
    """The residual of one joint and the columns of its model.

    residual : (n,) [Nm or N]
    own : (k, n) columns of the model
    terms : (k,) key of the term that each belongs to
    root : (k, k) of the covariance of their parameters
    """

    joint: int
    name: str
    unit: str
    rms: float
    relative_rms: float
    residual: FloatArray
    own: FloatArray
    terms: tuple[str, ...]
    root: FloatArray
    whiteness: Whiteness

    @property
    def folds(self) -> int:
        """Number of stretches of time: long beside the residual's memory, but not too few."""
        enough = min(self.residual.size // _ROWS_OF_FOLD, int(self.whiteness.effective) // 2)
        return int(np.clip(enough, _FEWEST_FOLDS, _MOST_FOLDS))

    def cut(self, others: FloatArray) -> Folds:
        """Return the folds of the residual with these further columns, (m, n)."""
        redundancy = self.residual.size / self.whiteness.effective
        return Folds.of(self.root.T @ self.own, others, self.residual, folds=self.folds, redundancy=redundancy)


class Outcome(NamedTuple):
    """A candidate, the columns of it that do best, the squared residual of each fold that they leave, in words."""

    candidate: Candidate
    best: IntArray
    left: FloatArray
    effect: Effect

    @property
    def cost(self) -> int:
        """Columns that it takes; a choice among many counts as one more."""
        return int(self.best.size) + bool(self.candidate.choices)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Search:
    """The candidates of one joint, and the folds that judge them.

    places : of each candidate's columns among those of all, one entry a choice
    """

    folds: Folds
    candidates: tuple[Candidate, ...]
    places: tuple[tuple[IntArray, ...], ...]

    @classmethod
    def of(cls, case: JointCase, found: Sequence[Candidate]) -> Search:
        """Return the search among these candidates."""
        starts = np.cumsum([0, *(len(candidate.columns) for candidate in found)])
        places = tuple(
            tuple(start + np.array(choice) for choice in candidate.choices)
            or (np.arange(start, start + len(candidate.columns)),)
            for start, candidate in zip(starts[:-1], found, strict=True)
        )
        folds = case.cut(np.concatenate([candidate.columns for candidate in found]))
        return cls(folds=folds, candidates=tuple(found), places=places)

    def outcomes(self, fixed: IntArray, without: Sequence[str] = ()) -> tuple[Outcome, ...]:
        """Return what every candidate adds to the fixed columns, strongest first.

        Parameters
        ----------
        without : effects that are left out
        """
        before = self.folds.free(fixed)
        found = [
            self._outcome(candidate, own, fixed, before)
            for candidate, own in zip(self.candidates, self.places, strict=True)
            if candidate.effect not in without
        ]
        return tuple(sorted(found, key=lambda outcome: -outcome.effect.share))

    def _outcome(self, candidate: Candidate, own: tuple[IntArray, ...], fixed: IntArray, before: FloatArray) -> Outcome:
        order = None
        if candidate.choices:
            left, best = self.folds.free_choice(fixed, own)
            order = float(candidate.labels[[int(place[0]) for place in own].index(int(best[0]))])
        else:
            best = own[0]
            left = self.folds.free(np.concatenate([fixed, best]))
        rest = self.folds.remaining(np.concatenate([fixed, best]))
        return Outcome(candidate, best, left, judged(candidate, self.folds, (before, left), rest=rest, order=order))


def judged(
    candidate: Candidate,
    folds: Folds,
    squares: tuple[FloatArray, FloatArray],
    *,
    rest: FloatArray,
    order: float | None = None,
) -> Effect:
    """Return an effect with the gain from squared residuals before to after, and `rest`, (n,), that it leaves."""
    found = gain(*squares, folds.squares)
    columns = 2 if candidate.choices else len(candidate.columns)
    by_chance = chance_of_gain(*squares, columns=columns, effective=rest.size / correlated_rows(rest - rest.mean()))
    return Effect(
        effect=candidate.effect, dependence=candidate.dependence, term=candidate.term, advice=candidate.advice,
        share=found.share, standard_error=found.standard_error, p=max(found.p, by_chance), order=order,
    )  # fmt: skip


def named(search: Search, threshold: float) -> tuple[Effect, ...]:
    """Return the effects that are there beside one another: the strongest first, the others with it in the model."""
    chosen = no_columns()
    taken: list[Effect] = []
    while len(taken) < _MOST_NAMED:
        outcomes = search.outcomes(chosen, [effect.effect for effect in taken])
        passing = [outcome for outcome in outcomes if outcome.effect.passes(threshold)]
        if not passing:
            break
        equal = _as_good(passing, search.folds.squares)
        pick = min(equal, key=lambda outcome: outcome.cost)
        others = tuple(outcome.candidate.effect for outcome in equal if outcome is not pick)
        taken.append(replace(pick.effect, alternatives=others))
        chosen = np.concatenate([chosen, pick.best])
    return tuple(taken)


def _as_good(passing: Sequence[Outcome], whole: FloatArray) -> list[Outcome]:
    """Return the strongest outcome and those that leave as little within one standard error, strongest first."""
    strongest = passing[0]
    beside = [(outcome, gain(outcome.left, strongest.left, whole)) for outcome in passing[1:]]
    return [strongest, *(outcome for outcome, worse in beside if worse.share <= worse.standard_error)]


def changes(case: JointCase) -> tuple[Effect, ...]:
    """Return by how much refitting groups of the model's own parameters on this recording lowers the residual."""
    brakes = np.array([key in TERMS and TERMS[key].dissipates for key in case.terms], dtype=bool)
    constant = np.array([key == "offset" for key in case.terms], dtype=bool)
    groups: tuple[tuple[str, Dependence, NDArray[np.bool_], str], ...] = (
        ("friction has changed", "speed", brakes, "friction is another than in the fit: temperature, wear, lubricant"),
        ("offset has changed", "constant", constant, "the zero of the torque has moved"),
        ("inertia has changed", "load", ~brakes & ~constant, "something was carried? See `tauhat payload`"),
    )
    folds = case.cut(case.own)
    before = folds.left(no_columns(), width=1.0)
    found = []
    for effect, dependence, members, advice in groups:
        places = np.flatnonzero(members)
        if not places.size:
            continue
        terms = ", ".join(dict.fromkeys(key for key, member in zip(case.terms, members, strict=True) if member))
        candidate = Candidate(
            effect=effect, dependence=dependence, term=terms, advice=advice, columns=case.own[places]
        )  # fmt: skip
        after = folds.left(places, width=1.0)
        found.append(judged(candidate, folds, (before, after), rest=folds.remaining(places)))
    return tuple(sorted(found, key=lambda item: -item.share))


def no_columns() -> IntArray:
    """Return no column at all."""
    return np.zeros(0, dtype=np.intp)
