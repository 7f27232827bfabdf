"""Estimators that go through a recording in time: Kalman filters, neural recursions, the adaptive parallel model."""

from tauhat.estimation.filters.adaptive import AdaptiveInputError, InputError, ParallelModel, ParallelState
from tauhat.estimation.filters.beginning import Beginning, Diffuse, FirstStretch, Given, Nominal
from tauhat.estimation.filters.forms import CovarianceForm, PlainCovariance, SquareRoot
from tauhat.estimation.filters.parameter_filter import ParameterKalman
from tauhat.estimation.filters.recursions import Adaline, HopfieldTank
from tauhat.estimation.filters.spreading import CentralDifference, Extended, Spreading, Unscented
from tauhat.estimation.filters.state_filter import (
    CentralDifferenceKalman,
    SquareRootCentralDifferenceKalman,
    SquareRootExtendedKalman,
    SquareRootUnscentedKalman,
    StateKalman,
    UnscentedKalman,
)
from tauhat.estimation.filters.state_plan import StateNoise
from tauhat.estimation.filters.steps import Belief, Innovation, InnovationTest, KalmanFilter

__all__ = [
    "Adaline",
    "AdaptiveInputError",
    "Beginning",
    "Belief",
    "CentralDifference",
    "CentralDifferenceKalman",
    "CovarianceForm",
    "Diffuse",
    "Extended",
    "FirstStretch",
    "Given",
    "HopfieldTank",
    "Innovation",
    "InnovationTest",
    "InputError",
    "KalmanFilter",
    "Nominal",
    "ParallelModel",
    "ParallelState",
    "ParameterKalman",
    "PlainCovariance",
    "Spreading",
    "SquareRoot",
    "SquareRootCentralDifferenceKalman",
    "SquareRootExtendedKalman",
    "SquareRootUnscentedKalman",
    "StateKalman",
    "StateNoise",
    "Unscented",
    "UnscentedKalman",
]
