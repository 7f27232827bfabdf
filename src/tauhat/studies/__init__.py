"""Studies: several identifications beside each other, judged on recordings that none of them saw."""

from tauhat.studies.comparison import Candidate, Comparison, Outcome, compare

__all__ = ["Candidate", "Comparison", "Outcome", "compare"]
