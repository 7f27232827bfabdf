"""Everything the chapters tell of: cases, fits and standings, and what follows from them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tauhat.studies.real_logs.case_file import RealCase
from tauhat.studies.real_logs.fitting import CaseFit
from tauhat.studies.real_logs.standings import CLOSE, Standing, least_errors, recommended, standings_of

Pair = tuple[str, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Figures:
    """What was found, fit by fit and in sum.

    standings : over the cases that are judged on rows that were not fitted
    """

    cases: tuple[RealCase, ...]
    fits: tuple[CaseFit, ...]
    standings: tuple[Standing, ...]

    @classmethod
    def of(cls, cases: Sequence[RealCase], fits: Sequence[CaseFit]) -> Figures:
        """Return the fits with what follows from them."""
        unseen = {case.name for case in cases if case.unseen}
        counted = [fit for fit in fits if fit.case in unseen]
        return cls(cases=tuple(cases), fits=tuple(fits), standings=standings_of(counted))

    @property
    def unseen(self) -> tuple[RealCase, ...]:
        """The cases that are judged on rows that were not fitted; only these are counted."""
        return tuple(case for case in self.cases if case.unseen)

    @property
    def counted(self) -> tuple[CaseFit, ...]:
        """The fits of the cases that are counted."""
        names = {case.name for case in self.unseen}
        return tuple(fit for fit in self.fits if fit.case in names)

    @property
    def models(self) -> tuple[str, ...]:
        """Models in their order."""
        return tuple(dict.fromkeys(fit.outcome.model for fit in self.fits))

    @property
    def estimators(self) -> tuple[str, ...]:
        """Estimators in their order."""
        return tuple(dict.fromkeys(fit.outcome.estimator for fit in self.fits))

    @property
    def recommended(self) -> Standing | None:
        """The pair that the cases speak for."""
        return recommended(self.standings)

    @property
    def lost(self) -> tuple[CaseFit, ...]:
        """Fits that did not end well, whether their case is counted or not."""
        return tuple(fit for fit in self.fits if fit.loss)

    def of_case(self, case: RealCase) -> tuple[CaseFit, ...]:
        """Return the fits of one case."""
        return tuple(fit for fit in self.fits if fit.case == case.name)

    def of_pair(self, pair: Pair) -> tuple[CaseFit, ...]:
        """Return the counted fits of one model with one estimator, case by case."""
        return tuple(fit for fit in self.counted if fit.pair == pair)

    def standing_of(self, pair: Pair) -> Standing | None:
        """Return how a pair stands; None where it was not fitted to a case that is counted."""
        return next((row for row in self.standings if row.pair == pair), None)

    def least(self) -> Mapping[str, float]:
        """Return the least error of each counted case on which some fit ended well."""
        return least_errors(self.counted)

    def undecided(self) -> tuple[str, ...]:
        """Return the counted cases on which all fits that ended well are within 2 % of the best."""
        least = self.least()
        return tuple(
            name
            for name in least
            if all(fit.error <= CLOSE * least[name] for fit in self.counted if fit.case == name and not fit.loss)
        )

    def above_reference(self) -> tuple[str, ...]:
        """Return the cases on which every fit that ended well is worse than the baseline of the file."""
        known = {case.name: float(np.mean(case.reference)) for case in self.cases if case.reference}
        least = least_errors(self.fits)
        return tuple(name for name, reference in known.items() if least.get(name, np.inf) > reference)

    def taken_without_one(self) -> Mapping[Pair, int]:
        """Return which pairs the rule would take with any one case left out, and how often."""
        taken: Counter[Pair] = Counter()
        for left_out in self.unseen if len(self.unseen) > 1 else ():
            row = recommended(standings_of([fit for fit in self.counted if fit.case != left_out.name]))
            taken.update([row.pair] if row is not None else [])
        return dict(taken.most_common())

    def spread_over_estimators(self) -> float:
        """Return the median, over cases and models, of the largest over the least error among estimators."""
        return self._spread(lambda fit: (fit.case, fit.outcome.model))

    def spread_over_models(self) -> float:
        """Return the median, over cases and estimators, of the largest over the least error among models."""
        return self._spread(lambda fit: (fit.case, fit.outcome.estimator))

    def _spread(self, key: Callable[[CaseFit], Pair]) -> float:
        groups: dict[Pair, list[float]] = {}
        for fit in self.counted:
            if not fit.loss:
                groups.setdefault(key(fit), []).append(fit.error)
        ratios = [max(errors) / min(errors) for errors in groups.values() if len(errors) > 1]
        return float(np.median(ratios)) if ratios else float("nan")
