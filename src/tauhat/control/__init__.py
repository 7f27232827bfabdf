"""Control laws as pure steps, without plant or clock."""

from tauhat.control.adaptive import AdaptiveTracking, Learnt, learning_along
from tauhat.control.controller import Controller, ControlSample, TrackingController
from tauhat.control.disturbed import NoisySight, Watched, noisy_sight
from tauhat.control.laws import PD, PID, PDFeedforward, PDGravity, TrackingLaw
from tauhat.control.model_laws import ComputedTorque, ModelFeedforward, computed_torque
from tauhat.control.model_torque import FrictionMemory, JointState, ModelTorque, model_torque, nominal_torque
from tauhat.control.tracking_regressor import TrackingRegressor, tracking_regressor

__all__ = [
    "PD",
    "PID",
    "AdaptiveTracking",
    "ComputedTorque",
    "ControlSample",
    "Controller",
    "FrictionMemory",
    "JointState",
    "Learnt",
    "ModelFeedforward",
    "ModelTorque",
    "NoisySight",
    "PDFeedforward",
    "PDGravity",
    "TrackingController",
    "TrackingLaw",
    "TrackingRegressor",
    "Watched",
    "computed_torque",
    "learning_along",
    "model_torque",
    "noisy_sight",
    "nominal_torque",
    "tracking_regressor",
]
