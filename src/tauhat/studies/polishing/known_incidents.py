"""The incidents of the study, and how a job may end in each."""

from __future__ import annotations

import numpy as np

from tauhat.control.force.reading import Reason
from tauhat.studies.polishing.incidents import Incident, MovedSurface, OtherSkin, SoftSpot
from tauhat.studies.polishing.sample_faults import Frozen, Lost, Negated, Replaced, Scattered, WiderBar

_DONE: tuple[Reason, ...] = ("",)
_LOST: tuple[Reason, ...] = ("contact_lost",)
_ELSEWHERE: tuple[Reason, ...] = ("surface_misplaced",)
_TOO_MUCH: tuple[Reason, ...] = ("force_limit",)
_MISSING: tuple[Reason, ...] = ("reading_missing",)
_INVALID: tuple[Reason, ...] = ("reading_invalid",)
_FROZEN: tuple[Reason, ...] = ("reading_frozen",)
_UNTRUSTED: tuple[Reason, ...] = ("untrusted",)
_ROW = ("t", "q", "tau", "load_cell")

OF_THE_WORKPIECE: tuple[Incident, ...] = (
    SoftSpot(name="contact lost for good", ends=_LOST, length=1.0, edge=0.1),
    SoftSpot(name="contact lost over 2 mm", ends=_DONE, length=2e-3, edge=5e-3),
    OtherSkin(name="skin five times as stiff", ends=_DONE, before=2e4, behind=1e5),
    OtherSkin(name="skin a fifth as stiff", ends=_DONE, behind=2e4),
    MovedSurface(name="workpiece 9 mm too high", ends=_ELSEWHERE, raised=9e-3),
    MovedSurface(name="workpiece 16 mm too low", ends=_ELSEWHERE, raised=-16e-3),
    MovedSurface(name="workpiece falls by 1 in 10", ends=_DONE, tilted=0.1),
    MovedSurface(name="workpiece rises by 1 in 10", ends=_DONE, tilted=-0.1),
    MovedSurface(name="workpiece rises by 1 in 5", ends=_TOO_MUCH, raised=3e-3, tilted=-0.2),
)
"""The sensor sees them, late; slopes are for the short path of `meeting.short_work`."""
OF_THE_SAMPLES: tuple[Incident, ...] = (
    Frozen(name="samples freeze, stamps go on", ends=_MISSING, by_load_cell=_FROZEN),
    Frozen(name="the same row again and again", ends=_MISSING, by_load_cell=_FROZEN, parts=_ROW),
    Frozen(name="torque freezes", ends=_MISSING, by_load_cell=_FROZEN, parts=("tau", "load_cell")),
    Frozen(name="positions freeze", ends=_MISSING, by_load_cell=_DONE, parts=("q",)),
    Frozen(name="samples freeze on the way down", ends=_MISSING, by_load_cell=_FROZEN, moment="approach"),
    Frozen(name="samples freeze at first contact", ends=_MISSING, by_load_cell=_FROZEN, moment="contact"),
    Replaced(name="torque is not a number", ends=_MISSING, by_load_cell=_INVALID, value=np.nan),
    Replaced(name="torque is 1e12", ends=_MISSING, by_load_cell=_TOO_MUCH, value=1e12),
    Replaced(name="torque is 1e8, once", ends=_TOO_MUCH, value=1e8, count=1),
    Replaced(name="every other torque is no number", ends=_MISSING, by_load_cell=_INVALID, value=np.nan, good=1),
    Replaced(name="one torque in twenty is no number", ends=_DONE, value=np.nan, good=19),
    Scattered(name="random torque of 100 Nm", ends=_TOO_MUCH, width=100.0),
    Scattered(name="five random samples in fifty", ends=_TOO_MUCH + _DONE, width=100.0, bad=5, good=45),
    Scattered(name="noise of 10 Nm", ends=_DONE, width=10.0, about=1.0),
    Negated(name="torque of the other sign", ends=_TOO_MUCH, by_load_cell=_LOST),
    Negated(name="torque of the other sign on the way down", ends=_TOO_MUCH, moment="approach"),
    Lost(name="no samples", ends=_MISSING),
    Lost(name="no samples on the way down", ends=_MISSING, moment="approach"),
    Lost(name="no samples for 16 ms", ends=_DONE, count=4),
    Lost(name="no samples for 60 ms", ends=_UNTRUSTED, by_load_cell=_DONE, count=15),
    WiderBar(name="error bar grows by 40 N/s", ends=_UNTRUSTED, growth=40.0),
)
"""The sensor sees nothing, or what is not there; a load cell shows in newtons what torque shows in newton metres."""
INCIDENTS = OF_THE_WORKPIECE + OF_THE_SAMPLES
"""What every way of sensing is to come through."""
