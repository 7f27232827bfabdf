"""One job of polishing: the arm comes along the path in air, comes down, presses, feeds, and retracts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray
from tauhat.control.force.feed_profile import FeedProfile
from tauhat.control.force.path_joints import PathJoints
from tauhat.control.force.polisher import Polisher
from tauhat.recordings.recording import Recording
from tauhat.simulation.contact.running_cell import CellSample, RunningCell
from tauhat.studies.polishing.readers import ForceReader, Place

_LONGEST = 120.0  # [s] of a job; one that lasts longer is given up
_ARRIVED = 1e-9  # [m]
_PEAK = 1.875  # largest over mean speed of a way with the least jerk


class AirLog(NamedTuple):
    """The log of a job in air.

    recording : way up and in, way down, a wait, and passes
    progress : (n,) way of the tool since the passes began [m]
    down : (n,) whether it is on its way down
    """

    recording: Recording
    progress: FloatArray
    down: NDArray[np.bool_]


class JobLog(NamedTuple):
    """A job, sample by sample; the force that was pressed with is the truth.

    t, s, depth : (n,) time, place along the path, commanded depth [s, m, m]
    passing : (n,) one where the tool was fed under full force
    true, read, std : (n,) normal force, what the polisher read, its error; nan where there was no reading [N]
    phase, reason : in which the job ended, and why it was given up
    """

    t: FloatArray
    s: FloatArray
    depth: FloatArray
    passing: FloatArray
    true: FloatArray
    read: FloatArray
    std: FloatArray
    phase: str
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Job:
    """What is done in a cell.

    polisher, path : how, and where
    way_in : speed along the path and back above it, before the tool comes down [m/s]
    """

    polisher: Polisher
    path: PathJoints
    way_in: float = 0.1

    @property
    def beginning(self) -> FloatArray:
        """Joint positions in which the arm has to start, (n_v,)."""
        return self.path.at(-self.polisher.task.half, 0.0, -self.polisher.limits.height, 0.0)[0]

    def done_in(self, cell: RunningCell, reader: ForceReader) -> JobLog:
        """Return the log of the job.

        Raises
        ------
        SimulationError
            when the arm goes unstable.
        """
        memory = reader.start()
        for sample, _ in self._way(cell, self.way_in, passes=2, height=self.polisher.limits.height):
            memory, _ = reader.read(memory, sample, Place(0.0, 0.0))
        polisher, state, reading = self.polisher, self.polisher.start(), None
        rows: list[tuple[float, ...]] = []
        progress, most = 0.0, int(_LONGEST / polisher.period)
        while state.phase not in {"done", "stopped"} and len(rows) < most:
            memory, reading, state, progress, row = self._step(cell, reader, (memory, reading, state, progress))
            rows.append(row)
        t, s, depth, passing, true, read, std = np.array(rows).T
        return JobLog(t, s, depth, passing, true, read, std, state.phase, state.reason)

    def in_air(self, cell: RunningCell) -> AirLog:
        """Return the log of the job without contact, as high above it as it begins; then come back to the beginning."""
        task, high = self.polisher.task, self.polisher.limits.height
        come = list(self._moved(cell, (-task.half, -high), (-task.half, -2.0 * high)))
        come += [sample for sample, _ in self._way(cell, self.way_in, passes=2, height=2.0 * high)]
        down = list(self._down(cell))
        stood = [cell.advance(*self.path.at(-task.half, 0.0, -high, 0.0)) for _ in range(self._periods(task.settle))]
        passed = list(self._way(cell, task.feed, passes=task.passes, height=high))
        self._back(cell, task.half if task.passes % 2 else -task.half, -high)
        samples = [*come, *down, *stood, *(sample for sample, _ in passed)]
        t, q, tau = (np.array([getattr(sample, name) for sample in samples]) for name in ("t", "q", "tau"))
        log = Recording(t=t, q=q, tau=tau, joint_names=self.path.robot.joint_names, name="in air")
        before, row = len(samples) - len(passed), np.arange(len(samples))
        way = np.cumsum([abs(ds) for _, ds in passed]) * self.polisher.period
        return AirLog(log, np.r_[np.zeros(before), way], (row >= len(come)) & (row < len(come) + len(down)))

    def come_back(self, cell: RunningCell, log: JobLog) -> None:
        """Move above the surface from where a job ended to where the next one begins, gently."""
        self._back(cell, float(log.s[-1]), float(log.depth[-1]))

    def _back(self, cell: RunningCell, s: float, depth: float) -> None:
        for _ in self._moved(cell, (s, depth), (-self.polisher.task.half, -self.polisher.limits.height)):
            pass

    def _moved(self, cell: RunningCell, start: tuple[float, float], end: tuple[float, float]) -> Iterator[CellSample]:
        """Move from a place along the path and a depth to others with the least jerk; yield the samples."""
        (s, depth), way, rise = start, end[0] - start[0], end[1] - start[1]
        seconds = _PEAK * max(abs(way), abs(rise)) / self.way_in
        for k in range(1, self._periods(seconds) + 1):
            x = k * self.polisher.period / seconds
            part, speed = x**3 * (10.0 - 15.0 * x + 6.0 * x * x), 30.0 * (x * (1.0 - x)) ** 2 / seconds
            yield cell.advance(*self.path.at(s + part * way, speed * way, depth + part * rise, speed * rise))

    def _down(self, cell: RunningCell) -> Iterator[CellSample]:
        """Come down from twice the height to it as a polisher does that feels nothing; yield the samples."""
        limits, period, half = self.polisher.limits, self.polisher.period, self.polisher.task.half
        above, speed = limits.height, 0.0
        while above > _ARRIVED:
            speed = min(limits.approach_speed, speed + limits.depth_acceleration * period, above / period)
            above -= speed * period
            yield cell.advance(*self.path.at(-half, 0.0, -limits.height - above, speed))

    def _periods(self, seconds: float) -> int:
        return int(seconds / self.polisher.period)

    def _step(self, cell: RunningCell, reader: ForceReader, now: tuple[Any, Any, Any, float]) -> tuple[Any, ...]:
        """Return what is remembered one period later, and a row of the log."""
        memory, reading, state, progress = now
        state, command = self.polisher.step(state, reading)
        sample = cell.advance(*self.path.follow(command))
        progress += abs(command.ds) * self.polisher.period
        place = Place(float(np.sign(command.ds)), progress, state.phase == "approach")
        memory, reading = reader.read(memory, sample, place)
        force, std = (np.nan, np.nan) if reading is None else reading
        passing = float(state.phase == "pass")
        row = (sample.t, command.s, command.depth, passing, sample.normal_force, force, std)
        return memory, reading, state, progress, row

    def _way(
        self, cell: RunningCell, speed: float, *, passes: int, height: float
    ) -> Iterator[tuple[CellSample, float]]:
        """Move there and back above the surface; yield the samples, with the speed along the path."""
        task = self.polisher.task
        profile = FeedProfile(half=task.half, speed=speed, acceleration=task.acceleration)
        for number in range(passes):
            way = -1.0 if number % 2 else 1.0
            for k in range(1, self._periods(profile.duration) + 1):
                s, ds = profile.at(k * self.polisher.period)
                yield cell.advance(*self.path.at(way * s, way * ds, -height, 0.0)), way * ds
