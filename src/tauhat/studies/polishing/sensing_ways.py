"""The ways in which a polisher may learn its force, side by side: each makes a reader of an arm's models."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from tauhat.control.force.force_source import BelievedForce, ForceSource, MeasuredForce
from tauhat.estimation.estimate import Estimate
from tauhat.sensing.observers import observer_named
from tauhat.sensing.sensor import ForceSensor, force_sensor
from tauhat.sensing.wrench import WrenchSolver
from tauhat.sensing.zero import AirPass
from tauhat.simulation.contact.cell import Cell
from tauhat.simulation.contact.tool import TIP
from tauhat.studies.polishing.calibration import STEADY, TEXTBOOK, THERMAL
from tauhat.studies.polishing.job import AirLog
from tauhat.studies.polishing.readers import (
    AirZero,
    ForceReader,
    LoadCellReading,
    NoReading,
    SensedReading,
    ToolFriction,
    along_the_normal,
    of_all_components,
    of_three_forces,
)

Solvers: TypeAlias = Callable[[ForceSensor], tuple[WrenchSolver, ...]]
SOLVED: Mapping[str, Solvers] = {
    "one direction": lambda sensor: along_the_normal(sensor, TIP, ToolFriction()),
    "three forces": lambda sensor: of_three_forces(sensor, TIP),
    "six components": lambda sensor: of_all_components(sensor, TIP),
}
"""What the external torque is solved for, by name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Way:
    """A virtual sensor: model, observer, what is solved for, and whether a pass in air is taken off.

    model : kind of model, one of `calibration`
    observer : one of `sensing.OBSERVERS`
    solved : one of `SOLVED`
    """

    model: str
    observer: str = "momentum"
    solved: str = "one direction"
    air: bool = False

    def reader(self, estimates: Mapping[str, Estimate], air: AirLog, rate: float) -> ForceReader:
        """Return what reads the force of an arm with these models."""
        sensor = force_sensor(estimates[self.model], rate=rate, observer=observer_named(self.observer))
        standing, forth, back = SOLVED[self.solved](sensor)
        return SensedReading(
            sensor=sensor, solvers=(standing, forth, back), zero=_zero(sensor, air) if self.air else None
        )


LOAD_CELL, OPEN_LOOP = "load cell", "open loop"
NO_WARMTH, WITH_WARMTH = "without warmth", "with warmth"
WAYS: Mapping[str, Way] = {
    "textbook": Way(model=TEXTBOOK, solved="six components"),
    "textbook, pass in air": Way(model=TEXTBOOK, solved="six components", air=True),
    NO_WARMTH: Way(model=STEADY),
    f"{NO_WARMTH}, pass in air": Way(model=STEADY, air=True),
    WITH_WARMTH: Way(model=THERMAL, observer="thermal"),
    f"{WITH_WARMTH}, pass in air": Way(model=THERMAL, observer="thermal", air=True),
    "friction refreshed": Way(model=STEADY, observer="refresh"),
}
"""The virtual sensors that polish in all scenes."""
OTHERS: Mapping[str, Way] = {
    "momentum-2": Way(model=STEADY, observer="momentum-2", air=True),
    "inverse-dynamics": Way(model=STEADY, observer="inverse-dynamics", air=True),
    "sliding-mode": Way(model=STEADY, observer="sliding-mode", air=True),
    "disturbance": Way(model=STEADY, observer="disturbance", air=True),
    "kalman": Way(model=STEADY, observer="kalman", air=True),
    f"{NO_WARMTH}, three forces": Way(model=STEADY, solved="three forces"),
    f"{NO_WARMTH}, six components": Way(model=STEADY, solved="six components"),
    f"{WITH_WARMTH}, three forces": Way(model=THERMAL, observer="thermal", solved="three forces"),
    f"{WITH_WARMTH}, six components": Way(model=THERMAL, observer="thermal", solved="six components"),
}
"""Other observers, each with a pass in air, and other solves: in one scene."""


def reading_of(
    name: str, estimates: Mapping[str, Estimate], air: AirLog, cell: Cell
) -> tuple[ForceReader, ForceSource]:
    """Return what reads the force by this name, and how the polisher uses it."""
    if name == LOAD_CELL:
        return LoadCellReading(), MeasuredForce()
    if name == OPEN_LOOP:
        springs = cell.tool.stiffness, cell.material.stiffness
        return NoReading(), BelievedForce(stiffness=springs[0] * springs[1] / sum(springs))
    return {**WAYS, **OTHERS}[name].reader(estimates, air, cell.sample_rate), MeasuredForce()


def _zero(sensor: ForceSensor, air: AirLog) -> AirZero:
    """Return the torque that a job in air shows: on the way down on average, in the passes by the way of the tool."""
    sensed = sensor.along(air.recording)
    progress, down = air.progress[sensed.rows], np.flatnonzero(sensed.settled & air.down[sensed.rows])
    fed = sensed.settled & (progress > 0.0)
    fed[1:] &= progress[1:] > progress[:-1]
    passes = AirPass(progress=progress[fed], torque=sensed.tau[fed], wrench=sensed.wrench[fed])
    return AirZero(sensed.tau[down[down.size // 2 :]].mean(axis=0), passes)
