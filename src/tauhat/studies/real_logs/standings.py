"""Models and estimators beside each other over all cases, and which of them the cases speak for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tauhat.studies.real_logs.fitting import CaseFit

_EQUAL = 1.001  # of the least error: a difference that no one would call better
CLOSE = 1.02  # of the least error of a case: what no other log of the same robot would tell apart


@dataclass(frozen=True, slots=True, kw_only=True)
class Standing:
    """How one model with one estimator stands over the cases.

    cases : how many there are
    ended : on how many it ended well
    best, close : on how many it has the least error to 0.1 %, or one within 2 % of that
    median : of its errors over torque; nan where it never ended well
    ratio, worst : geometric mean and largest of its errors over the least of the same case
    worst_case : where that was; empty where it is the best everywhere
    seconds : of processor time, all cases together
    """

    model: str
    estimator: str
    cases: int
    ended: int
    best: int
    close: int
    median: float
    ratio: float
    worst: float
    worst_case: str
    seconds: float

    @property
    def pair(self) -> tuple[str, str]:
        """Model and estimator."""
        return self.model, self.estimator

    @property
    def everywhere(self) -> bool:
        """Whether it ended well on every case."""
        return self.ended == self.cases


def least_errors(fits: Sequence[CaseFit]) -> Mapping[str, float]:
    """Return the least error of each case on which some fit ended well."""
    least: dict[str, float] = {}
    for fit in fits:
        if not fit.loss:
            least[fit.case] = min(fit.error, least.get(fit.case, np.inf))
    return least


def standings_of(fits: Sequence[CaseFit]) -> tuple[Standing, ...]:
    """Return the standings in the order of the fits, which hold every pair on every case."""
    least, count = least_errors(fits), len({fit.case for fit in fits})
    pairs = tuple(dict.fromkeys(fit.pair for fit in fits))
    return tuple(_standing([fit for fit in fits if fit.pair == pair], least, count) for pair in pairs)


def recommended(standings: Sequence[Standing]) -> Standing | None:
    """Return the one to take: of those that ended well everywhere the one that is close to the best most often.

    Between equals the smaller mean ratio to the best decides, then the time. None where nothing ended well everywhere.
    """
    known = [row for row in standings if row.everywhere]
    return min(known, key=lambda row: (-row.close, row.ratio, row.seconds), default=None)


def _standing(fits: Sequence[CaseFit], least: Mapping[str, float], count: int) -> Standing:
    model, estimator = fits[0].pair
    ended = [fit for fit in fits if not fit.loss]
    ratios = {fit.case: fit.error / least[fit.case] for fit in ended}
    worst_case = max(ratios, key=lambda name: ratios[name], default="")
    worst = ratios.get(worst_case, np.nan)
    return Standing(
        model=model,
        estimator=estimator,
        cases=count,
        ended=len(ended),
        best=sum(ratio <= _EQUAL for ratio in ratios.values()),
        close=sum(ratio <= CLOSE for ratio in ratios.values()),
        median=float(np.median([fit.error for fit in ended])) if ended else np.nan,
        ratio=float(np.exp(np.mean(np.log(list(ratios.values()))))) if ended else np.nan,
        worst=worst,
        worst_case=worst_case if worst > _EQUAL else "",
        seconds=float(sum(fit.outcome.processor_seconds for fit in fits)),
    )
