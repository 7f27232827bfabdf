"""What becomes of a job in which something goes wrong: the true force, how the job ends, and how soon."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.control.force.force_source import MeasuredForce
from tauhat.control.force.reading import Reason
from tauhat.control.force.surface import Surface
from tauhat.errors import SimulationError
from tauhat.robots.kinematics import forward_kinematics
from tauhat.simulation.contact.cell import Cell
from tauhat.simulation.contact.running_cell import CellSample, RunningCell
from tauhat.simulation.contact.scene import build_scene
from tauhat.simulation.contact.tool import TIP
from tauhat.simulation.contact.workpiece import height
from tauhat.studies.polishing.arm import Arm, ArmSettings, Calibrated, Scene, Warmth
from tauhat.studies.polishing.incidents import Incident, Moment, WorkpieceIncident
from tauhat.studies.polishing.job import Job, JobLog
from tauhat.studies.polishing.readers import ForceReader, SensedReading
from tauhat.studies.polishing.sensing_ways import LOAD_CELL, reading_of
from tauhat.studies.polishing.streamed import StreamedReading
from tauhat.studies.polishing.work import postures_of

_SIGMAS = 3.0  # standard deviations by which a reading may be off
_ARM_LAG = 1.0 / np.pi  # [-] of a critically damped position controller, `2 / w`, times its bandwidth in Hz
_SHORT = 0.04  # [m] to either side of the middle
_LEAVING = 1.01  # times the fastest way out of a law: the tool retracts


@dataclass(frozen=True, slots=True, kw_only=True)
class Met:
    """What became of a job with an incident.

    name, sensor, warmth : of the incident, what the polisher read, and the arm
    largest, bound : true normal force since the beginning of the incident, and what it has to stay below [N]
    left : true force when the job ended [N]
    phase, reason, ends : in which it ended, why it was given up, and for which reasons it may be
    seconds : from the beginning of the incident to the retract; nan where the job was done [s]
    blind, notice : time for which the tool was fed on samples that were spoilt, and time in which a job that is to be
        given up for them has to be [s]
    depth, deepest : of the unloaded tip below the believed surface, true, and what it has to stay below [m]
    """

    name: str
    sensor: str
    warmth: Warmth
    largest: float
    bound: float
    left: float
    phase: str
    reason: str
    ends: tuple[Reason, ...]
    seconds: float
    blind: float
    notice: float
    depth: float
    deepest: float

    @property
    def deeper(self) -> bool:
        """Whether the robot moved deeper than it may."""
        return self.depth > self.deepest

    @property
    def noticed(self) -> bool:
        """Whether the job ended as it may, and was fed no longer than that takes on samples that were spoilt."""
        ended = self.phase == ("stopped" if self.reason else "done") and self.reason in self.ends
        return ended and (self.blind <= self.notice or not self.reason)

    @property
    def safe(self) -> bool:
        """Whether force and depth kept their bounds, and the job ended in the air, as it may."""
        return self.noticed and self.largest <= self.bound and self.left == 0.0 and not self.deeper


class Healthy(NamedTuple):
    """What a job is like in which nothing goes wrong.

    begins : time of the log of each moment [s]
    off : how far the arm is from where it is commanded on its way down [m]
    std : of the readings while the tool is fed [N]
    """

    begins: dict[Moment, float]
    off: float
    std: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bench:
    """An arm on which incidents are tried, each in the same run of everything else.

    sensor, warmth : what the polisher reads, and how warm the arm is
    cell : in which nothing goes wrong
    job, reader, believed : what is done, what reads the force, and the surface as believed
    rng : of the sensors, the same at every call
    """

    sensor: str
    warmth: Warmth
    cell: Cell
    job: Job
    reader: ForceReader
    believed: Surface
    rng: Callable[[], np.random.Generator]

    def run(self, cell: Cell, reader: ForceReader) -> tuple[JobLog, FloatArray]:
        """Return the log of a job, and the true depth of the unloaded tip below the believed surface, (n,) [m]."""
        running = WitnessedCell(cell, self.job.beginning, self.rng())
        log = self.job.done_in(running, reader)
        places = np.array(running.places[-len(log.t) :])
        tips = forward_kinematics(self.job.path.robot, places, frame=TIP).translation
        return log, np.array([-height(self.believed, tip) for tip in tips])

    def healthy(self) -> Healthy:
        """Return what the job is like when nothing goes wrong.

        Raises
        ------
        SimulationError
            when it fails all the same.
        """
        log, depth = self.run(self.cell, self.reader)
        if log.phase != "done":
            got = log.reason or log.phase
            raise SimulationError("a job fails before anything goes wrong", where=self.sensor, expected="done", got=got)
        touched, fed = int(np.argmax(log.true > 0.0)), log.passing > 0.0
        middle = int(np.argmax(fed & (log.s >= 0.0)))
        rows: dict[Moment, int] = {"start": 0, "approach": touched // 2, "contact": touched, "pass": middle}
        return Healthy(
            {moment: float(log.t[row]) for moment, row in rows.items()},
            float(np.abs(depth - log.depth)[:touched].max()),
            float(np.nanmedian(log.std[fed])),
        )

    def bound(self, incident: Incident, healthy: Healthy) -> float:
        """Return what the true force has to stay below [N].

            force_limit + 3 std + k (press_speed + slope feed) reaction

        k is the stiffness of tool and hardest skin in series, slope that of the real surface against the believed one.
        Where the skin gets harder, the force that is there grows at once; the larger of this and the limit counts. The
        reaction is as late as the sensor and the arm are; where samples are spoilt, that has to be found out before.
        """
        polisher, cell = self.job.polisher, incident.cell(self.cell, self.believed)
        surface = cell.surface or self.believed
        slope = abs(float(self.believed.rotation[:, 0] @ surface.rotation[:, 2]))
        stiffness = 1.0 / (1.0 / cell.tool.stiffness + 1.0 / cell.material.hardest)
        speed = polisher.press_speed + slope * polisher.task.feed
        force = max(polisher.limits.force, incident.jump(self.cell) * polisher.task.force)
        late = polisher.period + self._lag + _ARM_LAG / self.cell.control.bandwidth
        late += 0.0 if isinstance(incident, WorkpieceIncident) else self._detection
        return force + _SIGMAS * healthy.std + stiffness * speed * late

    @property
    def notice(self) -> float:
        """Longest time from a wrong sample to the decision to retract [s]: readings of no use, or no contact."""
        polisher = self.job.polisher
        return max(self._detection, polisher.contact.lost_after) + self._lag + polisher.period

    @property
    def _lag(self) -> float:
        return self.reader.lag if isinstance(self.reader, StreamedReading) else 0.0

    @property
    def _detection(self) -> float:
        polisher = self.job.polisher
        source = polisher.source if isinstance(polisher.source, MeasuredForce) else MeasuredForce()
        alike = self.reader.still_after if isinstance(self.reader, StreamedReading) else source.frozen_after
        return source.patience + alike * polisher.period


class WitnessedCell(RunningCell):
    """A running cell that keeps where the arm truly was, sample by sample."""

    __slots__ = ("places",)

    def __init__(self, cell: Cell, q: FloatArray, rng: np.random.Generator) -> None:
        super().__init__(cell, build_scene(cell, q), rng)
        self.places: list[FloatArray] = []

    def advance(self, q_ref: FloatArray, dq_ref: FloatArray) -> CellSample:
        """Pass one sample period, and keep the place."""
        sample = super().advance(q_ref, dq_ref)
        self.places.append(np.array(self.plant.state[0]))
        return sample


def short_work(settings: ArmSettings) -> ArmSettings:
    """Return the settings with one pass over a short path, on which a wrong slope is steep and not far off."""
    task = replace(settings.work.task, half=_SHORT, passes=1)
    return replace(settings, work=replace(settings.work, task=task))


def bench_of(arm: Arm, scene: Scene, models: Calibrated, sensor: str) -> Bench:
    """Return the bench of a scene with a way of sensing; a virtual sensor takes samples as a live service does."""
    cell, job = arm.cell(scene, models.warm), arm.job(scene)
    reader, source = reading_of(sensor, models.estimates, arm.air(scene, cell, job), cell)
    if isinstance(reader, SensedReading):
        reader = StreamedReading(sensed=reader)
    postures = postures_of(arm.described)
    return Bench(
        sensor=sensor, warmth=scene.warmth, cell=cell, reader=reader,
        job=replace(job, polisher=replace(job.polisher, source=source)),
        believed=arm.settings.work.believed(postures[scene.posture % len(postures)], scene.shape),
        rng=lambda: arm.rng_of_run(scene),
    )  # fmt: skip


def met(bench: Bench, healthy: Healthy, incident: Incident) -> Met:
    """Return what becomes of a job with an incident.

    Parameters
    ----------
    healthy : the job of this bench without one

    Raises
    ------
    SimulationError
        when the arm goes unstable.
    """
    begins = healthy.begins[incident.moment]
    log, depth = bench.run(incident.cell(bench.cell, bench.believed), incident.reader(bench.reader, begins))
    row = _leaves(log, bench)
    return Met(
        name=incident.name, sensor=bench.sensor, warmth=bench.warmth, largest=float(log.true[log.t >= begins].max()),
        bound=bench.bound(incident, healthy), left=float(log.true[-1]), phase=log.phase, reason=log.reason,
        ends=_ends(incident, bench.sensor), seconds=float(log.t[row] - begins) if log.reason else np.nan,
        blind=_blind(incident, log, begins) * bench.job.polisher.period, notice=bench.notice, depth=float(depth.max()),
        deepest=bench.job.polisher.limits.deepest + healthy.off,
    )  # fmt: skip


def _ends(incident: Incident, sensor: str) -> tuple[Reason, ...]:
    return incident.by_load_cell or incident.ends if sensor == LOAD_CELL else incident.ends


def _leaves(log: JobLog, bench: Bench) -> int:
    """Return the row at which the tool retracts: it goes out faster than a force law lets it."""
    polisher = bench.job.polisher
    out = -np.diff(log.depth) / polisher.period > _LEAVING * polisher.law.speed_limit
    return int(np.argmax(out)) if out.any() else len(log.t) - 1


def _blind(incident: Incident, log: JobLog, begins: float) -> int:
    """Return for how many periods the tool was fed on the reading of a spoilt sample."""
    first = int(np.searchsorted(log.t, begins))
    spoilt = np.array([incident.spoils(row - first) for row in range(len(log.t) - 1)])
    return int(np.count_nonzero(spoilt & (log.passing[1:] > 0.0)))
