"""Proof that a model is right: health of a log against a model, prediction of unseen recordings."""

from tauhat.verification.health import check_axes, check_recording, power_coherence
from tauhat.verification.prediction import JointError, LogPrediction, Verification, verify
from tauhat.verification.truth import TruthComparison, compare_with_truth, standard_parameters

__all__ = [
    "JointError",
    "LogPrediction",
    "TruthComparison",
    "Verification",
    "check_axes",
    "check_recording",
    "compare_with_truth",
    "power_coherence",
    "standard_parameters",
    "verify",
]
