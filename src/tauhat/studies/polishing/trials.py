"""What becomes of every way of sensing on one arm: jobs in several scenes, and the error of the force in each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.blas import single_threaded
from tauhat.estimation.estimate import Estimate
from tauhat.excitation.trajectory import Trajectory
from tauhat.simulation.contact.cell import Cell
from tauhat.simulation.contact.running_cell import start_cell
from tauhat.studies.polishing.arm import WARMTHS, Arm, ArmSettings, Scene, Warmth
from tauhat.studies.polishing.job import AirLog, Job, JobLog
from tauhat.studies.polishing.sensing_ways import LOAD_CELL, NO_WARMTH, OPEN_LOOP, OTHERS, WAYS, WITH_WARMTH, reading_of
from tauhat.studies.polishing.truth import Difficulty
from tauhat.studies.polishing.work import SHAPES, Shape

_INTERVAL = 1.96
_DRAWN = 400  # points of a drawn job
_SHOWN = LOAD_CELL, NO_WARMTH, WITH_WARMTH, "textbook, pass in air"
GLOBAL, LOCAL = "whole room", "where the work is"


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """One job.

    calibration : where the models were calibrated
    rms, bias : of the true normal force about the commanded one, while the tool is fed, in parts of it; nan where it
        was never fed
    largest : error of the true force [N]
    read : root mean square of reading less truth [N]
    inside : share of the readings' 95 % intervals that hold the truth
    phase, reason : in which it ended, and why it was given up
    """

    seed: int
    difficulty: Difficulty
    shape: Shape
    warmth: Warmth
    sensor: str
    calibration: str = GLOBAL
    rms: float = np.nan
    bias: float = np.nan
    largest: float = np.nan
    read: float = np.nan
    inside: float = np.nan
    phase: str = ""
    reason: str = ""


class Drawn(NamedTuple):
    """A job to be drawn: time [s], true force and reading [N], thinned."""

    sensor: str
    warmth: Warmth
    t: tuple[float, ...]
    true: tuple[float, ...]
    read: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trial:
    """One arm, and what is tried on it.

    motion, near : of the calibrations, through the whole room and where the work of the first posture is; without the
        latter that is left out
    draw : whether its jobs are kept to be drawn
    """

    settings: ArmSettings
    seed: int
    difficulty: Difficulty
    motion: Trajectory
    near: Trajectory | None = None
    draw: bool = False


@single_threaded
def tried(trial: Trial) -> tuple[tuple[Outcome, ...], tuple[Drawn, ...]]:
    """Return what became of all jobs of an arm, and those to be drawn."""
    arm = Arm(trial.settings, trial.seed, trial.difficulty, trial.motion)
    models = arm.calibrated()
    outcomes: list[Outcome] = []
    drawn: list[Drawn] = []
    for shape, warmth in product(SHAPES, WARMTHS):
        bench = _Bench(arm, Scene(trial.seed, shape, warmth), models.warm)
        extra = tuple(OTHERS) if trial.difficulty == "easy" and shape == "flat" else ()
        jobs = {name: bench.tried(name, models.estimates) for name in (LOAD_CELL, OPEN_LOOP, *WAYS, *extra)}
        outcomes += [outcome for outcome, _ in jobs.values()]
        if trial.draw and shape == "flat":
            drawn += [_drawn(name, warmth, jobs[name][1]) for name in _SHOWN]
    if trial.near is not None:
        outcomes += _local(arm, trial.near, models.estimates, models.warm)
    return tuple(outcomes), tuple(drawn)


class _Bench:
    """A scene of an arm in which ways of sensing are tried, each in the same run of everything else."""

    def __init__(self, arm: Arm, scene: Scene, warm: FloatArray) -> None:
        self._arm, self._scene = arm, scene
        self._cell: Cell = arm.cell(scene, warm)
        self._job: Job = arm.job(scene)
        self._air: AirLog = arm.air(scene, self._cell, self._job)

    def tried(self, name: str, estimates: Mapping[str, Estimate], calibration: str = GLOBAL) -> tuple[Outcome, JobLog]:
        """Return what becomes of a job with this way of sensing, and its log."""
        reader, source = reading_of(name, estimates, self._air, self._cell)
        job = replace(self._job, polisher=replace(self._job.polisher, source=source))
        running = start_cell(self._cell, job.beginning, rng=self._arm.rng_of_run(self._scene))
        blank = Outcome(
            seed=self._arm.seed, difficulty=self._arm.difficulty, shape=self._scene.shape, warmth=self._scene.warmth,
            sensor=name, calibration=calibration,
        )  # fmt: skip
        log = job.done_in(running, reader)
        return judged(blank, log, job.polisher.task.force), log


def judged(blank: Outcome, log: JobLog, force: float) -> Outcome:
    """Return the outcome of a log, where the tool was fed under a commanded force [N]."""
    fed = log.passing > 0.0
    ended = replace(blank, phase=log.phase, reason=log.reason)
    if not fed.any():
        return ended
    error = log.true[fed] - force
    missed = log.read[fed] - log.true[fed]
    seen = np.isfinite(missed)
    return replace(
        ended,
        rms=float(np.sqrt(np.mean(error**2))) / force,
        bias=float(np.mean(error)) / force,
        largest=float(np.abs(error).max()),
        read=float(np.sqrt(np.mean(missed[seen] ** 2))) if seen.any() else np.nan,
        inside=float(np.mean(np.abs(missed[seen]) <= _INTERVAL * log.std[fed][seen])) if seen.any() else np.nan,
    )


def _local(arm: Arm, near: Trajectory, whole: Mapping[str, Estimate], warm: FloatArray) -> Iterator[Outcome]:
    """Yield outcomes in the first posture of models calibrated near it, and of those from the whole room."""
    models = {GLOBAL: whole, LOCAL: arm.calibrated(near).estimates}
    for warmth in WARMTHS:
        bench = _Bench(arm, Scene(0, "flat", warmth), warm)
        for name in (NO_WARMTH, WITH_WARMTH):
            for calibration, estimates in models.items():
                outcome, _ = bench.tried(name, estimates, calibration)
                yield replace(outcome, sensor=f"{name}, first posture")


def _drawn(name: str, warmth: Warmth, log: JobLog) -> Drawn:
    rows = slice(None, None, max(1, len(log.t) // _DRAWN))
    return Drawn(name, warmth, *(tuple(part[rows].tolist()) for part in (log.t, log.true, log.read)))
