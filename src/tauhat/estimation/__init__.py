"""Evidence, estimators and the estimate."""

from tauhat.estimation.estimate import Estimate, InputLog, ParameterRow, load_estimate
from tauhat.estimation.evidence import Evidence, collect, collect_all
from tauhat.estimation.identify import identify
from tauhat.estimation.least_squares import (
    ESTIMATORS,
    Estimator,
    OrdinaryLeastSquares,
    WeightedLeastSquares,
    estimator_named,
)
from tauhat.estimation.solution import Solution

__all__ = [
    "ESTIMATORS",
    "Estimate",
    "Estimator",
    "Evidence",
    "InputLog",
    "OrdinaryLeastSquares",
    "ParameterRow",
    "Solution",
    "WeightedLeastSquares",
    "collect",
    "collect_all",
    "estimator_named",
    "identify",
    "load_estimate",
]
