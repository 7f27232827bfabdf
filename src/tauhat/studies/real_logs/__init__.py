"""The study of models and estimators on logs of real robots, each judged on logs that were not fitted."""

from tauhat.studies.real_logs.case_file import RealCase, load_cases
from tauhat.studies.real_logs.fitting import CaseFit
from tauhat.studies.real_logs.real_logs_study import RealLogsStudy
from tauhat.studies.real_logs.standings import Standing, standings_of

__all__ = [
    "CaseFit",
    "RealCase",
    "RealLogsStudy",
    "Standing",
    "load_cases",
    "standings_of",
]
