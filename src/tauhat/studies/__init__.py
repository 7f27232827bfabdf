"""Studies: several identifications beside each other, judged on recordings that none of them saw."""

from tauhat.studies.comparison import Candidate, Comparison, Outcome, compare
from tauhat.studies.gain_rehearsal import Judged, Price, Rehearsal, rehearsal_settings
from tauhat.studies.gain_tuning import GainSearch, TunedGains, tune_gains

__all__ = [
    "Candidate",
    "Comparison",
    "GainSearch",
    "Judged",
    "Outcome",
    "Price",
    "Rehearsal",
    "TunedGains",
    "compare",
    "rehearsal_settings",
    "tune_gains",
]
