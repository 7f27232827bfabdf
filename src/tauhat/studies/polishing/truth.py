"""True arms for polishing: friction that remembers its displacement and warms up, and what calibration did not see."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import SimulationError
from tauhat.excitation.trajectory import Trajectory
from tauhat.robots.robot import Robot
from tauhat.simulation.heat import FrictionHeat
from tauhat.simulation.laws import Bristles, LoadedBristles, StribeckBump
from tauhat.simulation.parameters import TrueParameters, perturbed
from tauhat.simulation.sensors import SensorErrors, sensor_preset
from tauhat.simulation.typical import LENGTHS, top_speeds

Difficulty: TypeAlias = Literal["easy", "hard"]
DIFFICULTIES: tuple[Difficulty, ...] = ("easy", "hard")
AMBIENT = 20.0  # [deg C]
_RISE = 20.0  # [K] that the calibration motion brings in the end
_SAMPLES = 400  # of a motion over which its friction power is averaged
_STRIBECK = (0.02, 0.1)  # speed of the fall, in parts of the speed limit
_FINE = (0.5, 0.8)  # part of dry friction on the fine bristles
_LOAD = (0.02, 0.05)  # friction in parts of the load
_SETTLED = 1e-3  # [W] at least, that heat a joint


@dataclass(frozen=True, slots=True, kw_only=True)
class PlantSettings:
    """What the true arms are like.

    spread : of the parameters around the description
    lost : smallest and largest part of a joint's friction that is gone in the end, when calibration goes on for long
    time_constant : smallest and largest, of warming, easy and hard [s]
    stribeck : extra friction near standstill in parts of Coulomb friction, easy and hard
    length : of the bristles in parts of what the model assumes, easy and hard; spread by up to two either way
    sensors : preset of the sensors' errors
    tool_friction : smallest and largest between tool and workpiece, over normal force
    wrong : standard deviation of what changed since calibration where it is hard: gravity of each link and the torque
        constant of each drive, in parts of one
    """

    spread: float = 0.1
    lost: tuple[float, float] = (0.25, 0.35)
    time_constant: tuple[tuple[float, float], tuple[float, float]] = ((250.0, 400.0), (400.0, 900.0))
    stribeck: tuple[float, float] = (0.1, 0.3)
    length: tuple[float, float] = (1.0, 3.0)
    sensors: str = "industrial-arm"
    tool_friction: tuple[float, float] = (0.1, 0.3)
    wrong: float = 0.02

    def __post_init__(self) -> None:
        if not 0.0 <= self.lost[0] <= self.lost[1] < 1.0:
            raise SimulationError("friction lost by warmth", expected="two parts of one, in order", got=self.lost)
        for constant in self.time_constant:
            if not 0.0 < constant[0] <= constant[1] < np.inf:
                raise SimulationError("time constants of warming", expected="two times, in order", got=constant)
        if not 0.0 <= self.wrong < 0.5:
            raise SimulationError("what changed since calibration", expected="a part of one", got=self.wrong)

    def truth(
        self, robot: Robot, difficulty: Difficulty, motion: Trajectory, rng: np.random.Generator
    ) -> TrueParameters:
        """Return a random arm, cold.

        Parameters
        ----------
        motion : that heats the joints by 20 K when it goes on for long
        """
        hard = DIFFICULTIES.index(difficulty)
        given = perturbed(robot, rng, spread=self.spread)
        n_v, top = robot.n_v, top_speeds(robot)
        fine, scale = rng.uniform(*_FINE, n_v), self.length[hard] * np.exp2(rng.uniform(-1.0, 1.0, n_v))
        bristles = Bristles(
            fine=fine * given.coulomb, coarse=(1.0 - fine) * given.coulomb,
            fine_length=LENGTHS[0] * scale, coarse_length=LENGTHS[1] * scale,
        )  # fmt: skip
        speed = top * rng.uniform(*_STRIBECK, n_v)
        fall = StribeckBump(torque=self.stribeck[hard] * given.coulomb, speed=speed, width=0.1 * speed)
        load = LoadedBristles(ratio=rng.uniform(*_LOAD, n_v), length=np.full(n_v, LENGTHS[0]))
        heat = self._heat(given, motion, self.time_constant[hard], rng)
        laws = (*given.laws, bristles, fall, *((load,) if hard else ()))
        slopes = np.tile(heat.coulomb, (len(laws), 1))
        return replace(given, coulomb=np.zeros(n_v), laws=laws, heat=replace(heat, laws=slopes))

    def _heat(
        self, given: TrueParameters, motion: Trajectory, constants: tuple[float, float], rng: np.random.Generator
    ) -> FrictionHeat:
        dq = np.abs(motion.sample(np.linspace(0.0, motion.duration, _SAMPLES)).dq)
        power = np.mean(dq * (given.coulomb + given.viscous * dq), axis=0)
        constant, lost = rng.uniform(*constants, given.n_v), rng.uniform(*self.lost, given.n_v)
        slope, left = -lost / _RISE, 1.0 - lost  # what is left of the friction heats in the end
        return FrictionHeat(
            heating=_RISE / (left * np.maximum(power, _SETTLED) * constant), time_constant=constant, viscous=slope,
            coulomb=slope, initial=np.full(given.n_v, AMBIENT), laws=np.zeros((0, given.n_v)), ambient=AMBIENT,
            reference=AMBIENT,
        )  # fmt: skip

    def sensed_by(self, robot: Robot, rng: np.random.Generator) -> SensorErrors:
        """Return the sensors of one arm, drawn once for all of its logs."""
        return sensor_preset(self.sensors, robot).drawn(robot.n_v, rng)

    def changed(self, sensors: SensorErrors, n_v: int, rng: np.random.Generator) -> SensorErrors:
        """Return the sensors with torque constants that are others than at the calibration."""
        factor = np.broadcast_to(np.asarray(sensors.torque_factor, dtype=np.float64), (n_v,))
        return replace(sensors, torque_factor=factor * np.exp(self.wrong * rng.standard_normal(n_v)))

    def heavier(self, truth: TrueParameters, rng: np.random.Generator) -> TrueParameters:
        """Return the arm with links that weigh a little more or less than at the calibration."""
        return replace(truth, inertia=truth.inertia * np.exp(self.wrong * rng.standard_normal(truth.n_v))[:, None])


def at_temperature(truth: TrueParameters, temperature: FloatArray) -> TrueParameters:
    """Return the arm with joints at these temperatures, (n_v,) [deg C]."""
    if truth.heat is None:
        return truth
    return replace(truth, heat=replace(truth.heat, initial=np.array(temperature)))
