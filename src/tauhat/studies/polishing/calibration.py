"""Models of an arm from one long recording that begins cold: the textbook's, one without warmth, and one with it."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.model import torque_model
from tauhat.errors import TauhatWarning
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.identify import identify
from tauhat.excitation.trajectory import Trajectory
from tauhat.recordings.recording import Recording
from tauhat.robots.robot import Robot
from tauhat.simulation.experiment import ExperimentSettings, simulate
from tauhat.simulation.parameters import TrueParameters
from tauhat.simulation.sensors import SensorErrors

TEXTBOOK, STEADY, THERMAL = "textbook", "steady", "thermal"
_WARM = 0.5  # of the recording, behind which an arm counts as warm


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationSettings:
    """How models are made.

    seconds : of the recording, which begins cold
    rate : of its samples [Hz]
    textbook : terms of a model with friction as in textbooks
    steady : terms of a model whose friction remembers displacement; with `thermal` added, of the third
    """

    seconds: float = 900.0
    rate: float = 125.0
    textbook: str = "plain"
    steady: str = "inertia,rotor,viscous,dahl,offset"

    def terms(self, kind: str) -> str:
        """Return the terms of a kind of model."""
        return {TEXTBOOK: self.textbook, STEADY: self.steady, THERMAL: f"{self.steady},thermal"}[kind]


def calibration_log(
    robot: Robot,
    truth: TrueParameters,
    motion: Trajectory,
    *,
    sensors: SensorErrors,
    settings: CalibrationSettings,
    rng: np.random.Generator,
) -> tuple[Recording, FloatArray]:
    """Return the log of a motion, without temperatures, and the joints' true temperatures behind it, (n_v,) [deg C].

    Parameters
    ----------
    motion : as long as the recording shall be
    """
    experiment = ExperimentSettings(timestep=1e-3, control_rate=1000.0, sample_rate=settings.rate, sensors=sensors)
    run = simulate(robot, motion, rng=rng, parameters=truth, settings=experiment)
    return replace(run.recording, temperature=None), np.array(run.truth.temperature[-1])


def calibrated(robot: Robot, log: Recording, settings: CalibrationSettings) -> Mapping[str, Estimate]:
    """Return a model of each kind; those without warmth from the second half, when the arm is warm."""
    warm = log.rows(round(_WARM * len(log.t)), len(log.t))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)  # the study compares models that are known to lack something
        return {
            kind: identify(torque_model(robot, settings.terms(kind)), [log if kind == THERMAL else warm])
            for kind in (TEXTBOOK, STEADY, THERMAL)
        }
