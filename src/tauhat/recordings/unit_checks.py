"""Checks of units and channels: numbers no joint reaches, a position that does not fit the logged velocity."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.recordings.findings import Finding
from tauhat.recordings.log import Log
from tauhat.recordings.value_checks import STANDING

_MOST = {"rad": 4.0 * math.pi, "m": 20.0}  # no joint of an arm goes further
_MOST_TORQUE = 1e5  # [Nm or N]
_TEMPERATURES = (-50.0, 200.0)  # [deg C]
_AVERAGE = 0.02  # [s] both speeds are averaged over it before they are compared
_LAGS = 8  # [samples] tried either way
_FITS = 0.3  # relative error up to which two speeds are the same motion
_SLOPE = 0.05  # speeds that differ by more do not belong together
_HALF_SAMPLE = 0.5
_CLEARER = 0.5  # error with the lag over error without it, below which the lag is beyond doubt
_AGREEING = (
    0.2,
    0.1,
)  # [samples] and part of the lag: scatter over joints below which a lag hidden by noise is believed
_RATIOS = {
    180.0 / math.pi: "the position is in degrees: check [position] unit",
    math.pi / 180.0: "the velocity is in degrees: check [velocity] unit",
    1e3: "the position is in mm: check [position] unit",
    1e-3: "the time counts ms: check [time] unit",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedFit:
    """How a logged velocity fits the differentiated position: `dq/dt[k] = slope x velocity[k + lag]`.

    slope : 1 when both are right
    lag : by how many samples the velocity is late
    error : relative error of the fit at this lag
    plain_error : the same without lag
    """

    slope: float
    lag: float
    error: float
    plain_error: float


def check_units(log: Log) -> list[Finding]:
    """Return quantities with numbers no joint reaches in SI."""
    found = []
    for joint, unit, values in zip(log.joint_names, log.units, log.q.T, strict=True):
        far = float(np.abs(values).max())
        if far > _MOST[unit]:
            counts = bool((values == np.round(values)).all())
            guess = "encoder counts" if counts else "degrees or the motor side" if unit == "rad" else "mm"
            message = f"position reaches {far:.4g} {unit}: is it in {guess}?"
            advice = "check unit, scale and coupling of [position] in the map"
            found.append(
                Finding(
                    code="position_unit", severity="warning", joint=joint, message=message, number=far, advice=advice
                )
            )
    if log.tau is not None and np.quantile(np.abs(log.tau), 0.99) > _MOST_TORQUE:
        peak = float(np.abs(log.tau).max())
        message = f"torque reaches {peak:.2g}: is it in counts or mNm?"
        advice = "check unit and gain of [torque] in the map"
        found.append(Finding(code="torque_unit", severity="warning", message=message, number=peak, advice=advice))
    low, high = _TEMPERATURES
    if log.temperature is not None and (log.temperature.min() < low or log.temperature.max() > high):
        message = f"temperature runs from {log.temperature.min():.4g} to {log.temperature.max():.4g} deg C"
        advice = "check unit of [temperature] in the map"
        found.append(Finding(code="temperature_unit", severity="warning", message=message, advice=advice))
    return found


def check_velocity(log: Log) -> list[Finding]:
    """Return whether the logged velocity is the derivative of the logged position: scale, sign, lag."""
    if log.dq is None or log.n_t < 10 * _LAGS:
        return []
    moving = np.flatnonzero(np.ptp(log.q, axis=0) > [10.0 * STANDING[unit] for unit in log.units])
    fits = {log.joint_names[index]: fit_speed(log.t, log.q[:, index], log.dq[:, index]) for index in moving}
    if not fits:
        return []
    found = [finding for joint, fit in fits.items() for finding in _slope(joint, fit)]
    found.extend(_lag(log, [fit for fit in fits.values() if fit.error < _FITS and abs(fit.slope - 1.0) < _SLOPE]))
    if not found:
        largest = max(fit.error for fit in fits.values())
        message = f"velocity is the derivative of position (to {largest:.1%})"
        found.append(Finding(code="velocity", severity="ok", message=message, number=largest))
    return found


def fit_speed(t: FloatArray, q: FloatArray, dq: FloatArray) -> SpeedFit:
    """Return how the logged velocity of a joint fits its differentiated position; all (n_t,), time rising."""
    from scipy.ndimage import uniform_filter1d

    width = max(3, round(_AVERAGE / float(np.median(np.diff(t)))) | 1)
    derived = uniform_filter1d(np.gradient(q, t), width)[_LAGS:-_LAGS]
    logged = uniform_filter1d(dq, width)
    lags = range(-_LAGS, _LAGS + 1)
    shifted = [logged[_LAGS + lag : logged.size - _LAGS + lag] for lag in lags]
    pairs = [_regress(derived, speed) for speed in shifted]
    squares = np.array([error**2 for _, error in pairs])
    best = int(squares.argmin())
    lag = float(best - _LAGS)
    if 0 < best < 2 * _LAGS:
        before, here, behind = squares[best - 1 : best + 2]
        bend = before - 2.0 * here + behind
        lag += 0.5 * float(before - behind) / float(bend) if bend > 0 else 0.0
    slope, error = pairs[best]
    return SpeedFit(slope=slope, lag=lag, error=error, plain_error=pairs[_LAGS][1])


def _regress(derived: FloatArray, logged: FloatArray) -> tuple[float, float]:
    """Return slope and relative error of `derived = slope logged`."""
    power, total = float(logged @ logged), float(derived @ derived)
    if power == 0 or total == 0:
        return 0.0, 1.0
    slope = float(derived @ logged) / power
    return slope, float(np.linalg.norm(derived - slope * logged)) / math.sqrt(total)


def _slope(joint: str, fit: SpeedFit) -> list[Finding]:
    if fit.error > _FITS:
        message = f"velocity is not the derivative of position (relative error {fit.error:.0%})"
        advice = "check that both columns belong to this joint, and the time"
        return [
            Finding(
                code="velocity_mismatch",
                severity="warning",
                joint=joint,
                message=message,
                number=fit.error,
                advice=advice,
            )
        ]
    if abs(fit.slope - 1.0) < _SLOPE:
        return []
    if abs(fit.slope + 1.0) < _SLOPE:
        message, advice = "velocity and position have opposite signs", "check sign of [position] and [velocity]"
        return [
            Finding(
                code="velocity_sign", severity="error", joint=joint, message=message, number=fit.slope, advice=advice
            )
        ]
    known = (text for ratio, text in _RATIOS.items() if abs(abs(fit.slope) / ratio - 1.0) < _SLOPE)
    advice = next(known, "check units, scale and gear ratios of position, velocity and time")
    message = f"position changes {fit.slope:.4g} times as fast as the logged velocity says"
    return [
        Finding(code="velocity_scale", severity="error", joint=joint, message=message, number=fit.slope, advice=advice)
    ]


def _lag(log: Log, fits: list[SpeedFit]) -> list[Finding]:
    if not fits:
        return []
    lags = np.array([fit.lag for fit in fits])
    lag = float(np.median(lags))
    clear = float(np.median([fit.error / max(fit.plain_error, 1e-12) for fit in fits])) < _CLEARER
    agreed = lags.size > 2 and float(lags.std()) < _AGREEING[0] + _AGREEING[1] * abs(lag)
    if abs(lag) < _HALF_SAMPLE or not (clear or agreed):
        return []
    step = float(np.median(np.diff(log.t)))
    late, delay = ("velocity", lag) if lag > 0 else ("position", -lag)
    return [
        Finding(
            code="velocity_lag", severity="warning" if clear else "note", number=lag,
            message=f"{late} is logged {delay:.1f} samples ({1e3 * delay * step:.2g} ms) late",
            advice=f"[{late}] delay_samples = {delay:.1f} in the map undoes it",
        )
    ]  # fmt: skip
