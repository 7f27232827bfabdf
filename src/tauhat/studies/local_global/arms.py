"""One true arm: its logs of all motions, the models fitted to them, and their errors where none was fitted."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from tauhat.blas import single_threaded
from tauhat.dynamics.model import torque_model
from tauhat.errors import SimulationError, TauhatWarning
from tauhat.estimation import identify
from tauhat.estimation.estimators import estimator_named
from tauhat.excitation.trajectory import Trajectory
from tauhat.recordings.recording import Recording
from tauhat.robots.robot import Robot
from tauhat.simulation.experiment import simulate
from tauhat.simulation.parameters import TrueParameters
from tauhat.simulation.planned_experiment import PlannedExperiment
from tauhat.studies.error_budget.typical import typical_experiment
from tauhat.studies.local_global.motions import Motions, elsewhere
from tauhat.verification.prediction import verify

JUDGED = ("path, warm", "path, cold", "elsewhere")
"""Motions that models are judged on."""
_STREAM = 20261123
_TRUTH, _SENSORS, _POSES, _NOISE = range(4)


@dataclass(frozen=True, slots=True, kw_only=True)
class Plant:
    """What the true arms have and the models do not know.

    spread : of the parameters around the description
    gap : backlash of every elastic joint [rad or m]
    warm_up : by how much the joints are warmer in a warm run [K]
    friction : kind of it, one of `KINDS`
    timestep : of the integrator; the teeth of a light joint are hard [s]
    """

    spread: float = 0.1
    gap: float = 3e-4
    warm_up: float = 20.0
    friction: str = "load-coulomb"
    timestep: float = 1e-4

    def __post_init__(self) -> None:
        if not 0.0 <= self.gap < np.inf:
            raise SimulationError("backlash of the plant", expected="at least 0", got=self.gap)
        if not 0.0 <= self.warm_up <= 100.0:
            raise SimulationError("warm-up of the plant", expected="0 to 100 K", got=self.warm_up)

    def experiment(self, robot: Robot) -> PlannedExperiment:
        """Return the typical experiment with this plant, cold.

        Raises
        ------
        SimulationError
            when the robot does not state a largest torque.
        """
        usual = typical_experiment(robot)
        bent = usual.elasticity
        return replace(
            usual,
            spread=self.spread,
            friction=self.friction,
            elasticity=None if bent is None else replace(bent, gap=np.array(self.gap)),
            settings=replace(usual.settings, timestep=self.timestep),
        )


class TorqueError(NamedTuple):
    """Error of a model's torque on one motion.

    relative : over the torque, all joints
    joints : root mean square, joint by joint [Nm or N]
    """

    relative: float
    joints: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ArmFigures:
    """What was found of one arm.

    errors : by model and judged motion
    fitted : residual over torque of each model on what it was fitted to
    condition : scaled condition number of each fit
    torque : root mean square of each judged motion's torque, joint by joint [Nm or N]
    """

    errors: Mapping[tuple[str, str], TorqueError]
    fitted: Mapping[str, float]
    condition: Mapping[str, float]
    torque: Mapping[str, tuple[float, ...]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Arm:
    """The work on one true arm.

    seconds : of the motion elsewhere, about [s]
    cutoff : low-pass of all fits and judgements [Hz]
    """

    robot: Robot
    plant: Plant
    motions: Motions
    seed: int
    seconds: float
    terms: str
    estimator: str
    cutoff: float

    def logs(self) -> dict[str, Recording]:
        """Return the logs of all motions, those to identify from and those to judge on, by name."""
        cold = self._truth()
        heat = cold.heat
        warm = cold if heat is None else replace(cold, heat=replace(heat, initial=heat.initial + self.plant.warm_up))
        away = elsewhere(self.robot, self.seconds, self._random(_POSES))
        runs: dict[str, tuple[Trajectory, TrueParameters]] = {
            **{name: (motion, warm) for name, motion in self.motions.fitted.items()},
            "path, warm": (self.motions.path, warm),
            "path, cold": (self.motions.path, cold),
            "elsewhere": (away, warm),
        }
        return {name: self._run(number, name, *run) for number, (name, run) in enumerate(runs.items())}

    def figures(self) -> ArmFigures:
        """Return the errors of all models; a model never sees a log that it is judged on."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", TauhatWarning)  # weak motions are what the study is about
            logs = self.logs()
            return self._judged(logs)

    def _judged(self, logs: Mapping[str, Recording]) -> ArmFigures:
        model, method = torque_model(self.robot, self.terms), estimator_named(self.estimator)
        judged = [logs[name] for name in JUDGED]
        errors: dict[tuple[str, str], TorqueError] = {}
        fitted, condition, torque = {}, {}, {}
        for fit, names in self.motions.fits.items():
            estimate = identify(model, [logs[name] for name in names], estimator=method, cutoff=self.cutoff)
            fitted[fit], condition[fit] = estimate.relative_rms, float(estimate.condition)
            for name, log in zip(JUDGED, verify(estimate, judged).logs, strict=True):
                errors[fit, name] = TorqueError(log.relative_rms, tuple(joint.rms for joint in log.joints))
                torque[name] = tuple(np.sqrt(np.mean(log.tau**2, axis=0)).tolist())
        return ArmFigures(errors=errors, fitted=fitted, condition=condition, torque=torque)

    def _truth(self) -> TrueParameters:
        return self.plant.experiment(self.robot).truth(self._random(_TRUTH))

    def _run(self, number: int, name: str, motion: Trajectory, truth: TrueParameters) -> Recording:
        settings = self.plant.experiment(self.robot).settings
        sensors = settings.sensors.drawn(self.robot.n_v, self._random(_SENSORS))
        done = simulate(
            self.robot, motion, rng=self._random(_NOISE, number), parameters=truth,
            settings=replace(settings, sensors=sensors),
        )  # fmt: skip
        return replace(done.recording, name=name)

    def _random(self, *purpose: int) -> np.random.Generator:
        return np.random.default_rng([_STREAM, self.seed, *purpose])


@single_threaded
def figures_of(arm: Arm) -> ArmFigures:
    """Return what is found of one arm."""
    return arm.figures()
