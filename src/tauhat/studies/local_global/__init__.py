"""Local against global calibration: models fitted where the work is, judged there and elsewhere."""

from tauhat.studies.local_global.local_global_study import LocalGlobalStudy

__all__ = ["LocalGlobalStudy"]
