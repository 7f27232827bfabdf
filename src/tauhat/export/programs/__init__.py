"""Planned motions as programs for real controllers, and read back: URScript, KRL, RAPID, FANUC LS, via-point tables."""

from tauhat.export.programs.dialect import DIALECTS, Dialect, program_named
from tauhat.export.programs.program import ControllerJoints, Program, ProgramSettings, ProgramText, signed_joints
from tauhat.export.programs.task_programs import language_of, sayable, task_program

__all__ = [
    "DIALECTS",
    "ControllerJoints",
    "Dialect",
    "Program",
    "ProgramSettings",
    "ProgramText",
    "language_of",
    "program_named",
    "sayable",
    "signed_joints",
    "task_program",
]
