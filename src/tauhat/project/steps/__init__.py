"""The steps of a project, one file each."""

from tauhat.project.steps.sequence import steps_of

__all__ = ["steps_of"]
