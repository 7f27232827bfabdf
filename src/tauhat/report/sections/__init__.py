"""The chapters of the report, in reading order; each takes the case and returns a section."""

from collections.abc import Callable

from tauhat.report.case import Case, Section
from tauhat.report.sections.given import given
from tauhat.report.sections.health import health
from tauhat.report.sections.parameters import parameters
from tauhat.report.sections.residual import residual
from tauhat.report.sections.torque import torque
from tauhat.report.sections.verdict import verdict

SECTIONS: tuple[Callable[[Case], Section], ...] = (verdict, given, health, torque, residual, parameters)

__all__ = ["SECTIONS", "given", "health", "parameters", "residual", "torque", "verdict"]
