"""What a page about a motion tells: how it uses the limits, and how well each parameter will be known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.dynamics.base import random_motion
from tauhat.dynamics.model import torque_model
from tauhat.dynamics.motion import Motion
from tauhat.errors import ExcitationError
from tauhat.excitation.information import Information, information
from tauhat.excitation.limits import MotionLimits, motion_limits
from tauhat.excitation.trajectory import MotionSamples, Trajectory
from tauhat.robots.robot import Robot

_SAMPLES = 2000
_STATES = 10_000
_SEED = 20261121
_STILL = 1e-6  # of the limits: slower than this at both ends, and as near to the start at the end, is at rest


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MotionCase:
    """A motion and what it is worth, beside independent random states in the limits.

    robot : which moves
    limits : of the joints
    samples : one run of the motion
    margins : unused parts of limits by their names
    names, joints : (n,) parameters that are judged, and the joint of each
    singular, singular_random : (n,) singular values of the scaled regressor over sqrt(N), largest first
    deviations, deviations_random : (n,) standard deviation of each scaled parameter at unit torque noise, times sqrt(N)
    rests : whether the motion starts and ends at rest in one pose, so that it may be repeated
    """

    robot: Robot
    limits: MotionLimits
    samples: MotionSamples
    margins: Mapping[str, float]
    names: tuple[str, ...]
    joints: tuple[int, ...]
    singular: FloatArray
    singular_random: FloatArray
    deviations: FloatArray
    deviations_random: FloatArray
    rests: bool

    def __post_init__(self) -> None:
        for name in ("singular", "singular_random", "deviations", "deviations_random"):
            object.__setattr__(self, name, frozen(name, getattr(self, name), (len(self.names),)))

    @property
    def condition(self) -> float:
        """Condition number of the scaled regressor."""
        return float(self.singular[0] / self.singular[-1])

    @property
    def ratios(self) -> FloatArray:
        """Standard deviation of each parameter over that from as many independent random states, (n,)."""
        return np.asarray(self.deviations / self.deviations_random)

    def used(self) -> FloatArray:
        """Return the largest used part of the position, velocity and acceleration limit of each joint, (n_v, 3)."""
        limits, samples = self.limits, self.samples
        middle, reach = 0.5 * (limits.upper + limits.lower), 0.5 * (limits.upper - limits.lower)
        parts = (np.abs(samples.q - middle) / reach, np.abs(samples.dq) / limits.velocity)
        return np.column_stack([part.max(axis=0) for part in (*parts, np.abs(samples.ddq) / limits.acceleration)])


def motion_case(
    robot: Robot,
    trajectory: Trajectory,
    *,
    counted: Information | None = None,
    limits: MotionLimits | None = None,
    margins: Mapping[str, float] | None = None,
) -> MotionCase:
    """Return what a page tells about a motion.

    Parameters
    ----------
    counted : columns that are judged; those of the plain terms by default
    limits : of the joints; the robot's own by default
    margins : unused parts of limits by their names

    Raises
    ------
    ExcitationError
        when the motion leaves a parameter without excitation.
    """
    facts = counted or information(torque_model(robot))
    model, room = facts.model, limits or motion_limits(robot)
    samples = trajectory.sample(np.linspace(0.0, trajectory.duration, _SAMPLES, endpoint=False))
    rows = [np.ascontiguousarray(part.T) for part in (samples.q, samples.dq, samples.ddq)]
    singular, deviations = _spectrum(facts.matrix(Motion(q=rows[0], dq=rows[1], ddq=rows[2])), robot)
    states = random_motion(robot, _STATES, np.random.default_rng(_SEED))
    singular_random, deviations_random = _spectrum(facts.matrix(states), robot)
    return MotionCase(
        robot=robot,
        limits=room,
        samples=samples,
        margins=margins or {},
        names=tuple(model.parameters[index].name for index in facts.columns),
        joints=tuple(model.parameters[index].joint for index in facts.columns),
        singular=singular,
        singular_random=singular_random,
        deviations=deviations,
        deviations_random=deviations_random,
        rests=_rests(trajectory, room),
    )


def _rests(trajectory: Trajectory, limits: MotionLimits) -> bool:
    ends = trajectory.sample(np.array([0.0, trajectory.duration]))
    parts = (
        np.abs(ends.q[1] - ends.q[0]) / (limits.upper - limits.lower),
        np.abs(ends.dq) / limits.velocity,
        np.abs(ends.ddq) / limits.acceleration,
    )
    return all(float(part.max()) <= _STILL for part in parts)


def _spectrum(matrix: FloatArray, robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Return singular values, largest first, and the square roots of the inverse's diagonal."""
    eigenvalues, axes = np.linalg.eigh(matrix)
    if eigenvalues[0] <= 0.0:
        raise ExcitationError("the motion leaves a column of the model without excitation", where=robot.name)
    return np.sqrt(eigenvalues[::-1]), np.sqrt((axes**2) @ (1.0 / eigenvalues))
