"""Proof that a model is right: health of a log, prediction with bands, what residuals still hold, static torque."""

from tauhat.verification.bands import PredictionBand
from tauhat.verification.health import check_axes, check_recording, power_coherence
from tauhat.verification.joint_search import Effect
from tauhat.verification.prediction import JointError, LogPrediction, Verification, verify
from tauhat.verification.residual_tests import JointResidual, LogResiduals, residual_tests
from tauhat.verification.truth import TruthComparison, compare_with_truth, standard_parameters
from tauhat.verification.whiteness import Whiteness

__all__ = [
    "Effect",
    "JointError",
    "JointResidual",
    "LogPrediction",
    "LogResiduals",
    "PredictionBand",
    "TruthComparison",
    "Verification",
    "Whiteness",
    "check_axes",
    "check_recording",
    "compare_with_truth",
    "power_coherence",
    "residual_tests",
    "standard_parameters",
    "verify",
]
