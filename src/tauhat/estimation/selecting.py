"""Identification of the model that cross-validation chooses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from tauhat.dynamics.model import TorqueModel
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.identify import identify
from tauhat.estimation.least_squares import Estimator
from tauhat.estimation.physical_constraints import PhysicalConstraints
from tauhat.estimation.structure import select_model
from tauhat.recordings.recording import Recording


def identify_selected(
    model: TorqueModel,
    recordings: Sequence[Recording],
    *,
    estimator: Estimator | None = None,
    cutoff: float | None = None,
    constraints: PhysicalConstraints | None = None,
) -> Estimate:
    """Return the estimate of the model with terms added and dropped where that predicts unseen data better.

    Parameters
    ----------
    model : to start from, usually the robust one
    estimator, cutoff, constraints : as `identify`

    Raises
    ------
    RecordingError, ModelError
        as `identify`.
    """
    chosen = select_model(model, recordings, estimator=estimator, cutoff=cutoff)
    estimate = identify(
        chosen.model, recordings, estimator=estimator, processing=chosen.processing, constraints=constraints
    )
    return replace(estimate, structure=chosen.structure)
