"""Control laws as pure steps, without plant or clock."""

from tauhat.control.controller import Controller, ControlSample, TrackingController
from tauhat.control.laws import PD, PID, PDFeedforward, PDGravity, TrackingLaw

__all__ = [
    "PD",
    "PID",
    "ControlSample",
    "Controller",
    "PDFeedforward",
    "PDGravity",
    "TrackingController",
    "TrackingLaw",
]
