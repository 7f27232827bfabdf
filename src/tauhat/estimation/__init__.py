"""Evidence, estimators and the estimate."""

from tauhat.estimation.drives import DriveCalibration, DriveGains, WeighedPayload, calibrate_drives
from tauhat.estimation.essential import EssentialLeastSquares, EssentialParameters, EssentialStep, essential_parameters
from tauhat.estimation.estimate import Estimate, InputLog, ParameterRow, load_estimate
from tauhat.estimation.estimators import ESTIMATORS, estimator_named
from tauhat.estimation.evidence import Evidence, collect, collect_all
from tauhat.estimation.identify import identify
from tauhat.estimation.least_squares import Estimator, OrdinaryLeastSquares, WeightedLeastSquares
from tauhat.estimation.payload import KnownPayload, Payload, identify_payload
from tauhat.estimation.payload_body import Body
from tauhat.estimation.physical import ConsistentSolution, consistent
from tauhat.estimation.physical_constraints import (
    Box,
    Ellipsoid,
    EntropicPull,
    GaussianPull,
    LinkConstraints,
    PhysicalConstraints,
)
from tauhat.estimation.solution import Solution
from tauhat.estimation.structure import Structure, Trial, select_model

__all__ = [
    "ESTIMATORS",
    "Body",
    "Box",
    "ConsistentSolution",
    "DriveCalibration",
    "DriveGains",
    "Ellipsoid",
    "EntropicPull",
    "EssentialLeastSquares",
    "EssentialParameters",
    "EssentialStep",
    "Estimate",
    "Estimator",
    "Evidence",
    "GaussianPull",
    "InputLog",
    "KnownPayload",
    "LinkConstraints",
    "OrdinaryLeastSquares",
    "ParameterRow",
    "Payload",
    "PhysicalConstraints",
    "Solution",
    "Structure",
    "Trial",
    "WeighedPayload",
    "WeightedLeastSquares",
    "calibrate_drives",
    "collect",
    "collect_all",
    "consistent",
    "essential_parameters",
    "estimator_named",
    "identify",
    "identify_payload",
    "load_estimate",
    "select_model",
]
