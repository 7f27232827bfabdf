"""Study of the virtual force sensor: known contact forces on simulated arms, cold and warm."""

from tauhat.studies.force_sensing.force_sensing_study import ForceSensingStudy

__all__ = ["ForceSensingStudy"]
