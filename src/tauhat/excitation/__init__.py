"""Motions that identify: Fourier series from rest to rest inside a robot's limits."""

from tauhat.excitation.fourier import Envelope, FourierSeries, fourier_basis, random_fourier, rest_basis
from tauhat.excitation.limits import MotionLimits, motion_limits
from tauhat.excitation.trajectory import MotionSamples, Trajectory

__all__ = [
    "Envelope",
    "FourierSeries",
    "MotionLimits",
    "MotionSamples",
    "Trajectory",
    "fourier_basis",
    "motion_limits",
    "random_fourier",
    "rest_basis",
]
