"""When samples are taken, what their stamps say, and which of them reach the log."""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.errors import SimulationError
from tauhat.simulation.sensors.sensor_errors import SensorErrors

HALF_WIDTH = np.sqrt(3.0)
"""Of a uniform density of unit deviation."""


def sampling_instants(errors: SensorErrors, ticks: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return when the samples are really taken, (n,) [s]: about the ticks, within the run."""
    if not errors.sampling_jitter:
        return ticks
    refuse_overtaking(errors, float(np.diff(ticks).min()))
    off = errors.sampling_jitter * HALF_WIDTH * rng.uniform(-1.0, 1.0, ticks.size)
    return np.asarray(np.clip(ticks + off, ticks[0], ticks[-1]))


def time_stamps(
    errors: SensorErrors, ticks: FloatArray, instants: FloatArray, *, rng: np.random.Generator
) -> FloatArray:
    """Return the time column of the log before rows are lost, (n,) [s], always increasing."""
    stamped = ticks if errors.stamps == "ticks" else instants
    if not errors.stamp_jitter:
        return stamped
    refuse_overtaking(errors, float(np.diff(ticks).min()))
    return np.asarray(stamped + errors.stamp_jitter * HALF_WIDTH * rng.uniform(-1.0, 1.0, ticks.size))


def kept_rows(errors: SensorErrors, count: int, rng: np.random.Generator) -> IntArray:
    """Return which of `count` rows reach the log.

    Stretches of kept and of lost rows follow each other, with geometric lengths whose means are `lost_run` for the
    lost ones and what the share of losses asks for the kept ones.

    Source: Gilbert, "Capacity of a burst-noise channel", 1960 (the chain of two states).
    """
    share = errors.lost_samples
    if not share:
        return np.arange(count, dtype=np.intp)
    pairs = count // 2 + 1  # enough even if every stretch has one row
    kept = rng.geometric(min(1.0, share / (errors.lost_run * (1.0 - share))), pairs)
    lost = rng.geometric(1.0 / errors.lost_run, pairs)
    lengths = np.minimum(np.column_stack([kept, lost]).ravel(), count)
    ends = np.cumsum(lengths)
    stretches = np.searchsorted(ends, np.arange(count), side="right")
    return np.flatnonzero(stretches % 2 == 0)


def refuse_overtaking(errors: SensorErrors, step: float) -> None:
    """Refuse jitter that could turn the order of two samples or of their stamps round, a step [s] apart.

    Raises
    ------
    SimulationError
        says how much jitter there may be.
    """
    instants = errors.sampling_jitter if errors.stamps == "instants" else 0.0
    widest = 2.0 * HALF_WIDTH * max(errors.sampling_jitter, instants + errors.stamp_jitter)
    if widest >= step:
        raise SimulationError(
            "the jitter lets samples overtake each other",
            expected=f"sampling and stamp jitter below {step / (2.0 * HALF_WIDTH):.3g} s together",
            got=f"{widest / (2.0 * HALF_WIDTH):.3g} s",
            remedy="lower the rate of the log, or the jitter",
        )
