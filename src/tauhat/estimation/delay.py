"""Delay between torque and position, found by the lag at which the model fits best.

A log often carries its channels a sample apart. The fit's residual over the lag of the position is a parabola around
the true lag, but model error at low frequency shifts it. It is therefore scanned in three bands of frequency, and only
believed when all three agree.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.base import BaseParameters
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.terms import Coulomb
from tauhat.errors import ModelError
from tauhat.estimation.evidence import evidence_from_rows
from tauhat.estimation.rows import Rows, filtered_rows
from tauhat.estimation.solution import joint_residuals, joint_torques, solve
from tauhat.recordings.choice import top_speeds
from tauhat.recordings.filters import filtered, high_pass
from tauhat.recordings.processing import Processing, clock_step
from tauhat.recordings.recording import Recording

LAGS = (-2.0, -1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5, 2.0)  # [samples]
_BANDS = ((0.04, 0.4), (0.06, 0.6), (0.1, 1.0))  # lower and upper frequency, in parts of the cut-off
_MOTION = 3.0  # cut-off of the position over the upper frequency
_WIDTH = 0.03  # of the smooth sign in the scan, in parts of the top speed: a sharp one hides the lag
_SMALLEST, _LARGEST = 0.4, 1.2  # [samples] lags that are believed
_AGREEMENT = 0.4  # [samples] between the bands
_LEAST_DROP = 0.04  # of the residual, in every band
_MOST_SAMPLES = 10_000
_RIDGE = 1e-6  # offsets vanish in a band: their columns are nearly zero


@dataclass(frozen=True, slots=True, kw_only=True)
class Delay:
    """How much later than the torque the position is logged.

    samples, seconds : the lag at which the fit is best, median of the bands; infinite where none was found
    drop : by what part the residual falls at that lag, in the band where it falls least
    certain : whether all bands agree on a lag of 0.4 to 1.2 samples that lowers the residual by 4 %
    """

    samples: float
    seconds: float
    drop: float
    certain: bool


def position_delay(
    model: TorqueModel, base: BaseParameters, recordings: Sequence[Recording], processing: Processing
) -> Delay:
    """Return the delay of the position against the torque; the longest recording is scanned."""
    recording = max(recordings, key=lambda item: item.n_t)
    recording = recording.rows(0, min(recording.n_t, _MOST_SAMPLES))
    step = clock_step(recording)
    scanned = _blunted(model, recording)
    minima, drops = [], []
    for lower, upper in _BANDS:
        cutoff = upper * processing.cutoff
        settings = Processing(cutoff=cutoff, motion_cutoff=_MOTION * cutoff)
        levels = [
            band_residual(
                scanned, base, recording, replace(settings, delay=lag * step), lower=lower * processing.cutoff
            )
            for lag in LAGS
        ]
        lag, drop = _vertex(np.array(levels))
        minima.append(lag)
        drops.append(drop)
    samples, drop = float(np.median(minima)), float(min(drops))
    sizes = np.abs(minima)
    believable = sizes.min() >= _SMALLEST and sizes.max() <= _LARGEST and drop >= _LEAST_DROP
    certain = bool(believable and np.ptp(minima) <= _AGREEMENT)
    return Delay(samples=samples, seconds=samples * step, drop=drop, certain=certain)


def _blunted(model: TorqueModel, recording: Recording) -> TorqueModel:
    if not any(isinstance(term, Coulomb) for term in model.terms):
        return model
    tops = top_speeds([recording])
    return model.with_term(Coulomb(widths=tuple((_WIDTH * np.where(tops > 0, tops, 1.0)).tolist())))


def band_residual(
    model: TorqueModel, base: BaseParameters, recording: Recording, processing: Processing, *, lower: float
) -> float:
    """Return the relative residual of a fit between `lower` [Hz] and the processing's cut-off, all joints alike."""
    layout = model.layout(base.independent)
    pieces = list(filtered_rows(model, layout, recording, processing))
    if not pieces:
        raise ModelError("no row of the recording is left to identify from", where=recording.name)
    whole = Rows(*(np.concatenate(parts, axis=-1) for parts in zip(*pieces, strict=True)))
    high = high_pass(lower, (whole.t.size - 1) / float(whole.t[-1] - whole.t[0]))
    detail = whole._replace(columns=filtered(whole.columns, high), tau=filtered(whole.tau, high))
    evidence = evidence_from_rows(layout, base, [detail], most_blocks=1)
    torque = joint_torques(evidence)
    weights = 1.0 / np.where(torque > 0, torque, 1.0)
    values = solve(evidence, weights, ridge=_RIDGE)
    return float(np.linalg.norm(joint_residuals(evidence, values) * weights))


def _vertex(levels: FloatArray) -> tuple[float, float]:
    """Return the lag of the least residual by a parabola through its neighbours, and by what part it falls there."""
    k = int(levels.argmin())
    if k in {0, levels.size - 1}:
        return float(np.copysign(np.inf, LAGS[k])), 0.0
    left, middle, right = levels[k - 1 : k + 2] ** 2
    shift = 0.5 * (left - right) / (left - 2.0 * middle + right)
    least = middle - 0.25 * (left - right) * shift
    at_zero = levels[LAGS.index(0.0)]
    return float(LAGS[k] + shift * (LAGS[1] - LAGS[0])), 1.0 - float(np.sqrt(max(least, 0.0))) / float(at_zero)
