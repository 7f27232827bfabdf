"""One true arm of the study: calibrated once, then polishing, cold and warm, in any posture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.control.force.polisher import Polisher
from tauhat.control.force.surface import Surface
from tauhat.control.force.tool_mount import ToolMount
from tauhat.estimation.estimate import Estimate
from tauhat.excitation.trajectory import Trajectory
from tauhat.robots.library import load_robot
from tauhat.robots.robot import Robot
from tauhat.simulation.contact.cell import Cell, in_the_air
from tauhat.simulation.contact.material import Material
from tauhat.simulation.contact.running_cell import start_cell
from tauhat.simulation.contact.tool import CompliantTool
from tauhat.simulation.parameters import TrueParameters
from tauhat.simulation.sensors import SensorErrors
from tauhat.studies.polishing.calibration import CalibrationSettings, calibrated, calibration_log
from tauhat.studies.polishing.job import AirLog, Job
from tauhat.studies.polishing.truth import AMBIENT, Difficulty, PlantSettings, at_temperature
from tauhat.studies.polishing.work import Posture, Shape, WorkSettings, postures_of

Warmth: TypeAlias = Literal["cold", "warm"]
WARMTHS: tuple[Warmth, ...] = ("cold", "warm")
_STREAM = 20261125
_TRUTH, _SENSORS, _NOISE, _CHANGE, _SURFACE, _RUN, _FRICTION = range(7)


@dataclass(frozen=True, slots=True, kw_only=True)
class ArmSettings:
    """What arms are like, how they are calibrated, and what they do.

    timestep : of the cell's integrator; at a millisecond tip and friction of a cold arm may ring [s]
    """

    robot: str = "ur10e"
    plant: PlantSettings = field(default_factory=PlantSettings)
    calibration: CalibrationSettings = field(default_factory=CalibrationSettings)
    work: WorkSettings = field(default_factory=WorkSettings)
    tool: CompliantTool = field(default_factory=CompliantTool)
    timestep: float = 5e-4


class Calibrated(NamedTuple):
    """Models of an arm by kind, and how warm it was when they were recorded (n_v,) [deg C]."""

    estimates: Mapping[str, Estimate]
    warm: FloatArray


class Scene(NamedTuple):
    """Where and how warm an arm polishes."""

    posture: int
    shape: Shape
    warmth: Warmth


class Arm:
    """One random arm; equal seeds give equal arms.

    motion : of the calibration, through the whole room: it heats the joints
    """

    def __init__(self, settings: ArmSettings, seed: int, difficulty: Difficulty, motion: Trajectory) -> None:
        self.settings, self.seed, self.difficulty, self.motion = settings, seed, difficulty, motion
        self.described: Robot = load_robot(settings.robot)
        self.truth: TrueParameters = settings.plant.truth(self.described, difficulty, motion, self._rng(_TRUTH))
        self.sensors: SensorErrors = settings.plant.sensed_by(self.described, self._rng(_SENSORS))
        calibration = Cell(robot=self.described, parameters=self.truth, tool=settings.tool)
        self._material = Material(friction=float(self._rng(_FRICTION).uniform(*settings.plant.tool_friction)))
        self.robot: Robot = calibration.robot_with_tip
        self._with_tip = calibration.truth_with_tip
        self._mount = ToolMount(frame=calibration.carrier.name, length=settings.tool.length)

    def calibrated(self, motion: Trajectory | None = None) -> Calibrated:
        """Return the models from a motion that begins cold; that of the whole room by default."""
        settings = self.settings.calibration
        log, warm = calibration_log(
            self.described, self._with_tip, motion or self.motion, sensors=self.sensors, settings=settings,
            rng=self._rng(_NOISE),
        )  # fmt: skip
        return Calibrated(calibrated(self.robot, log, settings), warm)

    def cell(self, scene: Scene, warm: FloatArray) -> Cell:
        """Return the cell of a scene; where it is hard, links and drives have changed since the calibration."""
        plant, truth, sensors = self.settings.plant, self.truth, self.sensors
        if self.difficulty == "hard":
            truth = plant.heavier(truth, self._rng(_CHANGE, 0))
            sensors = plant.changed(sensors, truth.n_v, self._rng(_CHANGE, 1))
        temperature = warm if scene.warmth == "warm" else np.full(truth.n_v, AMBIENT)
        return Cell(
            robot=self.described, parameters=at_temperature(truth, temperature), surface=self._real(scene),
            tool=self.settings.tool, material=self._material, sensors=sensors, timestep=self.settings.timestep,
        )  # fmt: skip

    def job(self, scene: Scene) -> Job:
        """Return the job on the believed surface of a scene."""
        work, posture = self.settings.work, self._posture(scene)
        path = work.joints(self.robot, posture, work.believed(posture, scene.shape), self._mount)
        polisher = Polisher(task=work.task, limits=work.limits)
        polisher.check_path(path)
        return Job(polisher=polisher, path=path, way_in=work.way_in)

    def air(self, scene: Scene, cell: Cell, job: Job) -> AirLog:
        """Return the log of the same job in air, in the same cell and at the same temperature."""
        running = start_cell(in_the_air(cell), job.beginning, rng=self._rng(_RUN, 0, *_numbers(scene)))
        return job.in_air(running)

    def rng_of_run(self, scene: Scene, number: int = 1) -> np.random.Generator:
        """Return the random numbers of the sensors of a job: the same whatever the polisher reads."""
        return self._rng(_RUN, number, *_numbers(scene))

    def _posture(self, scene: Scene) -> Posture:
        known = postures_of(self.described)
        return known[scene.posture % len(known)]

    def _real(self, scene: Scene) -> Surface:
        work = self.settings.work
        return work.real(work.believed(self._posture(scene), scene.shape), self._rng(_SURFACE))

    def _rng(self, *purpose: int) -> np.random.Generator:
        return np.random.default_rng([_STREAM, self.seed, self.difficulty == "hard", *purpose])


def _numbers(scene: Scene) -> tuple[int, ...]:
    return scene.posture, int(scene.shape == "curved"), int(scene.warmth == "warm")
