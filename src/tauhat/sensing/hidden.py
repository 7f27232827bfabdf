"""For how long the joints did not tell a direction of the wrench: singular positions along a log."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.sensing.sensed_log import SensedLog
from tauhat.sensing.wrench import COMPONENTS, WrenchSolver

_LOOKED_AT = 2000  # samples, evenly over the log: a share to a hundredth


class Hidden(NamedTuple):
    """Directions of the wrench that were hidden.

    share : of the time in which at least one was
    parts : (6,) of each component, the mean part of it that lay in hidden directions, 0 to 1
    """

    share: float
    parts: FloatArray

    @property
    def mostly(self) -> tuple[str, ...]:
        """Components that were hidden most: those with at least half of the largest part."""
        top = float(self.parts.max())
        return tuple(name for name, part in zip(COMPONENTS, self.parts, strict=True) if top > 0.0 and part >= top / 2.0)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"share": self.share, "parts": dict(zip(COMPONENTS, self.parts.tolist(), strict=True))}


def hidden_along(sensed: SensedLog, solver: WrenchSolver) -> Hidden:
    """Return for how much of a log which directions were hidden, by the rule of `WrenchSolver.hidden`.

    Parameters
    ----------
    solver : of the log's wrench
    """
    settled = np.flatnonzero(sensed.settled)
    if not settled.size:
        return Hidden(0.0, np.zeros(len(COMPONENTS)))
    rows = settled[np.unique(np.linspace(0, settled.size - 1, min(_LOOKED_AT, settled.size)).astype(np.intp))]
    found = [solver.hidden(covariance) for covariance in sensed.solved_by(solver, rows).covariance]
    share = float(np.mean([directions.shape[1] > 0 for directions in found]))
    return Hidden(share, np.mean([np.square(directions).sum(axis=1) for directions in found], axis=0))
