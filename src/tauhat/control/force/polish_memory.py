"""What a polisher remembers from one period to the next, and what it commands."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple, TypeAlias

from tauhat.control.force.reading import Reason

Phase: TypeAlias = Literal["approach", "contact", "pass", "search", "hold", "retract", "done", "stopped"]
"""What a polisher is doing; `hold` is any of the first four while there is no reading to use."""


class PolishCommand(NamedTuple):
    """Where the tool shall be at the end of a period, and how fast.

    s, ds : arc length along the path, and its speed [m, m/s]
    depth, ddepth : of the unloaded tip below the believed surface, along its normal, and its speed [m, m/s]
    phase : what the polisher is doing
    reason : why it gave up; empty otherwise
    """

    s: float
    ds: float
    depth: float
    ddepth: float
    phase: Phase
    reason: Reason


class PolishMemory(NamedTuple):
    """All that a polisher knows of what was.

    phase, reason : as commanded, `hold` excepted
    depth, ddepth : commanded last [m, m/s]
    progress : own time of the present pass [s]
    pace : of that time; zero while the feed pauses
    passed : passes that are done
    wanted : force [N]
    touched, settled, lost : how long contact was sure, the full force wanted, the force too low [s]
    searched_from : depth at which contact was lost [m]
    searches : begun so far
    law, source : memories of the force law and of the force's source
    """

    phase: Phase
    reason: Reason
    depth: float
    ddepth: float
    progress: float
    pace: float
    passed: int
    wanted: float
    touched: float
    settled: float
    lost: float
    searched_from: float
    searches: int
    law: Any
    source: Any


class Intent(NamedTuple):
    """What a phase wants for the coming period.

    memory : behind the phase's own decisions
    speed : into the surface [m/s]
    pace : of the feed, from 0 to 1
    """

    memory: PolishMemory
    speed: float
    pace: float
