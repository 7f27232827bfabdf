"""Polishing in simulation: a force loop closed on the virtual sensor, on a load cell, and on nothing."""

from tauhat.studies.polishing.polishing_study import PolishingStudy

__all__ = ["PolishingStudy"]
