"""Proof that a model is right: health of a log, prediction with bands, what residuals still hold, static torque."""

from tauhat.verification.bands import PredictionBand
from tauhat.verification.health import check_axes, check_recording, power_coherence
from tauhat.verification.joint_search import Effect
from tauhat.verification.known_payload import KnownNumber, PayloadCheck, check_payload
from tauhat.verification.motion_forward import ForwardMotion, ForwardRun, forward_motion
from tauhat.verification.motion_tracking import (
    Contender,
    TrackingComparison,
    TrackingRun,
    compare_tracking,
    tracking_contenders,
)
from tauhat.verification.prediction import JointError, LogPrediction, Verification, verify
from tauhat.verification.residual_tests import JointResidual, LogResiduals, residual_tests
from tauhat.verification.static import StaticCheck, StaticJoint, StaticPair, static_check
from tauhat.verification.truth import TruthComparison, compare_with_truth, standard_parameters
from tauhat.verification.whiteness import Whiteness

__all__ = [
    "Contender",
    "Effect",
    "ForwardMotion",
    "ForwardRun",
    "JointError",
    "JointResidual",
    "KnownNumber",
    "LogPrediction",
    "LogResiduals",
    "PayloadCheck",
    "PredictionBand",
    "StaticCheck",
    "StaticJoint",
    "StaticPair",
    "TrackingComparison",
    "TrackingRun",
    "TruthComparison",
    "Verification",
    "Whiteness",
    "check_axes",
    "check_payload",
    "check_recording",
    "compare_tracking",
    "compare_with_truth",
    "forward_motion",
    "power_coherence",
    "residual_tests",
    "standard_parameters",
    "static_check",
    "tracking_contenders",
    "verify",
]
