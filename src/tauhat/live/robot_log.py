"""Recording a running robot: the controller's own numbers as a log, and the map that makes them torques beside it."""

from __future__ import annotations

import time
from array import array
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import LiveError
from tauhat.files import check_output, write_text
from tauhat.live.universal_robots import LinkCounts, RobotCycle, RobotLink, UniversalRobot
from tauhat.recordings.recording import FEWEST_SAMPLES
from tauhat.recordings.writing import log_ending, write_columns

LONGEST = 3600.0  # [s] of a recording: 460 MB of an e-Series
_SIGNALS = ("q", "current", "target_current", "target_moment", "temperature")
_LATE = 1.0  # [s] by which the robot's clock may be behind ours before the recording ends anyway


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotLog:
    """What was written.

    log, map : the files
    n_t : samples
    seconds : from the first to the last [s]
    rate : of the controller's cycles [Hz]
    software : of the controller
    end : why it ended: "time", "interrupted", or what happened to the robot
    late : cycles left out because their time was not after the last one's
    counts : what became of the cycles
    """

    log: Path
    map: Path
    n_t: int
    seconds: float
    rate: float
    software: str
    end: str
    late: int
    counts: LinkCounts

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        plain = {name: str(value) if isinstance(value, Path) else value for name, value in asdict(self).items()}
        return plain | {"counts": self.counts._asdict()}


def record(robot: UniversalRobot, seconds: float, path: str | Path, *, inputs: Iterable[str | Path] = ()) -> RobotLog:
    """Record a robot for so long, by its own clock; write the log and, beside it, its map.

    Columns t, q_1 .., current_1 .., target_current_1 .., target_moment_1 .., temperature_1 .., bit by bit as the
    controller told them. What came is written also when the robot is lost for good, starts its clock anew, or the
    keyboard interrupts.

    Parameters
    ----------
    seconds : up to 3600
    path : .parquet, .csv or .csv.gz; the map is its name with `.map.toml`
    inputs : files that must not be overwritten

    Raises
    ------
    LiveError
        errors of `UniversalRobot.connect`, or fewer than 16 samples came.
    OutputError
        a file that cannot be written.
    """
    if not 0.0 < seconds <= LONGEST:
        raise LiveError("length of a recording", expected=f"above 0, at most {LONGEST:g} s", got=f"{seconds:g} s")
    log = Path(path)
    beside = map_beside(log)
    for output in (log, beside):
        check_output(output, inputs=inputs)
    with robot.connect() as link:
        taken = _Taken()
        end = _end_of(link, seconds, taken)
    if taken.n_t < FEWEST_SAMPLES:
        got = f"{taken.n_t} samples; robot: {link.state}; end: {end}"
        raise LiveError(
            "too little to write", where=f"ur://{robot.address}", expected=f">= {FEWEST_SAMPLES} samples", got=got
        )
    columns = taken.columns()
    write_text(beside, robot.currents.text())
    write_columns(columns, log)
    return RobotLog(
        log=log, map=beside, n_t=taken.n_t, seconds=float(columns["t"][-1] - columns["t"][0]), rate=link.rate,
        software=link.controller.version, end=end, late=taken.late, counts=link.counts,
    )  # fmt: skip


def map_beside(log: Path) -> Path:
    """Return where the map of a log is looked for: `run.map.toml` for `run.csv.gz`.

    Raises
    ------
    OutputError
        an ending that no log has.
    """
    return log.with_name(f"{log.name[: -len(log_ending(log))]}.map.toml")


class _Taken:
    """The cycles taken so far, as one row of numbers after the other."""

    def __init__(self) -> None:
        self.numbers = array("d")
        self.late = 0
        self.first = self.last = np.nan

    @property
    def n_t(self) -> int:
        return len(self.numbers) // (1 + 6 * len(_SIGNALS))

    def add(self, cycle: RobotCycle) -> None:
        if cycle.t <= self.last:
            self.late += 1
            return
        self.first, self.last = (cycle.t if np.isnan(self.first) else self.first), cycle.t
        self.numbers.append(cycle.t)
        for name in _SIGNALS:
            self.numbers.extend(getattr(cycle, name).tolist())

    def columns(self) -> dict[str, FloatArray]:
        rows = np.frombuffer(self.numbers, dtype=np.float64).reshape(self.n_t, -1)
        names = [f"{name}_{joint + 1}" for name in _SIGNALS for joint in range(6)]
        return {name: rows[:, index] for index, name in enumerate(["t", *names])}


def _end_of(link: RobotLink, seconds: float, taken: _Taken) -> str:
    """Take cycles until there are enough, or no more; return why it ended."""
    began, connections = time.monotonic(), 0
    try:
        for cycle in link.cycles():
            if time.monotonic() - began > seconds + _LATE:
                return "time"
            if cycle is None:
                continue
            if link.counts.reconnects > connections and cycle.t <= taken.last:
                return "the controller was started anew, and its clock with it"
            connections = link.counts.reconnects
            taken.add(cycle)
            if taken.last - taken.first >= seconds:
                return "time"
    except LiveError as error:
        return f"{error.what}: {error.got}"
    except KeyboardInterrupt:
        return "interrupted"
    return "time"
