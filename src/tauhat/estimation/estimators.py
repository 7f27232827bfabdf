"""Every estimator by its name."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from tauhat.errors import ModelError
from tauhat.estimation.closed_loop import ClosedLoop
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
from tauhat.estimation.simulating import SimulationEstimator
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


SIMULATING: tuple[str, ...] = tuple(
    key for key, method in ESTIMATORS.items() if issubclass(method, SimulationEstimator)
)
"""Names of those that simulate the recorded robot, and its controller with it."""


def estimator_named(key: str, *, loop: ClosedLoop | None = None) -> Estimator:
    """Return the estimator of this name in its default settings.

    Parameters
    ----------
    loop : how the recorded robot was driven, for an estimator that simulates it

    Raises
    ------
    ModelError
        when there is none, or it does not simulate and gets a loop.
    """
    if key not in ESTIMATORS:
        raise ModelError("unknown estimator", expected=", ".join(ESTIMATORS), got=key)
    method = ESTIMATORS[key]()
    if loop is None:
        return method
    check_simulating([key])
    return replace(method, loop=loop) if isinstance(method, SimulationEstimator) else method


def check_simulating(keys: Iterable[str]) -> None:
    """Check that one of these estimators at least simulates, and so has a use for a controller.

    Raises
    ------
    ModelError
        when none does.
    """
    given = list(keys)
    if not set(given) & set(SIMULATING):
        raise ModelError(
            "a controller is for estimators that simulate the robot", expected=", ".join(SIMULATING),
            got=", ".join(given),
        )  # fmt: skip
