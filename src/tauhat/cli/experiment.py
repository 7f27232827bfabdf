"""Simulated experiments as the command line runs them: a motion of a robot that is not its data sheet."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from tauhat.errors import SimulationError
from tauhat.excitation.fourier import random_fourier
from tauhat.excitation.trajectory import Trajectory
from tauhat.robots.robot import Robot
from tauhat.simulation.experiment import ExperimentSettings, Simulation, simulate
from tauhat.simulation.parameters import TrueParameters
from tauhat.simulation.planned_experiment import MOST_SAMPLES
from tauhat.simulation.sensors import SensorErrors
from tauhat.verification.simulated_log import truth_path, write_log

__all__ = ["Plan", "run_experiment", "truth_path", "write_experiment", "write_log"]

_SLOWEST_CONTROL = 2000.0  # [Hz]


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """How a log is made.

    seconds : length of the motion; of a random one, the period of its Fourier series [s]
    rate : samples per second of the log [Hz]
    harmonics : of a random motion
    noise : of the torque, as a fraction of each joint's RMS torque
    quantisation : step of the encoders on the joint side [rad or m]
    """

    seconds: float = 20.0
    rate: float = 500.0
    harmonics: int = 5
    noise: float = 0.02
    quantisation: float = 2e-5

    def __post_init__(self) -> None:
        if self.seconds * self.rate > MOST_SAMPLES:
            raise SimulationError(
                "absurdly long log", expected=f"at most {MOST_SAMPLES} samples",
                got=f"{self.seconds * self.rate:.0f}", remedy="choose a shorter motion or a lower rate",
            )  # fmt: skip

    @property
    def settings(self) -> ExperimentSettings:
        """The experiment's settings: control at a multiple of the log's rate, 2 kHz or more."""
        control_rate = self.rate * math.ceil(_SLOWEST_CONTROL / self.rate)
        return ExperimentSettings(
            timestep=1.0 / control_rate,
            control_rate=control_rate,
            sample_rate=self.rate,
            sensors=SensorErrors(encoder_step=self.quantisation, relative_torque_noise=self.noise),
        )


def run_experiment(
    robot: Robot, plan: Plan, *, truth: TrueParameters, rng: np.random.Generator, motion: Trajectory | None = None
) -> Simulation:
    """Return a log of the robot following a motion, with its truth; by default a random one inside its limits."""
    if motion is None:
        motion = random_fourier(robot, period=plan.seconds, harmonics=plan.harmonics, rng=rng)
    return simulate(robot, motion, rng=rng, parameters=truth, settings=plan.settings)


def write_experiment(robot: Robot, simulation: Simulation, log: Path, *, plan: Plan, seed: int) -> Path:
    """Write the log, and its true parameters beside it; return the path of the latter.

    Raises
    ------
    OutputError
        when one of them cannot be written.
    """
    return write_log(robot, simulation, log, notes={"plan": asdict(plan), "seed": seed})
