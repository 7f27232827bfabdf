"""Estimators against one of them on the same logs, and which of them are to be trusted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tauhat.studies.monte_carlo.cells import loss_of
from tauhat.studies.monte_carlo.fitting import Fit

REFERENCE = "wls"
WITHIN = 1.2  # of the error of the reference
HONEST = 0.9  # of the 95 % intervals must hold the truth


@dataclass(frozen=True, slots=True, kw_only=True)
class Standing:
    """How one estimator stands beside the reference.

    ratios : one a level of noise: geometric mean over logs of its error of the torque over the reference's; nan where
        one of both never ended
    ratio : the same over all levels
    ended : share of its fits that ended well
    inside : mean share of the intervals that hold the truth
    seconds : median of the processor time
    reasons : against trusting it; empty for those to be trusted
    """

    estimator: str
    ratios: tuple[float, ...]
    ratio: float
    ended: float
    inside: float
    seconds: float
    reasons: tuple[str, ...] = ()

    @property
    def trusted(self) -> bool:
        """Whether nothing speaks against it."""
        return not self.reasons


def reference_of(estimators: Sequence[str]) -> str:
    """Return whom the others are compared with: weighted least squares, or the first where that is not among them."""
    return REFERENCE if REFERENCE in estimators else estimators[0]


def standings_of(fits: Sequence[Fit], *, noises: Sequence[float], usable: float) -> tuple[Standing, ...]:
    """Return the standings in the order of the fits.

    An estimator is trusted when every fit ended well, its mean error is at most 1.2 times that of the reference, and at
    least 90 % of its 95 % intervals hold the truth.
    """
    keys = tuple(dict.fromkeys(fit.estimator for fit in fits))
    beside = {_log(fit): fit.torque_error for fit in fits if fit.estimator == reference_of(keys)}
    rows = [_standing([fit for fit in fits if fit.estimator == key], beside, noises, usable) for key in keys]
    return tuple(_with_reasons(row) for row in rows)


def _log(fit: Fit) -> tuple[str, float, float, int]:
    return fit.robot, fit.noise, fit.rate, fit.seed


def _standing(
    fits: Sequence[Fit], beside: dict[tuple[str, float, float, int], float], noises: Sequence[float], usable: float
) -> Standing:
    solved = [fit for fit in fits if not fit.failure]
    logs = {
        level: [np.log(fit.torque_error / beside[_log(fit)]) for fit in solved if fit.noise == level]
        for level in noises
    }
    whole = [value for values in logs.values() for value in values]
    return Standing(
        estimator=fits[0].estimator,
        ratios=tuple(_mean_of_logarithms(logs[level]) for level in noises),
        ratio=_mean_of_logarithms(whole),
        ended=float(np.mean([not loss_of(fit, usable) for fit in fits])),
        inside=float(np.mean([fit.inside for fit in solved])) if solved else np.nan,
        seconds=float(np.median([fit.seconds for fit in fits])),
    )


def _mean_of_logarithms(values: Sequence[float]) -> float:
    known = [value for value in values if np.isfinite(value)]
    return float(np.exp(np.mean(known))) if known else float("nan")


def _with_reasons(row: Standing) -> Standing:
    reasons = []
    if row.ended < 1.0:
        reasons.append(f"ends well in {100 * row.ended:.0f} %")
    if not row.ratio <= WITHIN:
        reasons.append(f"error {row.ratio:.3g} times as large")
    if not row.inside >= HONEST:
        reasons.append(f"intervals hold {100 * row.inside:.0f} %")
    return replace(row, reasons=tuple(reasons))
