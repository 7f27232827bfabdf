"""Proof that a model is right: health of a log against a model, prediction of unseen recordings."""

from tauhat.verification.health import check_recording, power_coherence
from tauhat.verification.prediction import JointError, LogPrediction, Verification, verify

__all__ = ["JointError", "LogPrediction", "Verification", "check_recording", "power_coherence", "verify"]
