"""A shift: the same job again and again while the arm warms up, stands in a break, and warms up again.

Between two jobs time is passed in one step: joints take the heat of the job that was just simulated, going on as it
was (`simulation.contact.worked_heat`), or cool. A virtual sensor sees no sample meanwhile and starts again, with wide
error bars, on the way in.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.blas import single_threaded
from tauhat.excitation.trajectory import Trajectory
from tauhat.simulation.contact.running_cell import start_cell
from tauhat.studies.polishing.arm import Arm, ArmSettings, Scene
from tauhat.studies.polishing.sensing_ways import LOAD_CELL, NO_WARMTH, WITH_WARMTH, reading_of
from tauhat.studies.polishing.trials import Outcome, judged

SHOWN = (LOAD_CELL, NO_WARMTH, f"{NO_WARMTH}, pass in air", WITH_WARMTH, "friction refreshed")
"""Ways of sensing that work a shift; the pass in air is that of its beginning."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShiftSettings:
    """When what is done.

    hours : of the shift
    every : from one simulated job to the next [s]
    rest : begin and end of the break [h]
    pace : how much more heat the whole work makes than the slow passes alone: moves between workpieces are fast
    """

    hours: float = 4.0
    every: float = 900.0
    rest: tuple[float, float] = (2.0, 2.5)
    pace: float = 30.0

    @property
    def times(self) -> FloatArray:
        """Beginnings of the simulated jobs, (n,) [h]."""
        return np.arange(0.0, self.hours * 3600.0 + 1e-9, self.every) / 3600.0

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
    air = arm.air(scene, cell, job)
    done: list[Worked] = []
    for name in SHOWN:
        reader, source = reading_of(name, models.estimates, air, cell)
        asked = replace(job, polisher=replace(job.polisher, source=source))
        running = start_cell(cell, job.beginning, rng=arm.rng_of_run(scene))
        for hour in trial.shift.times:
            temperature = float(running.plant.temperature.mean())
            running.begin_work()
            log = asked.done_in(running, reader)
            rest = trial.shift.every - float(log.t[-1] - log.t[0])
            blank = Outcome(seed=arm.seed, difficulty="easy", shape="flat", warmth="cold", sensor=name)
            done.append(Worked(float(hour), temperature, judged(blank, log, job.polisher.task.force)))
            power = running.friction_power
            if trial.shift.rests(hour):
                running.rest(rest)
            else:
                faster = power._replace(power=trial.shift.pace * power.power, slope=trial.shift.pace * power.slope)
                running.worked(rest, faster)
    return tuple(done)
