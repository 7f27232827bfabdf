"""One job of polishing: the arm comes along the path in air, comes down, presses, feeds, and retracts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.control.force.feed_profile import FeedProfile
from tauhat.control.force.path_joints import PathJoints
from tauhat.control.force.polisher import Polisher
from tauhat.recordings.recording import Recording
from tauhat.simulation.contact.running_cell import CellSample, RunningCell
from tauhat.studies.polishing.readers import ForceReader, Place

_LONGEST = 120.0  # [s] of a job; one that lasts longer is given up
_PEAK = 1.875  # largest over mean speed of a way with the least jerk


class AirLog(NamedTuple):
    """The log of the same motion in air, and the way of the tool since the passes began, (n,) [m]."""

    recording: Recording
    progress: FloatArray


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
        for sample, _ in self._way(cell, self.way_in, passes=2):
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
        """Return the log of the way in and of the passes above the surface."""
        task = self.polisher.task
        come = [(sample, 0.0) for sample, _ in self._way(cell, self.way_in, passes=2)]
        passed = list(self._way(cell, task.feed, passes=task.passes))
        samples = [sample for sample, _ in (*come, *passed)]
        speeds = np.array([abs(ds) for _, ds in (*come, *passed)])
        t, q, tau = (np.array([getattr(sample, name) for sample in samples]) for name in ("t", "q", "tau"))
        log = Recording(t=t, q=q, tau=tau, joint_names=self.path.robot.joint_names, name="in air")
        return AirLog(log, np.cumsum(speeds) * self.polisher.period)

    def come_back(self, cell: RunningCell, log: JobLog) -> None:
        """Move above the surface from where a job ended to where the next one begins, gently."""
        task, s, depth = self.polisher.task, float(log.s[-1]), float(log.depth[-1])
        way, rise = -task.half - s, -self.polisher.limits.height - depth
        seconds = _PEAK * max(abs(way), abs(rise)) / self.way_in
        for k in range(1, int(seconds / self.polisher.period) + 1):
            x = k * self.polisher.period / seconds
            part, speed = x**3 * (10.0 - 15.0 * x + 6.0 * x * x), 30.0 * (x * (1.0 - x)) ** 2 / seconds
            cell.advance(*self.path.at(s + part * way, speed * way, depth + part * rise, speed * rise))

    def _step(self, cell: RunningCell, reader: ForceReader, now: tuple[Any, Any, Any, float]) -> tuple[Any, ...]:
        """Return what is remembered one period later, and a row of the log."""
        memory, reading, state, progress = now
        state, command = self.polisher.step(state, reading)
        sample = cell.advance(*self.path.follow(command))
        progress += abs(command.ds) * self.polisher.period
        memory, reading = reader.read(memory, sample, Place(float(np.sign(command.ds)), progress))
        force, std = (np.nan, np.nan) if reading is None else reading
        passing = float(state.phase == "pass")
        row = (sample.t, command.s, command.depth, passing, sample.normal_force, force, std)
        return memory, reading, state, progress, row

    def _way(self, cell: RunningCell, speed: float, *, passes: int) -> Iterator[tuple[CellSample, float]]:
        """Move there and back above the surface; yield the samples, with the speed along the path."""
        task, height = self.polisher.task, -self.polisher.limits.height
        profile = FeedProfile(half=task.half, speed=speed, acceleration=task.acceleration)
        for number in range(passes):
            way = -1.0 if number % 2 else 1.0
            for k in range(1, int(profile.duration / self.polisher.period) + 1):
                s, ds = profile.at(k * self.polisher.period)
                yield cell.advance(*self.path.at(way * s, way * ds, height, 0.0)), way * ds
