"""The chapters of the report, in reading order; each takes the case and returns a section."""

from collections.abc import Callable

from tauhat.report.case import Case, Section
from tauhat.report.motion_case import MotionCase
from tauhat.report.sections.given import given
from tauhat.report.sections.health import health
from tauhat.report.sections.missing import missing
from tauhat.report.sections.motion import motion, seen, spectrum
from tauhat.report.sections.parameters import parameters
from tauhat.report.sections.residual import residual
from tauhat.report.sections.torque import torque
from tauhat.report.sections.verdict import verdict

SECTIONS: tuple[Callable[[Case], Section], ...] = (verdict, given, health, torque, residual, missing, parameters)
MOTION_SECTIONS: tuple[Callable[[MotionCase], Section], ...] = (motion, seen, spectrum)

__all__ = [
    "MOTION_SECTIONS",
    "SECTIONS",
    "given",
    "health",
    "missing",
    "motion",
    "parameters",
    "residual",
    "seen",
    "spectrum",
    "torque",
    "verdict",
]
