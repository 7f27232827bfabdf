"""The arm that is rehearsed: a true robot with its sensors, its motions, and the logs that it makes of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.excitation.design import Design
from tauhat.excitation.limits import MotionLimits, motion_limits
from tauhat.excitation.point_to_point import point_to_point
from tauhat.excitation.repeated import Repeated
from tauhat.excitation.static_motion import static_motion
from tauhat.excitation.sweep import sweep
from tauhat.excitation.task_path import task_path
from tauhat.excitation.trajectory import Trajectory
from tauhat.robots.robot import Robot
from tauhat.simulation.attached import AttachedBody
from tauhat.simulation.experiment import Simulation, simulate
from tauhat.simulation.parameters import TrueParameters
from tauhat.simulation.planned_experiment import PlannedExperiment

MotionName: TypeAlias = Literal["designed", "point to point", "sine sweep", "task path", "static", "loaded"]
UNSEEN: tuple[MotionName, ...] = ("point to point", "sine sweep", "task path")
_MARGIN = 0.2  # of the joints' limits that unseen motions leave unused
_SWEEP_SPEED, _PATH_SPEED = 0.6, 0.6  # parts of the limits
_MOST_POSES = 40
_HOLD, _AWAY, _STATIC_SPEED = 1.2, 0.1, 0.3  # [s, rad or m, part of the speed limit]
_STATIC_RANGE = 0.3  # of half the joints' ranges, about their middle
_STREAM = 20261121  # of all random numbers of a whole rehearsal
_TRUTH, _SENSORS, _DESIGN, _POSES, _NOISE = range(5)
_NAMES: tuple[MotionName, ...] = ("designed", *UNSEEN, "static", "loaded")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scene:
    """A true robot, and what it is asked to do.

    experiment : description, rates and controller; its sensors are those of this one robot
    truth : parameters of the plant, which no method sees
    design : one period of the motion to identify from
    motions : by name
    payload : what the robot carries on the loaded run
    """

    experiment: PlannedExperiment
    truth: TrueParameters
    design: Design
    motions: dict[MotionName, Trajectory]
    payload: AttachedBody

    @property
    def robot(self) -> Robot:
        """The robot as it is described."""
        return self.experiment.robot

    def run(self, name: MotionName) -> Simulation:
        """Return the log of a motion, with its truth."""
        loaded = replace(self.truth, attached=(*self.truth.attached, self.payload))
        parameters = loaded if name == "loaded" else self.truth
        noise = _random(self.experiment, _NOISE, _NAMES.index(name))
        settings = self.experiment.settings
        done = simulate(self.robot, self.motions[name], rng=noise, parameters=parameters, settings=settings)
        return replace(done, recording=replace(done.recording, name=name))


def staged(experiment: PlannedExperiment, payload: AttachedBody, *, unseen_seconds: float, poses: int) -> Scene:
    """Return the scene of an experiment: truth and sensors drawn, motions made.

    Parameters
    ----------
    unseen_seconds : of each motion that is verified on, about [s]
    poses : that are held for the static check

    Raises
    ------
    ExcitationError, RobotError
        when no motion can be designed.
    """
    robot = experiment.robot
    design = experiment.motion.designed(robot, _random(experiment, _DESIGN))
    fitted = Repeated(series=design.trajectory, periods=experiment.motion.periods)
    sensors = experiment.settings.sensors.drawn(robot.n_v, _random(experiment, _SENSORS))
    limits, rng = motion_limits(robot, margin=_MARGIN), _random(experiment, _POSES)
    motions: dict[MotionName, Trajectory] = {
        "designed": fitted,
        "point to point": _from_pose_to_pose(limits, unseen_seconds, rng),
        "sine sweep": sweep(limits, duration=unseen_seconds, speed=_SWEEP_SPEED),
        "task path": _path(limits, unseen_seconds, rng),
        "static": _held(robot, poses, rng),
        "loaded": fitted,
    }
    return Scene(
        experiment=replace(experiment, settings=replace(experiment.settings, sensors=sensors)),
        truth=experiment.truth(_random(experiment, _TRUTH)),
        design=design,
        motions=motions,
        payload=payload,
    )


def _from_pose_to_pose(limits: MotionLimits, seconds: float, rng: np.random.Generator) -> Trajectory:
    poses = _poses(limits, rng)
    ways = int(np.searchsorted(np.cumsum(point_to_point(poses, limits).times), seconds)) + 1
    return point_to_point(poses[: ways + 1], limits)


def _path(limits: MotionLimits, seconds: float, rng: np.random.Generator) -> Trajectory:
    poses = _poses(limits, rng)
    path = task_path(poses[:3], limits, speed=_PATH_SPEED)
    for corners in range(4, _MOST_POSES):
        if path.duration >= seconds:
            break
        path = task_path(poses[:corners], limits, speed=_PATH_SPEED)
    return path


def _held(robot: Robot, count: int, rng: np.random.Generator) -> Trajectory:
    limits = motion_limits(robot)
    middle, half = 0.5 * (limits.upper + limits.lower), 0.5 * (limits.upper - limits.lower)
    poses = middle + _STATIC_RANGE * half * rng.uniform(-1.0, 1.0, (count, robot.n_v))
    return static_motion(robot, poses, hold=_HOLD, away=_AWAY, speed=_STATIC_SPEED)


def _poses(limits: MotionLimits, rng: np.random.Generator) -> FloatArray:
    return limits.lower + rng.uniform(size=(_MOST_POSES, limits.lower.size)) * (limits.upper - limits.lower)


def _random(experiment: PlannedExperiment, *purpose: int) -> np.random.Generator:
    return np.random.default_rng([_STREAM, experiment.robot_seed, *purpose])
