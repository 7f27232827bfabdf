"""A shift: the same job again and again while the arm warms up, stands in a break, and warms up again.

Between two jobs time is passed in one step: joints take the heat of the job that was just simulated, going on as it
was (`simulation.contact.worked_heat`), or cool. A virtual sensor sees no sample meanwhile and starts again, with wide
error bars, on the way in.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.blas import single_threaded
from tauhat.excitation.trajectory import Trajectory
from tauhat.simulation.contact.running_cell import RunningCell, start_cell
from tauhat.studies.polishing.arm import Arm, ArmSettings, Scene
from tauhat.studies.polishing.sensing_ways import LOAD_CELL, NO_WARMTH, WITH_WARMTH, reading_of
from tauhat.studies.polishing.trials import Outcome, judged

_AIR, _ANEW = "pass in air", "pass in air taken anew"


class _Worker(NamedTuple):
    """A way of sensing, one of `sensing_ways`, that works a shift, and whether its pass in air is taken anew."""

    way: str
    anew: bool = False


SHOWN: Mapping[str, _Worker] = {
    LOAD_CELL: _Worker(LOAD_CELL),
    NO_WARMTH: _Worker(NO_WARMTH),
    f"{NO_WARMTH}, {_AIR}": _Worker(f"{NO_WARMTH}, {_AIR}"),
    f"{NO_WARMTH}, {_ANEW}": _Worker(f"{NO_WARMTH}, {_AIR}", anew=True),
    WITH_WARMTH: _Worker(WITH_WARMTH),
    f"{WITH_WARMTH}, {_ANEW}": _Worker(f"{WITH_WARMTH}, {_AIR}", anew=True),
    "friction refreshed": _Worker("friction refreshed"),
}
"""Who works a shift; a pass in air that is not taken anew is that of its beginning."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShiftSettings:
    """When what is done.

    hours : of the shift
    every : from one simulated job to the next [s]
    rest : begin and end of the break [h]
    anew : from one pass in air to the next, where it is taken anew [s]
    pace : how much more heat the whole work makes than the slow passes alone: moves between workpieces are fast
    """

    hours: float = 4.0
    every: float = 900.0
    rest: tuple[float, float] = (2.0, 2.5)
    anew: float = 3600.0
    pace: float = 30.0

    @property
    def times(self) -> FloatArray:
        """Beginnings of the simulated jobs, (n,) [h]."""
        return np.arange(0.0, self.hours * 3600.0 + 1e-9, self.every) / 3600.0

    def passes(self, hour: float) -> bool:
        """Return whether a pass in air is taken anew before the job that begins then."""
        return round(hour * 3600.0 / self.every) % max(1, round(self.anew / self.every)) == 0

    def rests(self, hour: float) -> bool:
        """Return whether the time behind a job that began then is a break."""
        return self.rest[0] <= hour < self.rest[1]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ShiftTrial:
    """An arm and its shift."""

    settings: ArmSettings
    shift: ShiftSettings
    seed: int
    motion: Trajectory


class Worked(NamedTuple):
    """A job of a shift: when it began [h], how warm the joints were on average [deg C], what became of it."""

    hour: float
    temperature: float
    outcome: Outcome


@single_threaded
def shift_of(trial: ShiftTrial) -> tuple[Worked, ...]:
    """Return what became of every way of sensing over a shift that begins cold."""
    arm = Arm(trial.settings, trial.seed, "easy", trial.motion)
    models = arm.calibrated()
    scene = Scene(trial.seed, "flat", "cold")
    cell, job = arm.cell(scene, models.warm), arm.job(scene)
    first = arm.air(scene, cell, job)
    done: list[Worked] = []
    for name, worker in SHOWN.items():
        running = start_cell(cell, job.beginning, rng=arm.rng_of_run(scene))
        blank = Outcome(seed=arm.seed, difficulty="easy", shape="flat", warmth="cold", sensor=name)
        air = first
        for hour in trial.shift.times:
            begun, temperature = running.time, float(running.plant.temperature.mean())
            if worker.anew and trial.shift.passes(hour):
                air = job.in_air(running)
            reader, source = reading_of(worker.way, models.estimates, air, cell)
            running.begin_work()
            log = replace(job, polisher=replace(job.polisher, source=source)).done_in(running, reader)
            job.come_back(running, log)
            done.append(Worked(float(hour), temperature, judged(blank, log, job.polisher.task.force)))
            _between(trial.shift, running, hour=hour, seconds=trial.shift.every - (running.time - begun))
    return tuple(done)


def _between(shift: ShiftSettings, running: RunningCell, *, hour: float, seconds: float) -> None:
    """Pass the time up to the next job: in the break joints cool, else they take the heat of the whole work."""
    if shift.rests(hour):
        running.rest(seconds)
        return
    power = running.friction_power
    running.worked(seconds, power._replace(power=shift.pace * power.power, slope=shift.pace * power.slope))
