"""Rehearsal of an experiment: from description to verified model on simulated robots, before a real one is touched."""

from tauhat.studies.rehearsal.rehearsal_study import RehearsalStudy, sensors_named
from tauhat.studies.rehearsal.trials import NamedSensors

__all__ = ["NamedSensors", "RehearsalStudy", "sensors_named"]
