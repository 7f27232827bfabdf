"""Every estimator by its name."""

from __future__ import annotations

from tauhat.errors import ModelError
from tauhat.estimation.didim import DirectInverse
from tauhat.estimation.filters import (
    Adaline,
    AdaptiveInputError,
    CentralDifferenceKalman,
    HopfieldTank,
    ParameterKalman,
    SquareRootCentralDifferenceKalman,
    SquareRootExtendedKalman,
    SquareRootUnscentedKalman,
    StateKalman,
    UnscentedKalman,
)
from tauhat.estimation.hybrid import HybridLeastSquares
from tauhat.estimation.idim_iv import InstrumentalVariables
from tauhat.estimation.least_squares import Estimator, OrdinaryLeastSquares, WeightedLeastSquares
from tauhat.estimation.maximum_likelihood import MaximumLikelihood
from tauhat.estimation.output_error import ClosedLoopInputError, ClosedLoopOutputError
from tauhat.estimation.prior import PriorLeastSquares, RidgeLeastSquares
from tauhat.estimation.recursive import RecursiveLeastSquares
from tauhat.estimation.robust import BisquareLeastSquares, CauchyLeastSquares, HuberLeastSquares
from tauhat.estimation.sequential import SequentialLeastSquares
from tauhat.estimation.total_least_squares import TotalLeastSquares

_METHODS: tuple[type[Estimator], ...] = (
    OrdinaryLeastSquares,
    WeightedLeastSquares,
    CauchyLeastSquares,
    HuberLeastSquares,
    BisquareLeastSquares,
    TotalLeastSquares,
    RidgeLeastSquares,
    PriorLeastSquares,
    MaximumLikelihood,
    RecursiveLeastSquares,
    HybridLeastSquares,
    InstrumentalVariables,
    DirectInverse,
    ClosedLoopOutputError,
    ClosedLoopInputError,
    ParameterKalman,
    StateKalman,
    SquareRootExtendedKalman,
    UnscentedKalman,
    SquareRootUnscentedKalman,
    CentralDifferenceKalman,
    SquareRootCentralDifferenceKalman,
    Adaline,
    HopfieldTank,
    AdaptiveInputError,
    SequentialLeastSquares,
)
ESTIMATORS: dict[str, type[Estimator]] = {method.key: method for method in _METHODS}
"""Every estimator by its name."""


def estimator_named(key: str) -> Estimator:
    """Return the estimator of this name in its default settings.

    Raises
    ------
    ModelError
        when there is none.
    """
    if key not in ESTIMATORS:
        raise ModelError("unknown estimator", expected=", ".join(ESTIMATORS), got=key)
    return ESTIMATORS[key]()
