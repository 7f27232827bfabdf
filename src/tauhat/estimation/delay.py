"""Delay between torque and position, found by the lag at which the model fits best.

A log often carries its channels a sample apart. The fit's residual over the lag of the position is a parabola around
the true lag, but model error at low frequency shifts it. It is therefore scanned in three bands of frequency, and only
believed when all three agree.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

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

SPAN = np.arange(-4.0, 4.5)  # of one scan, in parts of its spacing
_FINE, _COARSE = 0.5, 2.0  # [samples] spacing of the scans
_BANDS = ((0.04, 0.4), (0.06, 0.6), (0.1, 1.0))  # lower and upper frequency, in parts of the cut-off
_MOTION = 3.0  # cut-off of the position over the upper frequency
_WIDTH = 0.03  # of the smooth sign in the scan, in parts of the top speed: a sharp one hides the lag
_SMALLEST, _LARGEST = 0.4, 1.2  # [samples] lags that are acted on
_EVIDENT_DROP = 0.2  # of the residual, from which a longer lag is acted on, too
_AGREEMENT = 0.4  # [samples] between the bands
_LEAST_DROP = 0.04  # of the residual, in every band
_MOST_SAMPLES = 8_000
_RIDGE = 1e-6  # offsets vanish in a band: their columns are nearly zero


@dataclass(frozen=True, slots=True, kw_only=True)
class Delay:
    """How much later than the torque the position is logged.

    samples, seconds : the lag at which the fit is best, median of the bands; infinite where none was found
    drop : by what part the residual falls at that lag, in the band where it falls least
    agreed : whether all bands agree on a lag of at least 0.4 samples that lowers the residual by 4 %
    certain : agreed, and either at most 1.2 samples, the usual fault of a logger, or lowering the residual by 20 %
    """

    samples: float
    seconds: float
    drop: float
    agreed: bool
    certain: bool

    @property
    def words(self) -> str:
        """The delay in words: which is late against which, and by how much."""
        late = "position is late against the torque" if self.samples > 0 else "torque is late against the position"
        return f"{late} by {abs(self.seconds) * 1e3:.2g} ms ({abs(self.samples):.2g} samples)"


def position_delay(
    model: TorqueModel, base: BaseParameters, recordings: Sequence[Recording], processing: Processing
) -> Delay:
    """Return the delay of the position against the torque; the longest recording is scanned, at most 8 samples far."""
    recording = max(recordings, key=lambda item: item.n_t)
    recording = recording.rows(0, min(recording.n_t, _MOST_SAMPLES))
    scanned = _blunted(model, recording)
    scan = partial(_scan, scanned, base, recording, processing)
    minima, drops = scan(centre=0.0, spacing=_FINE)
    one_sided = np.isinf(minima).all() and abs(np.sign(minima).sum()) == len(_BANDS)
    if one_sided and drops.min() >= _LEAST_DROP:
        minima, drops = scan(centre=0.0, spacing=_COARSE)
        if np.isfinite(minima).all():
            minima, drops = scan(centre=round(float(np.median(minima))), spacing=_FINE)
    samples, drop = float(np.median(minima)), float(drops.min())
    sizes = np.abs(minima)
    close = bool(np.isfinite(sizes).all() and np.ptp(minima) <= _AGREEMENT)
    agreed = close and sizes.min() >= _SMALLEST and drop >= _LEAST_DROP
    certain = agreed and (sizes.max() <= _LARGEST or drop >= _EVIDENT_DROP)
    seconds = samples * clock_step(recording)
    return Delay(samples=samples, seconds=seconds, drop=drop, agreed=bool(agreed), certain=bool(certain))


def _scan(
    model: TorqueModel,
    base: BaseParameters,
    recording: Recording,
    processing: Processing,
    *,
    centre: float,
    spacing: float,
) -> tuple[FloatArray, FloatArray]:
    """Return for each band the best lag around `centre` [samples] and by what part the residual falls there.

    The scan ends at the first band in which it hardly falls: the bands cannot agree any more.
    """
    lags = centre + spacing * SPAN
    found = []
    for lower, upper in _BANDS:
        cutoff = upper * processing.cutoff
        settings = Processing(cutoff=cutoff, motion_cutoff=_MOTION * cutoff)
        step = clock_step(recording)
        levels = [
            band_residual(model, base, recording, replace(settings, delay=lag * step), lower=lower * processing.cutoff)
            for lag in (0.0, *lags)
        ]
        found.append(_vertex(lags, np.array(levels[1:]), at_zero=levels[0]))
        if found[-1][1] < _LEAST_DROP:
            break
    return np.array([lag for lag, _ in found]), np.array([drop for _, drop in found])


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


def _vertex(lags: FloatArray, levels: FloatArray, *, at_zero: float) -> tuple[float, float]:
    """Return the lag of the least residual by a parabola through its neighbours, and by what part it falls there."""
    k = int(levels.argmin())
    if k in {0, levels.size - 1}:
        return float(np.copysign(np.inf, k - 1)), 1.0 - float(levels[k]) / at_zero
    left, middle, right = levels[k - 1 : k + 2] ** 2
    shift = 0.5 * (left - right) / (left - 2.0 * middle + right)
    least = middle - 0.25 * (left - right) * shift
    return float(lags[k] + shift * (lags[1] - lags[0])), 1.0 - float(np.sqrt(max(least, 0.0))) / at_zero
