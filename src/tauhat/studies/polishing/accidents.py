"""All incidents on one arm, by what the polisher reads."""

from __future__ import annotations

from dataclasses import dataclass

from tauhat.blas import single_threaded
from tauhat.excitation.trajectory import Trajectory
from tauhat.studies.polishing.arm import WARMTHS, Arm, ArmSettings, Scene
from tauhat.studies.polishing.known_incidents import INCIDENTS
from tauhat.studies.polishing.meeting import Met, bench_of, met, short_work
from tauhat.studies.polishing.sensing_ways import LOAD_CELL, WITH_WARMTH

READ = WITH_WARMTH, LOAD_CELL
"""What the polisher reads when something goes wrong."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Accidents:
    """An easy arm with which everything goes wrong, one thing a job."""

    settings: ArmSettings
    seed: int
    motion: Trajectory


@single_threaded
def all_met(trial: Accidents) -> tuple[Met, ...]:
    """Return what becomes of every incident, cold and warm, on the virtual sensor and on a load cell."""
    arm = Arm(short_work(trial.settings), trial.seed, "easy", trial.motion)
    models = arm.calibrated()
    found: list[Met] = []
    for sensor in READ:
        for warmth in WARMTHS:
            bench = bench_of(arm, Scene(trial.seed, "flat", warmth), models, sensor)
            healthy = bench.healthy()
            found += [met(bench, healthy, incident) for incident in INCIDENTS]
    return tuple(found)
