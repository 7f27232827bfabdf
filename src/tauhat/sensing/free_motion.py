"""How wrong a sensor is where nothing touches the arm: the error bars that free motion teaches.

Within a log the error is slow: one temperature, one torque constant, one zero. Logs are therefore the values of a
statistics of few. With z the sensed torque of a log in parts of its standard error, log by log, (n, n_v):

    s_j^2 = mean of z_j^2               s_j of the others: without the log itself
    c = 95 % quantile of |z_j| / s_j of the others, over all logs and joints, in parts of 1.96
    standard errors are told c s_j times as large; a bar of 1.96 of them then holds 95 % of a log it has not seen
    R = mean of z z', scaled to ones on its diagonal, shrunk to the unit matrix by
    l = sum of the variances of the R_ij between logs / sum of R_ij^2,  i not j
All means and the quantile are over time, so that a log does not count more for being sampled faster.

Sources: Stone, "Cross-validatory choice and assessment of statistical predictions", 1974 (each log by the others);
Schaefer, Strimmer, "A shrinkage approach to large-scale covariance matrix estimation", 2005.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import SensingError
from tauhat.recordings.log import Log
from tauhat.recordings.recording import Recording
from tauhat.sensing.contact_rules import ContactRules
from tauhat.sensing.free_logs import sensed_free
from tauhat.sensing.judged_rows import free_rows
from tauhat.sensing.sensed_log import SensedLog
from tauhat.sensing.sensor import ForceSensor
from tauhat.sensing.zero import AirPass

FEWEST_SECONDS = 10.0  # of settled free motion from which an error is told
_FEWEST_PARTS = 4  # logs from which each is one value; fewer are cut
_PART = 10.0  # [s] of such a cut, or less where there would be too few
_INTERVAL, _SHARE = 1.96, 0.95
_TINY = float(np.finfo(float).tiny)


def learnt_from_free_motion(
    sensor: ForceSensor,
    logs: Sequence[Recording | Log],
    *,
    air: AirPass | None = None,
    standing: ContactRules | None = None,
) -> ForceSensor:
    """Return the sensor with the error of each joint, and what errors have in common, that logs without contact show.

    The residual of a fit is that of the motion it was fitted to. At other speeds, in other places and at another
    temperature the model is more wrong: logs of the work, done in air, tell by how much. The rms of the sensed torque
    becomes that of the model (`SensedModel.rms`), by which observers go that learn themselves. What is not known of
    bristles and warmth is already in it, so the standard errors that are told are stretched until they fit
    (`SensedModel.stretch`), and the wrench is solved with the correlation of the joints (`WrenchSolver.correlation`).

    Parameters
    ----------
    logs : without any contact, at the speeds of the work, at any rate that the filter allows; several short ones on
        different ways, cold and warm, tell more than a long one
    air : pass that is taken off them, as it is off the work
    standing : rules whose zero is taken off them, as it is off the work (`judged_log(..., zero="standing")`); then the
        error is that of what remains (`error_of(learnt, zero="standing")`). None: of torque as sensed

    Raises
    ------
    SensingError
        when there are less than ten seconds of it, or a log does not suit the sensor.
    """
    unstretched = np.ones(sensor.n_v)
    plain = replace(sensor, model=replace(sensor.model, stretch=unstretched))
    rms = error_in_free_motion(_told(plain, logs, air, standing))
    plain = replace(plain, model=replace(plain.model, rms=rms))
    parts, seconds = _parts(_told(plain, logs, air, standing))
    correlation = shrunk_correlation(parts, seconds=seconds)
    model = replace(plain.model, stretch=_stretch(parts, seconds))
    return replace(plain, model=model, wrench=replace(sensor.solver, correlation=correlation))


def error_in_free_motion(free: Sequence[SensedLog]) -> FloatArray:
    """Return the root mean square of what was sensed where nothing touches the arm, over time, (n_v,) [Nm or N].

    Raises
    ------
    SensingError
        when there are less than ten seconds of it.
    """
    seconds = sum(float(np.count_nonzero(log.settled)) * log.step for log in free)
    if seconds < FEWEST_SECONDS:
        raise SensingError(
            "too little free motion to learn an error from", expected=f"{FEWEST_SECONDS:g} s", got=f"{seconds:.1f} s"
        )
    squares = np.sum([log.step * np.square(log.tau[log.settled]).sum(axis=0) for log in free], axis=0)
    return np.asarray(np.maximum(np.sqrt(squares / seconds), _TINY))


def shrunk_correlation(parts: Sequence[FloatArray], *, seconds: FloatArray | None = None) -> FloatArray:
    """Return the correlation about zero of columns (n, k), as far as parts agree on it, (k, k).

    Parameters
    ----------
    parts : two or more, independent of each other; one that is alike within itself counts as one value
    seconds : of each part, by which it counts [s]; by its rows where none are given
    """
    weights = np.array([len(part) for part in parts]) if seconds is None else seconds
    shares = weights / weights.sum()
    products = np.stack([part.T @ part / len(part) for part in parts])
    whole = np.einsum("p,pij->ij", shares, products)
    sizes = np.sqrt(np.maximum(whole.diagonal(), _TINY))
    found, products = whole / np.outer(sizes, sizes), products / np.outer(sizes, sizes)
    apart = np.einsum("p,pij->ij", shares, np.square(products - found)) / (len(parts) - 1)
    beside = ~np.eye(len(sizes), dtype=np.bool_)
    size = float(np.square(found[beside]).sum())
    shrunk = min(1.0, float(apart[beside].sum()) / size) if size > 0.0 else 1.0
    return np.where(beside, (1.0 - shrunk) * found, 1.0)


def _told(
    sensor: ForceSensor, logs: Sequence[Recording | Log], air: AirPass | None, standing: ContactRules | None
) -> list[SensedLog]:
    """Return what is told along the logs, less what is taken off."""
    sensed = sensed_free(sensor, logs, air=air)
    if standing is None:
        return sensed
    slow = sensor.model.slow[None]
    return [replace(log, tau=log.tau - free_rows(log, slow, standing)[2]) for log in sensed]


def _parts(free: Sequence[SensedLog]) -> tuple[list[FloatArray], FloatArray]:
    """Return sensed torque in parts of its standard error, (n, n_v), log by log, and the seconds of each.

    A few logs are cut.
    """
    telling = [log for log in free if log.settled.any()]
    least = 1 if len(telling) >= _FEWEST_PARTS else -(-_FEWEST_PARTS // len(telling))
    parts: list[FloatArray] = []
    seconds: list[float] = []
    for log in telling:
        rows = log.tau[log.settled] / np.maximum(log.tau_std[log.settled], _TINY)
        cuts = 1 if least == 1 else max(least, int(len(rows) * log.step / _PART))
        found = [part for part in np.array_split(rows, cuts) if len(part)]
        parts += found
        seconds += [len(part) * log.step for part in found]
    return parts, np.array(seconds)


def _stretch(parts: Sequence[FloatArray], seconds: FloatArray) -> FloatArray:
    """Return how many times larger standard errors have to be told, (n_v,)."""
    squares = np.stack([second * np.square(part).mean(axis=0) for part, second in zip(parts, seconds, strict=True)])
    size = np.sqrt(squares.sum(axis=0) / seconds.sum())
    of_others = np.sqrt(np.maximum(squares.sum(axis=0) - squares, 0.0) / (seconds.sum() - seconds)[:, None])
    seen = size > 0.0
    if not seen.any():
        return np.ones(len(size))
    unseen = [
        np.abs(part[:, seen]) / np.maximum(others[seen], _TINY) for part, others in zip(parts, of_others, strict=True)
    ]
    weights = [np.full(values.size, second / len(values)) for values, second in zip(unseen, seconds, strict=True)]
    values = np.concatenate([part.ravel() for part in unseen])
    wider = float(np.quantile(values, _SHARE, weights=np.concatenate(weights), method="inverted_cdf")) / _INTERVAL
    return np.where(seen, wider * size, 1.0)
