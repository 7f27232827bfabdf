"""Robust least squares on a CRS A465: methods, noise, and what a simplified model costs."""

from tauhat.studies.crs_a465.crs_a465_study import CrsA465Study

__all__ = ["CrsA465Study"]
