"""Evidence, estimators and the estimate."""

from tauhat.estimation.closed_loop import ClosedLoop, SampledReference
from tauhat.estimation.didim import DirectInverse
from tauhat.estimation.drives import DriveCalibration, DriveGains, WeighedPayload, calibrate_drives
from tauhat.estimation.essential import EssentialLeastSquares, EssentialParameters, EssentialStep, essential_parameters
from tauhat.estimation.estimate import Estimate, InputLog, ParameterRow, load_estimate
from tauhat.estimation.estimators import ESTIMATORS, estimator_named
from tauhat.estimation.evidence import Evidence, collect, collect_all
from tauhat.estimation.hybrid import HybridLeastSquares
from tauhat.estimation.identified_torque import identified_torque
from tauhat.estimation.identify import identify
from tauhat.estimation.idim_iv import InstrumentalVariables
from tauhat.estimation.least_squares import Estimator, OrdinaryLeastSquares, WeightedLeastSquares
from tauhat.estimation.log_survey import LogFacts, LogSurvey, survey_logs
from tauhat.estimation.losses import Bisquare, Cauchy, Huber, Loss
from tauhat.estimation.many_logs import identify_files
from tauhat.estimation.maximum_likelihood import MaximumLikelihood
from tauhat.estimation.output_error import ClosedLoopInputError, ClosedLoopOutputError
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
from tauhat.estimation.prior import PriorLeastSquares, RidgeLeastSquares
from tauhat.estimation.recursive import RecursiveLeastSquares
from tauhat.estimation.residual_learning import LearnedResidual, NetworkSettings, learn_residual, unseen_error
from tauhat.estimation.residual_network import ResidualNetwork
from tauhat.estimation.robust import BisquareLeastSquares, CauchyLeastSquares, HuberLeastSquares
from tauhat.estimation.solution import Solution
from tauhat.estimation.structure import Structure, Trial, select_model
from tauhat.estimation.total_least_squares import TotalLeastSquares
from tauhat.estimation.warm_start import WarmStart, warm_start

__all__ = [
    "ESTIMATORS",
    "Bisquare",
    "BisquareLeastSquares",
    "Body",
    "Box",
    "Cauchy",
    "CauchyLeastSquares",
    "ClosedLoop",
    "ClosedLoopInputError",
    "ClosedLoopOutputError",
    "ConsistentSolution",
    "DirectInverse",
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
    "Huber",
    "HuberLeastSquares",
    "HybridLeastSquares",
    "InputLog",
    "InstrumentalVariables",
    "KnownPayload",
    "LearnedResidual",
    "LinkConstraints",
    "LogFacts",
    "LogSurvey",
    "Loss",
    "MaximumLikelihood",
    "NetworkSettings",
    "OrdinaryLeastSquares",
    "ParameterRow",
    "Payload",
    "PhysicalConstraints",
    "PriorLeastSquares",
    "RecursiveLeastSquares",
    "ResidualNetwork",
    "RidgeLeastSquares",
    "SampledReference",
    "Solution",
    "Structure",
    "TotalLeastSquares",
    "Trial",
    "WarmStart",
    "WeighedPayload",
    "WeightedLeastSquares",
    "calibrate_drives",
    "collect",
    "collect_all",
    "consistent",
    "essential_parameters",
    "estimator_named",
    "identified_torque",
    "identify",
    "identify_files",
    "identify_payload",
    "learn_residual",
    "load_estimate",
    "select_model",
    "survey_logs",
    "unseen_error",
    "warm_start",
]
