"""What gains are tried on: a plant with delay, coarse encoders and noise in the loop, and what a run costs."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, frozen, read_only
from tauhat.control.controller import Controller
from tauhat.control.disturbed import Watched, noisy_sight
from tauhat.errors import ModelError, SimulationError, TauhatWarning
from tauhat.excitation.trajectory import Trajectory
from tauhat.robots.robot import Robot
from tauhat.simulation.closed_loop import Encoder
from tauhat.simulation.experiment import ExperimentSettings, Truth, simulate
from tauhat.simulation.parameters import TrueParameters

_NOISE_ROWS = 16_384  # steps before the noise repeats


def rehearsal_settings() -> ExperimentSettings:
    """Return how a rehearsal is run: 1 kHz, 1 ms of delay, encoders of 2e-5 rad whose differences are the speed."""
    encoder = Encoder(step=2e-5, velocity="differenced")
    return ExperimentSettings(
        timestep=1e-3, control_rate=1000.0, sample_rate=1000.0, settle=0.2, control_delay=1e-3, encoder=encoder
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rehearsal:
    """A plant, a motion, and what the controller sees of it.

    truth : parameters of the plant
    settings : rates, delay, encoders; the controller in it is not looked at
    position_noise, speed_noise : deviations of white noise on what the controller sees [rad, rad/s] or [m, m/s]
    seed : of that noise
    farthest : from the reference at which a run is given up [rad or m]
    """

    robot: Robot
    motion: Trajectory
    truth: TrueParameters
    settings: ExperimentSettings = field(default_factory=rehearsal_settings)
    position_noise: float = 1e-5
    speed_noise: float = 5e-3
    seed: int = 0
    farthest: float = 0.3

    def __post_init__(self) -> None:
        if not min(self.position_noise, self.speed_noise) >= 0.0:
            got = f"{self.position_noise:g}, {self.speed_noise:g}"
            raise ModelError("noise of a rehearsal", expected="deviations >= 0", got=got)
        if not 0.0 < self.farthest < np.inf:
            raise ModelError("farthest of a rehearsal", expected="a positive distance", got=self.farthest)

    def run(self, controller: Controller) -> Truth:
        """Return the true motion under the controller.

        Raises
        ------
        SimulationError
            when the robot goes unstable or is lost.
        """
        rng, n_v = np.random.default_rng(self.seed), self.robot.n_v
        deviations = (np.full(n_v, self.position_noise), np.full(n_v, self.speed_noise))
        sees = noisy_sight(controller, rng, rows=_NOISE_ROWS, deviations=deviations)
        watched = Watched(inner=sees, farthest=np.full(n_v, self.farthest))
        settings = replace(self.settings, controller=watched)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", TauhatWarning)  # torque at its limit: its cost is in the error
            return simulate(self.robot, self.motion, rng=rng, parameters=self.truth, settings=settings).truth

    def judged(self, controller: Controller) -> Judged:
        """Return what a run of the controller is worth; everything infinite where it fails."""
        try:
            done = self.run(controller)
        except SimulationError as error:
            lost = np.full(self.robot.n_v, np.inf)
            return Judged(error=lost, effort=lost, chatter=lost, failure=str(error))
        steps = np.diff(done.tau, axis=0)
        return Judged(
            error=np.sqrt(np.mean((done.reference.q - done.q) ** 2, axis=0)),
            effort=np.sqrt(np.mean(done.tau**2, axis=0)),
            chatter=np.sqrt(np.mean(steps**2, axis=0)),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Judged:
    """What a run is worth, (n_v,) each.

    error : root mean square of the position error [rad or m]
    effort : of the motor torque [Nm or N]
    chatter : of its change from sample to sample [Nm or N]
    failure : why there was no run; empty otherwise
    """

    error: FloatArray
    effort: FloatArray
    chatter: FloatArray
    failure: str = ""

    def __post_init__(self) -> None:
        for array in (self.error, self.effort, self.chatter):
            read_only(array)

    def cost(self, measure: Judged, price: Price) -> float:
        """Return the cost of this run in parts of another one; infinite where it failed."""
        if self.failure:
            return float("inf")
        parts = (self.error / measure.error, self.effort / measure.effort, self.chatter / measure.chatter)
        error, effort, chatter = (float(np.mean(part)) for part in parts)
        return error + price.effort * effort + price.chatter * chatter


class Price(NamedTuple):
    """What torque costs beside error: weights of effort and chatter, the error's being one."""

    effort: float = 0.05
    chatter: float = 0.05


def joint_gains(name: str, value: object, n_v: int) -> FloatArray:
    """Return gains, (n_v,), that can be scaled: none is zero.

    Raises
    ------
    ModelError
        when one is not positive.
    """
    gains = frozen(name, value, (n_v,), where="gains to tune")
    if not gains.min() > 0.0:
        raise ModelError(f"{name} to begin with", expected="positive gains", got=f"{gains.min():g}")
    return gains
