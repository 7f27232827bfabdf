"""Figures of one estimator in one situation, over its seeds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from tauhat.studies.monte_carlo.fitting import Fit

_FEWEST = 3  # fits that tell of a bias


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """What became of one estimator on one robot, at one level of noise and one rate; medians over the fits that ended.

    ended : share of the seeds without an error, without the method's own doubt, and with a usable torque on the unseen
        motion
    parameter_error, torque_error : median; nan where no fit gave values
    low, high : quartiles of the torque's error
    passes, seconds : median; seconds of processor time
    inside : mean share of the 95 % intervals that hold the truth
    bias : root mean square over the parameters of the mean error over its standard error, of the fits that ended well:
        about 1 without a bias; nan below three such fits
    losses : why the others did not end well, one for each
    """

    robot: str
    noise: float
    rate: float
    estimator: str
    seeds: int
    ended: float
    parameter_error: float
    torque_error: float
    low: float
    high: float
    passes: float
    seconds: float
    inside: float
    bias: float = np.nan
    losses: tuple[str, ...] = ()


def cells_of(fits: Iterable[Fit], *, usable: float) -> tuple[Cell, ...]:
    """Return a cell for every robot, noise, rate and estimator, in the order of the fits.

    Parameters
    ----------
    usable : largest relative error of the torque on the unseen motion with which a fit has ended well
    """
    groups: dict[tuple[str, float, float, str], list[Fit]] = {}
    for fit in fits:
        groups.setdefault((fit.robot, fit.noise, fit.rate, fit.estimator), []).append(fit)
    return tuple(_cell(group, usable) for group in groups.values())


def _cell(fits: Sequence[Fit], usable: float) -> Cell:
    first = fits[0]
    solved = [fit for fit in fits if not fit.failure]
    losses = tuple(loss for fit in fits if (loss := loss_of(fit, usable)))
    errors = np.array([fit.torque_error for fit in solved])
    low, high = np.quantile(errors, [0.25, 0.75]) if solved else (np.nan, np.nan)
    return Cell(
        robot=first.robot,
        noise=first.noise,
        rate=first.rate,
        estimator=first.estimator,
        seeds=len(fits),
        ended=1.0 - len(losses) / len(fits),
        parameter_error=_median([fit.parameter_error for fit in solved]),
        torque_error=_median([fit.torque_error for fit in solved]),
        low=float(low),
        high=float(high),
        passes=_median([fit.passes for fit in solved]),
        seconds=_median([fit.seconds for fit in solved]),
        inside=float(np.mean([fit.inside for fit in solved])) if solved else np.nan,
        bias=_bias([fit.errors for fit in solved if not loss_of(fit, usable)]),
        losses=losses,
    )


def loss_of(fit: Fit, usable: float) -> str:
    """Return why a fit did not end well; empty where it did."""
    if fit.failure or fit.doubt:
        return fit.failure or fit.doubt
    if fit.torque_error <= usable:
        return ""
    return f"torque of the unseen motion off by more than {100 * usable:g} % ({fit.cause})"


def _bias(errors: Sequence[tuple[float, ...]]) -> float:
    """Return the root mean square of mean over standard error, `errors` being those of the parameters, fit by fit."""
    if len(errors) < _FEWEST:
        return float("nan")
    table = np.array(errors)
    deviation = np.maximum(table.std(axis=0, ddof=1), np.finfo(float).tiny) / np.sqrt(len(table))
    return float(np.sqrt(np.mean((table.mean(axis=0) / deviation) ** 2)))


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if values else float("nan")
