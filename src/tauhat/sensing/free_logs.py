"""Logs without contact of any rate, sensed as the judged log is: same observer, same filter, a rate of their own.

Gain, filter, delay and the times of contact are in seconds, so what is learnt at one rate holds at another as long as
the filter is the same. A log that was taken slower than the filter allows is refused; one that is twice as fast or more
is thinned to between one and two times the sensor's rate, for what a finer log averages away the judged log still has.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tauhat.errors import SensingError
from tauhat.recordings.log import Log
from tauhat.recordings.recording import Recording
from tauhat.sensing.causal_filter import HIGHEST
from tauhat.sensing.sample_rate import OFF_RATE, usual_step
from tauhat.sensing.sensed_log import SensedLog
from tauhat.sensing.sensor import ForceSensor
from tauhat.sensing.zero import AirPass, without_air

_SIGNALS = ("t", "q", "dq", "ddq", "tau", "temperature", "wrench")


def sensed_free(sensor: ForceSensor, logs: Sequence[Recording | Log], *, air: AirPass | None = None) -> list[SensedLog]:
    """Return what a sensor tells along logs of any rate, each by the same filter and observer at the log's own rate.

    Parameters
    ----------
    air : pass that is taken off each of them; none by default

    Raises
    ------
    SensingError
        when a log is of another robot or motion, has no torque, or is too slow for the sensor's filter.
    """
    found = []
    for log in logs:
        thin = _thinned(log, sensor.rate)
        at_its_rate = _at_rate(sensor, thin)
        sensed = at_its_rate.along(thin)
        found.append(sensed if air is None else without_air(sensed, air, solver=at_its_rate.solver))
    return found


def settled_seconds(free: Sequence[SensedLog]) -> float:
    """Return how long the sensor was behind its starts, over all logs [s]."""
    return sum(float(np.count_nonzero(log.settled)) * log.step for log in free)


def _thinned(log: Recording | Log, rate: float) -> Recording | Log:
    """Return every so manieth sample, so that the rate is between one and two times that of the judged log."""
    step = usual_step(log.t)
    every = int((1.0 + OFF_RATE) / (step * rate)) if step > 0.0 else 1
    if every < 2:
        return log
    present = {name: getattr(log, name) for name in _SIGNALS}
    return replace(log, **{name: values[::every].copy() for name, values in present.items() if values is not None})


def _at_rate(sensor: ForceSensor, log: Recording | Log) -> ForceSensor:
    """Return the sensor for the rate of a log, with the same filter."""
    step = usual_step(log.t)
    if not step > 0.0 or abs(step * sensor.rate - 1.0) <= OFF_RATE:
        return sensor  # which refuses a log without a rate
    rate, cutoff = 1.0 / step, float(sensor.cutoff or 0.0)
    if cutoff > HIGHEST * rate:
        raise SensingError(
            "free motion is too slow for the filter of the judged log", where=log.name,
            expected=f"{cutoff / HIGHEST:.4g} Hz or more", got=f"{rate:.4g} Hz",
            remedy=f"a lower cut-off for both: --cutoff {_below(HIGHEST * rate)}",
        )  # fmt: skip
    return replace(sensor, rate=rate)


def _below(frequency: float) -> str:
    """Return a frequency that is no larger, to two digits after the point."""
    return f"{int(frequency * 99.0) / 100.0:g}"
