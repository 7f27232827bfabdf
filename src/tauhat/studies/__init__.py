"""Studies: several identifications beside each other, judged on recordings that none of them saw."""

from tauhat.studies.comparison import Candidate, Comparison, FittedSet, Outcome, compare, compare_sets
from tauhat.studies.gain_rehearsal import Judged, Price, Rehearsal, rehearsal_settings
from tauhat.studies.gain_tuning import GainSearch, TunedGains, tune_gains

__all__ = [
    "Candidate",
    "Comparison",
    "FittedSet",
    "GainSearch",
    "Judged",
    "Outcome",
    "Price",
    "Rehearsal",
    "TunedGains",
    "compare",
    "compare_sets",
    "rehearsal_settings",
    "tune_gains",
]
