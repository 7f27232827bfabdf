"""Settings that only the recordings can tell: filters, source of velocity, delay, shapes of terms.

Each is chosen by the residual that the model leaves on the recordings that are fitted, over a short list of candidates;
none of them adds a free parameter. Judged is the mean over the joints of the logarithm of the residual, so that a small
joint counts as much as a large one.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from tauhat.dynamics.base import BaseParameters, base_parameters
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.terms import Facts, Shaped
from tauhat.errors import TauhatWarning
from tauhat.estimation.delay import position_delay
from tauhat.estimation.evidence import Gather, gathering
from tauhat.estimation.iterating import first_loaded
from tauhat.estimation.least_squares import WeightedLeastSquares
from tauhat.estimation.problem import Problem
from tauhat.estimation.rows_by_term import RowsByTerm
from tauhat.estimation.shape_uncertainty import nearer_shapes
from tauhat.estimation.shapes import chosen_form
from tauhat.estimation.solution import joint_residuals
from tauhat.recordings.choice import MOTION_CUTOFF, choose_processing, top_speeds
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording

MOST_SAMPLES = 20_000  # settings are chosen on so many samples at most
_FEWEST_ROWS = 1000  # of a recording in that sample
_SWEEPS = 2  # over the terms that have a shape: what one takes depends on the others
_STEPS = 3  # of Gauss and Newton, from the grid to the best shapes
_LEAST_GAIN = 0.02  # a candidate must leave that much less residual to replace the default


def tuned(
    model: TorqueModel,
    recordings: Sequence[Recording],
    *,
    processing: Processing | None = None,
    cutoff: float | None = None,
) -> tuple[TorqueModel, Processing]:
    """Return the model with its shapes chosen, and the processing for it.

    Parameters
    ----------
    processing : taken as it is when given; only shapes of terms are then chosen
    cutoff : low-pass of torque and columns [Hz]; chosen from the spectrum by default

    Warns
    -----
    TauhatWarning
        when the position is late against the torque and that is compensated.
    """
    sample = _shortened(recordings)
    if processing is not None:
        return tuned_through(model, sample, processing), processing
    return tuned_from(model, sample, choose_processing(recordings, cutoff=cutoff))


def tuned_through(model: TorqueModel, sample: Sequence[Recording], processing: Processing) -> TorqueModel:
    """Return the model with its shapes chosen on a sample of the recordings, through filters that are settled."""
    model = first_loaded(_informed(model, sample), sample, processing, WeightedLeastSquares())
    return _shaped(model, base_parameters(model), sample, RowsByTerm(sample, processing))


def tuned_from(model: TorqueModel, sample: Sequence[Recording], settings: Processing) -> tuple[TorqueModel, Processing]:
    """Return the model with its shapes, and filters with their delay and source of velocity, chosen on a sample.

    Parameters
    ----------
    settings : filters to begin with; their low-pass is kept

    Warns
    -----
    TauhatWarning
        when the position is late against the torque and that is compensated.
    """
    model = first_loaded(_informed(model, sample), sample, settings, WeightedLeastSquares())
    base = base_parameters(model)
    rows = RowsByTerm(sample, settings)
    shaped = _shaped(model, base, sample, rows)
    delay = position_delay(shaped, base, sample, settings)
    if delay.certain:
        settings = replace(settings, delay=delay.seconds)
        warnings.warn(
            f"{delay.words}: compensated",
            TauhatWarning,
            stacklevel=4,
        )
    settings = _best_processing(shaped, base, sample, settings)
    if settings == rows.processing:
        return shaped, settings
    return _shaped(model, base, sample, RowsByTerm(sample, settings)), settings


def _residual_level(model: TorqueModel, base: BaseParameters, gather: Gather) -> float:
    """Return the mean logarithm of the joints' residuals after a weighted fit: what candidates are judged by."""
    evidence = gather(model, base, 1)
    residuals = joint_residuals(evidence, WeightedLeastSquares(passes=1).solve(evidence).values)
    return float(np.mean(np.log(np.maximum(residuals, np.finfo(float).tiny))))


def sampled_rows(lengths: Sequence[int]) -> dict[int, int]:
    """Return how many leading rows of which recordings settings are chosen on, in proportion, `MOST_SAMPLES` in all.

    Of each a thousand rows are needed to show anything, so that of more than twenty long ones twenty stand for all.

    Parameters
    ----------
    lengths : samples of each recording
    """
    if sum(lengths) <= MOST_SAMPLES:
        return dict(enumerate(lengths))
    places = np.linspace(0, len(lengths) - 1, min(len(lengths), MOST_SAMPLES // _FEWEST_ROWS)).round().astype(int)
    taken = {int(place): lengths[place] for place in places}
    share = min(1.0, MOST_SAMPLES / sum(taken.values()))
    return {place: min(length, max(_FEWEST_ROWS, int(share * length))) for place, length in taken.items()}


def _shortened(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Return the sample of the recordings that settings are chosen on."""
    rows = sampled_rows([recording.n_t for recording in recordings])
    return tuple(
        recordings[place] if count == recordings[place].n_t else recordings[place].rows(0, count)
        for place, count in rows.items()
    )


def _informed(model: TorqueModel, recordings: Sequence[Recording]) -> TorqueModel:
    """Return the model with what the recordings tell before any fit: all but shapes that are still open."""
    facts = _facts(recordings)
    for term in model.terms:
        forms = term.candidates(facts)
        model = model.with_term(forms[0] if len(forms) == 1 else term.informed(facts))
    return model


def _facts(recordings: Sequence[Recording]) -> Facts:
    shared = next((recording.shared_motors for recording in recordings if recording.shared_motors), ())
    means = [recording.temperature.mean(axis=0) for recording in recordings if recording.temperature is not None]
    return Facts(top_speeds(recordings), shared, np.mean(means, axis=0) if len(means) == len(recordings) else None)


def _shaped(model: TorqueModel, base: BaseParameters, recordings: Sequence[Recording], rows: RowsByTerm) -> TorqueModel:
    """Return the model with every open shape chosen; terms are visited in turn until none of them changes."""
    facts = _facts(recordings)
    open_terms = [every for term in model.terms if len(every := term.candidates(facts)) > 1]
    choices = [[form for form in forms if isinstance(form, Shaped)] for forms in open_terms]
    for _ in range(_SWEEPS if len(choices) > 1 else 1):
        before = model.terms
        for forms in choices:
            model = model.with_term(chosen_form(model, base, forms, rows.gather))
        if model.terms == before:
            break
    return _refined(model, base, {forms[0].key for forms in choices}, rows)


def _refined(model: TorqueModel, base: BaseParameters, keys: Collection[str], rows: RowsByTerm) -> TorqueModel:
    """Return the model with the shapes of the terms `keys` taken off the grid, as long as that lowers the residual."""
    level = _residual_level(model, base, rows.gather) if keys else 0.0
    for _ in range(_STEPS if keys else 0):
        evidence = rows.gather(model, base, 1)
        problem = Problem(
            model=model, base=base, recordings=(), processing=rows.processing, evidence=evidence, gather=rows.gather
        )
        moved = nearer_shapes(problem, WeightedLeastSquares().fit(evidence), keys)
        nearer = _residual_level(moved, base, rows.gather)
        if not nearer < level:
            break
        model, level = moved, nearer
    return model


def _best_processing(
    model: TorqueModel, base: BaseParameters, recordings: Sequence[Recording], default: Processing
) -> Processing:
    """Return the best source of velocity and cut-off of the position; the default unless another is clearly better."""
    narrow = default.motion_cutoff / MOTION_CUTOFF
    candidates = [replace(default, motion_cutoff=narrow)]
    if all(recording.dq is not None for recording in recordings):
        candidates += [replace(default, velocity="velocity", motion_cutoff=narrow)]
        candidates += [replace(default, velocity="velocity")]
    best, level = default, _residual_level(model, base, gathering(recordings, default))
    for candidate in candidates:
        other = _residual_level(model, base, gathering(recordings, candidate))
        if other < level - _LEAST_GAIN:
            best, level = candidate, other
    return best
