"""An arm that warms up, its logs in air, and logs in which known forces push at its tool."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.excitation.fourier import FourierSeries, random_fourier
from tauhat.excitation.limits import motion_limits
from tauhat.excitation.repeated import Repeated
from tauhat.excitation.task_path import task_path
from tauhat.excitation.trajectory import Trajectory
from tauhat.recordings.recording import Recording
from tauhat.robots.library import load_robot
from tauhat.robots.robot import Robot
from tauhat.sensing.wrench import WrenchSolver
from tauhat.simulation.experiment import ExperimentSettings, simulate
from tauhat.simulation.heat import FrictionHeat
from tauhat.simulation.parameters import TrueParameters
from tauhat.simulation.sensors import sensor_preset
from tauhat.simulation.typical import typical_plant

Warmth: TypeAlias = Literal["cold", "warm"]
Pace: TypeAlias = Literal["moving", "standing"]

_AMBIENT, _RISE = 20.0, 20.0  # [deg C, K] surroundings, and what the motion of the warm-up brings
_STREAM = 20261121  # of all random numbers of this study
_PERIOD, _HARMONICS, _MARGIN = 20.0, 5, 0.2
_WAYS = 3  # of the work in air, cold and warm each
_POSES, _SPREAD = 8, 0.4  # of the work's path, and how far they are from its middle [rad]
_STEP = 0.01  # [rad] between the poses of standing, passed very slowly
_FIRST_PUSH, _PUSH, _EVERY, _RAMP = 2.0, 1.0, 2.5, 0.2  # [s]


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneSettings:
    """What the arm is like and what it does.

    robot : a built-in name or a file
    friction : kind of `typical_plant`
    sensors : preset of their errors
    lost : part of friction that is gone when the arm is warm
    time_constant : of warming [s]
    warm_up : length of the recording that models are fitted to [s]
    middle : of the poses of the work [rad]
    speed : of the work, part of the limits
    force : standard deviation of each component of a push [N]
    rate : of the logs [Hz]
    """

    robot: str = "ur5e"
    friction: str = "dahl"
    sensors: str = "industrial-arm"
    lost: float = 0.3
    time_constant: float = 100.0
    warm_up: float = 400.0
    middle: tuple[float, ...] = (0.0, -1.3, 1.6, -1.8, -1.4, 0.0)
    speed: float = 0.1
    force: float = 30.0
    rate: float = 250.0


class PushedLog(NamedTuple):
    """A log with pushes: force in base axes (n_t, 3) [N], and external joint torque (n_t, n_v) [Nm or N]."""

    recording: Recording
    force: FloatArray
    torque: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pushes:
    """Forces at the origin of the robot's last frame, one after the other, with ramps.

    starts : (n,) [s]
    forces : (n, 3) in base axes [N]
    """

    solver: WrenchSolver
    starts: FloatArray
    forces: FloatArray

    def force(self, t: FloatArray) -> FloatArray:
        """Return the force at the times t (n_t,), (n_t, 3) [N]."""
        into = np.subtract.outer(t, self.starts)
        share = np.clip(np.minimum(into, _PUSH - into) / _RAMP, 0.0, 1.0)
        return np.asarray(share @ self.forces)

    def torque(self, t: float, q: FloatArray, dq: FloatArray) -> FloatArray:  # noqa: ARG002 - a push knows no speed
        """Return the joint torque (n_v,) of the force at the time t [s]."""
        jacobian, _ = self.solver.jacobian(q)
        return np.asarray(jacobian[:3].T @ self.force(np.array([t]))[0])


class ContactScene:
    """One random arm. Every log is another piece of its life; equal seeds give equal logs."""

    def __init__(self, settings: SceneSettings, seed: int) -> None:
        self.settings, self.seed = settings, seed
        self.robot: Robot = load_robot(settings.robot)
        self.experiment = ExperimentSettings(
            timestep=1e-3, control_rate=1000.0, sample_rate=settings.rate,
            sensors=sensor_preset(settings.sensors, self.robot),
        )  # fmt: skip
        series = random_fourier(self.robot, period=_PERIOD, harmonics=_HARMONICS, rng=self._rng(0))
        self._truth = self._warming(typical_plant(self.robot, settings.friction, rng=self._rng(1)), series)
        repeats = max(1, round(settings.warm_up / _PERIOD))
        run = simulate(
            self.robot, Repeated(series=series, periods=repeats), rng=self._rng(2), parameters=self._at(_AMBIENT),
            settings=self.experiment,
        )  # fmt: skip
        self.warm_up: Recording = run.recording
        self._warm = np.array(run.truth.temperature[-1])

    def in_air(self, warmth: Warmth) -> Iterator[Recording]:
        """Yield logs of the work without contact: ways through random poses, and standing."""
        for place in range(_WAYS):
            yield self._log(self._way(self._rng(10 + place)), warmth, number=20 + place).recording
        yield self._log(self._still(), warmth, number=20 + _WAYS).recording

    def pushed(self, pace: Pace, warmth: Warmth) -> PushedLog:
        """Return a log in which known forces push at the tool, on a way that no log in air has."""
        rng = self._rng(30 + (pace == "standing"))
        motion = self._way(rng) if pace == "moving" else self._still()
        starts = np.arange(_FIRST_PUSH, motion.duration - 1.5 * _PUSH, _EVERY)
        forces = self.settings.force * rng.normal(size=(starts.size, 3))
        pushes = Pushes(solver=WrenchSolver(robot=self.robot), starts=starts, forces=forces)
        return self._log(motion, warmth, number=40, pushes=pushes)

    def _log(self, motion: Trajectory, warmth: Warmth, *, number: int, pushes: Pushes | None = None) -> PushedLog:
        run = simulate(
            self.robot, motion, rng=self._rng(number + (50 if warmth == "warm" else 0)), environment=pushes,
            parameters=self._at(_AMBIENT if warmth == "cold" else self._warm), settings=self.experiment,
        )  # fmt: skip
        t = run.truth.reference.t[run.rows]
        force = np.zeros((t.size, 3)) if pushes is None else pushes.force(t)
        return PushedLog(run.recording, force, run.truth.external_torque[run.rows])

    def _way(self, rng: np.random.Generator) -> Trajectory:
        poses = np.array(self.settings.middle) + rng.uniform(-_SPREAD, _SPREAD, (_POSES, self.robot.n_v))
        limits = motion_limits(self.robot, margin=_MARGIN)
        return task_path(np.clip(poses, limits.lower, limits.upper), limits, speed=self.settings.speed)

    def _still(self) -> Trajectory:
        middle = np.array(self.settings.middle)
        limits = motion_limits(self.robot, margin=_MARGIN)
        return task_path(np.array([middle, middle + _STEP, middle + 2.0 * _STEP]), limits, speed=1e-3)

    def _warming(self, truth: TrueParameters, series: FourierSeries) -> TrueParameters:
        """Return the truth with friction that loses the part `lost` in a long warm-up."""
        samples = series.sample(np.linspace(0.0, _PERIOD, 400))
        power = np.mean(np.abs(samples.dq) * (truth.coulomb + truth.viscous * np.abs(samples.dq)), axis=0)
        constant = np.full(truth.n_v, self.settings.time_constant)
        slope = np.full(truth.n_v, -self.settings.lost / _RISE)
        heat = FrictionHeat(
            heating=_RISE / (np.maximum(power, 1e-3) * constant), time_constant=constant, viscous=slope, coulomb=slope,
            initial=np.full(truth.n_v, _AMBIENT), laws=np.tile(slope, (len(truth.laws), 1)), ambient=_AMBIENT,
            reference=_AMBIENT,
        )  # fmt: skip
        return replace(truth, heat=heat)

    def _at(self, temperature: FloatArray | float) -> TrueParameters:
        heat = self._truth.heat
        if heat is None:
            return self._truth
        initial = np.broadcast_to(np.asarray(temperature, dtype=np.float64), (self.robot.n_v,))
        return replace(self._truth, heat=replace(heat, initial=np.array(initial)))

    def _rng(self, number: int) -> np.random.Generator:
        return np.random.default_rng([_STREAM, self.seed, number])
