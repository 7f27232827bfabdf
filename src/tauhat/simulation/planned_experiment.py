"""A whole experiment as it is planned: a robot that is not its description, a motion, a controller, sensors, seeds."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np

from tauhat.errors import SimulationError
from tauhat.excitation.design import Design, DesignSettings, design
from tauhat.excitation.fourier import random_fourier
from tauhat.excitation.limits import LimitSet
from tauhat.excitation.repeated import Repeated
from tauhat.excitation.trajectory import Trajectory
from tauhat.robots.robot import Robot
from tauhat.simulation.attached import AttachedBody
from tauhat.simulation.elasticity import ElasticJoints
from tauhat.simulation.experiment import ExperimentSettings, Simulation, simulate
from tauhat.simulation.heat import FrictionHeat
from tauhat.simulation.parameters import TrueParameters
from tauhat.simulation.typical import KINDS, typical_plant

MotionKind: TypeAlias = Literal["designed", "random"]
MOST_SAMPLES = 5_000_000  # of one log: a few gigabytes
_PERIOD = 10.0  # [s] about, of a designed motion; longer ones repeat it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MotionPlan:
    """Which motion the robot follows.

    kind : `designed` for identification, in periods of about 10 s, or `random`
    seconds : from its start to its end [s]
    harmonics : of its Fourier series
    starts : random starts of the design
    limits : further limits of a designed motion
    given : a motion that is there already, instead of all these
    """

    kind: MotionKind = "designed"
    seconds: float = 20.0
    harmonics: int = 5
    starts: int = 2
    limits: LimitSet | None = None
    given: Trajectory | None = None

    def __post_init__(self) -> None:
        if self.kind not in {"designed", "random"}:
            raise SimulationError("unknown kind of motion", expected="designed or random", got=self.kind)
        if not 0.5 <= self.seconds <= 3600.0:
            raise SimulationError("length of the motion", expected="0.5 to 3600 s", got=f"{self.seconds:g} s")
        if self.kind == "random" and self.limits is not None:
            raise SimulationError("a random motion keeps no further limits", remedy="take a designed one")

    @property
    def duration(self) -> float:
        """Length of the motion [s]."""
        return self.seconds if self.given is None else self.given.duration

    @property
    def periods(self) -> int:
        """How often a designed motion runs."""
        return max(1, round(self.seconds / _PERIOD))

    @property
    def period(self) -> float:
        """Length of one run of a designed motion [s]."""
        return self.seconds / self.periods

    def designed(self, robot: Robot, rng: np.random.Generator) -> Design:
        """Return the design of one period.

        Raises
        ------
        ExcitationError
            when the limits leave no room, or something cannot be excited.
        """
        wanted = DesignSettings(period=self.period, harmonics=self.harmonics, starts=self.starts, limits=self.limits)
        return design(robot, rng=rng, settings=wanted)

    def trajectory(self, robot: Robot, rng: np.random.Generator) -> Trajectory:
        """Return the motion.

        Raises
        ------
        ExcitationError
            as `designed`.
        """
        if self.given is not None:
            return self.given
        if self.kind == "random":
            return random_fourier(robot, period=self.seconds, harmonics=self.harmonics, rng=rng)
        return Repeated(series=self.designed(robot, rng).trajectory, periods=self.periods)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlannedExperiment:
    """Everything that a simulated experiment needs.

    robot : its description, what identification will know
    described_by : name or file that it was loaded from, where known
    spread : how far the truth is from it, relative
    friction : one of `KINDS`
    elasticity, heat, attached : of the true robot
    motion : what it shall do
    settings : rates, controller, encoders and sensors
    sensors : what people call the sensors
    seed : of motion and noise
    robot_seed : of the truth
    log : where the log is written to
    """

    robot: Robot
    described_by: str = ""
    spread: float = 0.1
    friction: str = "plain"
    elasticity: ElasticJoints | None = None
    heat: FrictionHeat | None = None
    attached: tuple[AttachedBody, ...] = ()
    motion: MotionPlan = field(default_factory=MotionPlan)
    settings: ExperimentSettings = field(default_factory=lambda: ExperimentSettings(sample_rate=500.0))
    sensors: str = "own"
    seed: int = 0
    robot_seed: int = 0
    log: Path | None = None

    def __post_init__(self) -> None:
        if self.friction not in KINDS:
            raise SimulationError("unknown kind of friction", expected=", ".join(KINDS), got=self.friction[:60])
        if not 0.0 <= self.spread <= 0.5:
            raise SimulationError("spread of the truth", expected="0 to 0.5", got=self.spread)
        samples = self.motion.duration * self.settings.sample_rate
        if samples > MOST_SAMPLES:
            raise SimulationError(
                "absurdly long log", expected=f"at most {MOST_SAMPLES} samples", got=f"{samples:.0f}",
                remedy="choose a shorter motion or a lower rate",
            )  # fmt: skip

    def truth(self, rng: np.random.Generator) -> TrueParameters:
        """Return a true robot.

        Raises
        ------
        SimulationError
            when it is not one: a link that is no body, an elastic joint without a rotor, heat of another robot.
        """
        plant = typical_plant(self.robot, self.friction, rng=rng, spread=self.spread)
        return replace(plant, elasticity=self.elasticity, heat=self.heat, attached=self.attached)

    def run(self) -> Simulation:
        """Return the log of this experiment, with its truth.

        Raises
        ------
        SimulationError, ExcitationError
            when it cannot be run.
        """
        truth, rng = self.truth(np.random.default_rng(self.robot_seed)), np.random.default_rng(self.seed)
        motion = self.motion.trajectory(self.robot, rng)
        return simulate(self.robot, motion, rng=rng, parameters=truth, settings=self.settings)
