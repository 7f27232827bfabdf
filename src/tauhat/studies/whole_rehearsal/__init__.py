"""One arm rehearsed from its description to a proved model: every method of the library in turn, on one page."""

from tauhat.studies.whole_rehearsal.whole_rehearsal_study import WholeRehearsalStudy

__all__ = ["WholeRehearsalStudy"]
