"""Joint motions that take the tool along a task, on one branch of the inverse kinematics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import ExcitationError
from tauhat.excitation.point_to_point import Course
from tauhat.excitation.waypoints.line_task import TaskMotion
from tauhat.robots.inverse_kinematics import FrameKinematics, Placement, smallest_singular_value
from tauhat.robots.robot import Robot

TaskCurve: TypeAlias = Callable[[Course], TaskMotion]

_SOLVED = 1e-13  # [m, rad] left over where a task is reached, but for rounding
_ROUNDED = 1e-10  # [m, rad] what counts as reached when rounding stops the search
_MOST_STEPS = 12
_FEWEST_STEPS = 32  # of a curve when it is first followed
_LEAST_STEP = 1.0 / (_FEWEST_STEPS * 2**10)
_FORESEEN = 0.02  # [rad or m] by which a joint may miss its tangent in one step of following a curve
_POSE_AXES = 6


class JointState(NamedTuple):
    """Positions, velocities and accelerations of the joints, (n_t, n_v) each."""

    q: FloatArray
    dq: FloatArray
    ddq: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Knots:
    """A curve of the joints at some of its parts: where exact solutions are looked for in between.

    part : (n,) from 0 to 1
    q, slope : (n, n_v) position and its derivative by the part
    """

    part: FloatArray
    q: FloatArray
    slope: FloatArray

    def __post_init__(self) -> None:
        part = frozen("part", self.part, (None,), where="knots")
        object.__setattr__(self, "part", part)
        for name in ("q", "slope"):
            object.__setattr__(self, name, frozen(name, getattr(self, name), (part.size, None), where="knots"))

    def near(self, part: FloatArray) -> FloatArray:
        """Return the cubic Hermite interpolant at parts of the curve, (n_t, n_v)."""
        left = np.clip(np.searchsorted(self.part, part, side="right") - 1, 0, self.part.size - 2)
        step = (self.part[left + 1] - self.part[left])[:, None]
        u = (part - self.part[left])[:, None] / step
        before, after = self.q[left], self.q[left + 1]
        bend = u * (1.0 - u) * step * ((1.0 - u) * self.slope[left] - u * self.slope[left + 1])
        return np.asarray(before + (after - before) * u**2 * (3.0 - 2.0 * u) + bend)


class LineSolver:
    """Solves tasks of one frame for one robot's joints; it owns work space, and travels as its settings alone.

    spare : the joints that the tool leaves free on an arm with more than six
    singular : smallest singular value of the Jacobian on the way
    """

    __slots__ = ("_kinematics", "_rows", "frame", "robot", "singular", "spare")

    def __init__(self, robot: Robot, frame: str, spare: tuple[int, ...], singular: float) -> None:
        self.robot, self.frame, self.spare, self.singular = robot, frame, spare, singular
        self._kinematics = FrameKinematics(robot, frame)
        self._rows = np.eye(robot.n_v)[list(spare)]

    def __reduce__(self) -> tuple[type[LineSolver], tuple[Robot, str, tuple[int, ...], float]]:
        """Return how to make it again."""
        return type(self), (self.robot, self.frame, self.spare, self.singular)

    def states(self, task: TaskMotion, near: FloatArray) -> JointState:
        """Return the joint motion of a task, from positions near it.

        `J dq = velocity`, `J ddq = acceleration - drift(q, dq)`, with a row of J for each free joint.
        """
        q, dq, ddq = np.empty_like(near), np.empty_like(near), np.empty_like(near)
        drift = np.zeros(self.robot.n_v)
        for k, seed in enumerate(near):
            found = self._solved(task, k, seed)
            if found is None:
                raise ExcitationError("the tool cannot follow the line", where=self.robot.name, got="no solution")
            q[k], jacobian = found
            dq[k] = np.linalg.solve(jacobian, task.velocity[k])
            drift[:_POSE_AXES] = self._kinematics.drift(q[k], dq[k])
            ddq[k] = np.linalg.solve(jacobian, task.acceleration[k] - drift)
        return JointState(q, dq, ddq)

    def follow(self, curve: TaskCurve, start: FloatArray, name: str) -> Knots:
        """Return knots of a curve that begins at a joint position; steps shorten where the joints bend much.

        Raises
        ------
        ExcitationError
            when the curve leaves the reach of the arm, or passes a singularity: names which, and where.
        """
        parts, positions, slopes = [0.0], [start], []
        step, orientation = 1.0 / _FEWEST_STEPS, 0.0
        while True:
            task = curve(_at(parts[-1]))
            found = self._solved(task, 0, positions[-1])
            if found is None:
                raise self._lost(name, parts[-1])
            sign = self._checked(found[1], name, parts[-1])
            if sign * orientation < 0.0:
                raise self._refused(name, parts[-1], 0.0)
            orientation = sign
            slopes.append(np.linalg.solve(found[1], task.velocity[0]))
            positions[-1] = found[0]
            if parts[-1] == 1.0:
                return Knots(part=np.array(parts), q=np.array(positions), slope=np.array(slopes))
            step, ahead = self._step(curve, (parts[-1], positions[-1], slopes[-1]), 2.0 * step)
            if ahead is None:
                raise self._lost(name, parts[-1])
            parts.append(min(1.0, parts[-1] + step))
            positions.append(ahead)

    def _step(
        self, curve: TaskCurve, here: tuple[float, FloatArray, FloatArray], longest: float
    ) -> tuple[float, FloatArray | None]:
        """Return the longest step after which the joints are near their tangent, and where they are then."""
        part, q, slope = here
        step = min(longest, 1.0 / _FEWEST_STEPS)
        while step >= _LEAST_STEP:
            to = min(1.0, part + step)
            foreseen = q + (to - part) * slope
            found = self._solved(curve(_at(to)), 0, foreseen)
            if found is not None and np.abs(found[0] - foreseen).max() <= _FORESEEN:
                return step, found[0]
            step *= 0.5
        return step, None

    def _solved(self, task: TaskMotion, k: int, q: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Return the position of a task near another, and the Jacobian there; None where there is none."""
        spare = list(self.spare)
        for _ in range(_MOST_STEPS):
            placement = self._kinematics.at(q)
            error = np.append(placement.distance_to(task.rotation[k], task.translation[k]), task.spare[k] - q[spare])
            jacobian = np.vstack([placement.jacobian, self._rows])
            size = np.abs(error).max()
            if size < _SOLVED:
                return q, jacobian
            try:
                step = np.linalg.solve(jacobian, error)
            except np.linalg.LinAlgError:
                return None
            if np.abs(step).max() > 1.0:
                return None
            q = q + step
        return (q, jacobian) if size < _ROUNDED else None

    def _checked(self, jacobian: FloatArray, name: str, part: float) -> float:
        """Return the sign of a Jacobian's determinant, or refuse it."""
        least = smallest_singular_value(jacobian)
        if least < self.singular:
            raise self._refused(name, part, least)
        return float(np.linalg.slogdet(jacobian)[0])

    def _refused(self, name: str, part: float, least: float) -> ExcitationError:
        return ExcitationError(
            f"{name} passes a singularity of the arm at {part:.0%} of the way", where=self.robot.name,
            expected=f"smallest singular value >= {self.singular:g}", got=f"{least:.2g}",
            remedy="another line, or a joint move",
        )  # fmt: skip

    def _lost(self, name: str, part: float) -> ExcitationError:
        return ExcitationError(
            f"{name} leaves the reach of the arm", where=self.robot.name,
            got=f"no solution beyond {part:.0%} of the way", remedy="a nearer target, or a joint move",
        )  # fmt: skip


def spare_joints(robot: Robot, q: FloatArray, frame: str) -> tuple[int, ...]:
    """Return the joints beyond six that the tool can best do without at a position.

    Held, they leave the others the largest smallest singular value.

    Raises
    ------
    ExcitationError
        when the arm has fewer than six joints.
    """
    if robot.n_v < _POSE_AXES:
        raise ExcitationError(
            "a line move needs six joints or more", where=robot.name, got=robot.n_v, remedy="use joint moves"
        )
    placement: Placement = FrameKinematics(robot, frame).at(q)
    choices = combinations(range(robot.n_v), robot.n_v - _POSE_AXES)
    return max(
        choices, key=lambda held: smallest_singular_value(np.delete(placement.jacobian, list(held), axis=1))
    )  # fmt: skip


def _at(part: float) -> Course:
    """Return the course of a curve passed at unit speed, at one part."""
    return Course(np.array([part]), np.ones(1), np.zeros(1))
