"""The search on one joint: every effect by itself, then the strongest, and what is left beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.dynamics.model import TERMS
from tauhat.verification.effects import Candidate, Dependence
from tauhat.verification.fold_gains import Folds, gain
from tauhat.verification.whiteness import Whiteness

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


class Trial(NamedTuple):
    """A candidate, the effect that it showed by itself, and its columns among those of all candidates of the joint."""

    candidate: Candidate
    effect: Effect
    places: tuple[IntArray, ...]


def trials(case: JointCase, found: Sequence[Candidate]) -> tuple[Trial, ...]:
    """Return every candidate with what it removes by itself, strongest first."""
    folds = case.cut(_columns_of(found))
    before = folds.free(_none())
    places = _places_of(found)
    tried = []
    for candidate, own in zip(found, places, strict=True):
        after, best = _left(folds, _none(), own)
        tried.append(Trial(candidate, _effect(candidate, (before, after, folds.squares), best, own), own))
    return tuple(sorted(tried, key=lambda trial: -trial.effect.share))


def named(case: JointCase, searched: Sequence[Trial], threshold: float) -> tuple[Effect, ...]:
    """Return the effects that are there beside one another: the strongest first, the others with it in the model."""
    folds = _folds_again(case, searched)
    chosen, taken = _none(), []
    before = folds.free(chosen)
    rest = list(searched)
    while rest and len(taken) < _MOST_NAMED:
        steps = [(_left(folds, chosen, trial.places), trial) for trial in rest]
        effects = [
            _effect(trial.candidate, (before, after, folds.squares), best, trial.places)
            for (after, best), trial in steps
        ]
        passing = [k for k, effect in enumerate(effects) if effect.passes(threshold)]
        if not passing:
            break
        pick, beside = _simplest(passing, steps, folds.squares)
        taken.append(_with_alternatives(effects[pick], [rest[k].candidate.effect for k in beside]))
        (before, best), trial = steps[pick]
        chosen = np.concatenate([chosen, best])
        rest.remove(trial)
    return tuple(taken)


def _simplest(
    passing: Sequence[int], steps: Sequence[tuple[tuple[FloatArray, IntArray], Trial]], whole: FloatArray
) -> tuple[int, list[int]]:
    """Return which of the steps to take, and which others do as well: of those the one with the fewest columns."""
    strongest = min(passing, key=lambda k: float(steps[k][0][0].sum()))
    least = steps[strongest][0][0]
    equal = []
    for k in passing:
        worse = gain(steps[k][0][0], least, whole)
        if k == strongest or worse.share <= worse.standard_error:
            equal.append(k)
    pick = min(equal, key=lambda k: (_cost(steps[k]), float(steps[k][0][0].sum())))
    return pick, [k for k in equal if k != pick]


def _cost(step: tuple[tuple[FloatArray, IntArray], Trial]) -> int:
    (_, best), trial = step
    return int(best.size) + bool(trial.candidate.choices)


def changes(case: JointCase) -> tuple[Effect, ...]:
    """Return by how much refitting groups of the model's own parameters on this recording lowers the residual."""
    size = np.array([TERMS[key].dissipates if key in TERMS else False for key in case.terms], dtype=bool)
    constant = np.array([key == "offset" for key in case.terms], dtype=bool)
    groups = (
        ("friction has changed", "speed", size, "friction is another than in the fit: temperature, wear, lubricant"),
        ("offset has changed", "constant", constant, "the zero of the torque has moved"),
        ("inertia has changed", "load", ~size & ~constant, "a payload or tool that was not there? `tauhat payload`"),
    )
    folds = case.cut(case.own)
    before = folds.left(_none(), width=1.0)
    found = []
    for effect, dependence, members, advice in groups:
        places = np.flatnonzero(members)
        if not places.size:
            continue
        after = folds.left(places, width=1.0)
        candidate = Candidate(
            effect=effect, dependence=dependence, term=_joined(case, members), advice=advice, columns=case.own[places]
        )  # fmt: skip
        found.append(_effect(candidate, (before, after, folds.squares), places, (places,)))
    return tuple(sorted(found, key=lambda item: -item.share))


def _joined(case: JointCase, members: FloatArray) -> str:
    return ", ".join(dict.fromkeys(key for key, member in zip(case.terms, members, strict=True) if member))


def _left(folds: Folds, fixed: IntArray, places: tuple[IntArray, ...]) -> tuple[FloatArray, IntArray]:
    """Return what a candidate leaves beside the fixed columns, and which of its columns do that."""
    if len(places) == 1:
        return folds.free(np.concatenate([fixed, places[0]])), places[0]
    return folds.free_choice(fixed, places)


def _effect(
    candidate: Candidate,
    squares: tuple[FloatArray, FloatArray, FloatArray],
    best: IntArray,
    places: tuple[IntArray, ...],
) -> Effect:
    found = gain(*squares)
    order = None
    if candidate.choices:
        order = float(candidate.labels[[int(place[0]) for place in places].index(int(best[0]))])
    return Effect(
        effect=candidate.effect, dependence=candidate.dependence, term=candidate.term, advice=candidate.advice,
        share=found.share, standard_error=found.standard_error, p=found.p, order=order,
    )  # fmt: skip


def _with_alternatives(effect: Effect, names: Sequence[str]) -> Effect:
    return replace(effect, alternatives=tuple(names))


def _columns_of(found: Sequence[Candidate]) -> FloatArray:
    return np.concatenate([candidate.columns for candidate in found])


def _places_of(found: Sequence[Candidate]) -> list[tuple[IntArray, ...]]:
    starts = np.cumsum([0, *(len(candidate.columns) for candidate in found)])
    return [
        tuple(start + np.array(choice) for choice in candidate.choices)
        or (np.arange(start, start + len(candidate.columns)),)
        for start, candidate in zip(starts[:-1], found, strict=True)
    ]


def _folds_again(case: JointCase, searched: Sequence[Trial]) -> Folds:
    """Return the folds with the columns in the order that the trials' places count in."""
    first = sorted(searched, key=lambda trial: int(trial.places[0][0]))
    return case.cut(_columns_of([trial.candidate for trial in first]))


def _none() -> IntArray:
    return np.zeros(0, dtype=np.intp)
