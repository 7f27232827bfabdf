"""Simulated experiments as the command line runs them: a motion of a robot that is not its data sheet."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tauhat.dynamics.base import base_parameters
from tauhat.dynamics.model import torque_model
from tauhat.errors import SimulationError
from tauhat.excitation.fourier import random_fourier
from tauhat.excitation.trajectory import Trajectory
from tauhat.files import write_text
from tauhat.recordings.writing import write_recording
from tauhat.robots.robot import Robot
from tauhat.simulation.experiment import ExperimentSettings, Simulation, simulate
from tauhat.simulation.parameters import TrueParameters
from tauhat.simulation.planned_experiment import MOST_SAMPLES
from tauhat.simulation.sensors import SensorErrors
from tauhat.simulation.truth_file import plant_document
from tauhat.verification.truth import standard_parameters

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


def truth_path(log: Path) -> Path:
    """Return where the truth of a log is kept: `run.truth.json` beside `run.parquet` or `run.csv.gz`."""
    return log.with_name(f"{log.name.removesuffix('.gz').rsplit('.', 1)[0]}.truth.json")


def write_experiment(robot: Robot, simulation: Simulation, log: Path, *, plan: Plan, seed: int) -> Path:
    """Write the log, and its true parameters beside it; return the path of the latter.

    Raises
    ------
    OutputError
        when one of them cannot be written.
    """
    return write_log(robot, simulation, log, notes={"plan": asdict(plan), "seed": seed})


def write_log(robot: Robot, simulation: Simulation, log: Path, *, notes: dict[str, Any]) -> Path:
    """Write the log, and its true parameters with the notes beside it; return the path of the latter.

    Raises
    ------
    OutputError
        when one of them cannot be written.
    """
    write_recording(simulation.recording, log)
    beside = truth_path(log)
    document = truth_document(robot, simulation.truth.parameters) | notes
    write_text(beside, json.dumps(document, indent=1, allow_nan=False))
    return beside


def truth_document(robot: Robot, truth: TrueParameters) -> dict[str, Any]:
    """Return the plant, and its standard and base parameters in the plain model, as plain data."""
    model = torque_model(robot)
    base = base_parameters(model)
    values = standard_parameters(model, truth)
    standard = zip(model.parameters, values.tolist(), strict=True)
    kept = zip(base.independent, base.formulas(), (base.projection @ values).tolist(), strict=True)
    return plant_document(truth) | {
        "robot": robot.name,
        "parameters": [{"name": known.name, "value": value, "unit": known.unit} for known, value in standard],
        "base_parameters": [
            {"name": base.names[index], "formula": formula, "value": value, "unit": model.parameters[index].unit}
            for index, formula, value in kept
        ],
    }
