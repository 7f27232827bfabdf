"""Which ends of a method are bad ones by its own word."""

from __future__ import annotations

from tauhat.estimation.filters.outcome import Recursion
from tauhat.estimation.least_squares import Estimator
from tauhat.estimation.simulating import SimulationEstimator
from tauhat.estimation.total_least_squares import TotalLeastSquares

_DOUBTFUL = (Recursion, SimulationEstimator, TotalLeastSquares)  # whose advice means that the end is no good one


def bad_end(method: Estimator, *, cause: str, advice: str) -> str:
    """Return why a method says itself that it did not end well (diverged, not settled); empty where it did.

    Parameters
    ----------
    cause, advice : why it stopped and what to do about it, as its solution has them
    """
    return cause if advice and isinstance(method, _DOUBTFUL) else ""
