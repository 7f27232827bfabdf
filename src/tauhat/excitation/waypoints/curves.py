"""The curves that a motion runs along: ways from target to target, the corners between them, and standing still."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.excitation.point_to_point import Course
from tauhat.excitation.waypoints.line_solver import JointState, Knots, LineSolver
from tauhat.excitation.waypoints.line_task import Line, TaskMotion, corner_task
from tauhat.excitation.waypoints.ramps import Ramps


class Curve(Protocol):
    """Joint positions by a part from 0 to 1.

    polynomial : whether positions are polynomials of the part, so that little hides between samples
    """

    @property
    def polynomial(self) -> bool: ...  # noqa: D102

    def state(self, course: Course) -> JointState:
        """Return the motion of the joints when the part runs like this, (n_t, n_v) each."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stand:
    """A position that is held.

    q : (n_v,) [rad or m]
    """

    polynomial: ClassVar[bool] = True
    q: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "q", frozen("q", self.q, (None,), where="stand"))

    def state(self, course: Course) -> JointState:
        """Return the position, at rest."""
        still = np.zeros((course.s.size, self.q.size))
        return JointState(still + self.q, still, still)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointWay:
    """A straight line in joint space.

    start, end : (n_v,) [rad or m]
    """

    polynomial: ClassVar[bool] = True
    start: FloatArray
    end: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", frozen("start", self.start, (None,), where="joint move"))
        object.__setattr__(self, "end", frozen("end", self.end, self.start.shape, where="joint move"))

    def state(self, course: Course) -> JointState:
        """Return the motion of the joints along the line."""
        way = self.end - self.start
        s, ds, dds = (part[:, None] for part in course)
        return JointState(self.start + s * way, ds * way, dds * way)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LineWay:
    """A straight line of the tool.

    solver : finds the joints' positions, exactly
    knots : near which
    """

    polynomial: ClassVar[bool] = False
    line: Line
    solver: LineSolver
    knots: Knots

    @property
    def start(self) -> FloatArray:
        """Where the joints are at the start, (n_v,) [rad or m]."""
        return np.asarray(self.knots.q[0])

    @property
    def end(self) -> FloatArray:
        """Where the joints are at the end, (n_v,) [rad or m]."""
        return np.asarray(self.knots.q[-1])

    def state(self, course: Course) -> JointState:
        """Return the motion of the joints along the line."""
        return self.solver.states(self.line.task(course), self.knots.near(course.s))


Way: TypeAlias = JointWay | LineWay


@dataclass(frozen=True, slots=True, kw_only=True)
class CornerShape:
    """The last part of one way and the first of the next, passed at the same time: x = 1 - a g(1 - u), y = b g(u).

    ending, beginning : a and b, parts of the two ways
    ramps : whose shape g is
    """

    ending: float
    beginning: float
    ramps: Ramps

    def courses(self, course: Course) -> tuple[Course, Course]:
        """Return the courses of the way that ends and of the one that begins, by the course of u."""
        down, up = self.ramps.corner(1.0 - course.s), self.ramps.corner(course.s)
        square, a, b = course.ds**2, self.ending, self.beginning
        ending = Course(
            1.0 - a * down.s, a * down.ds * course.ds, a * (down.ds * course.dds - down.dds * square)
        )  # fmt: skip
        beginning = Course(b * up.s, b * up.ds * course.ds, b * (up.ds * course.dds + up.dds * square))
        return ending, beginning


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointCorner:
    """A corner in which the joint motions of two ways add up."""

    first: Way
    second: Way
    shape: CornerShape

    @property
    def polynomial(self) -> bool:
        """Whether both ways are straight in joint space."""
        return self.first.polynomial and self.second.polynomial

    def state(self, course: Course) -> JointState:
        """Return the sum of the way that ends and of the one that begins."""
        ending, beginning = self.shape.courses(course)
        before, after = self.first.state(ending), self.second.state(beginning)
        return JointState(before.q + (after.q - self.second.start), before.dq + after.dq, before.ddq + after.ddq)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LineCorner:
    """A corner in which the tool's ways along two lines add up.

    solver : finds the joints' positions, exactly
    knots : near which
    """

    polynomial: ClassVar[bool] = False
    first: Line
    second: Line
    shape: CornerShape
    solver: LineSolver
    knots: Knots

    def state(self, course: Course) -> JointState:
        """Return the motion of the joints through the corner."""
        task = line_corner_task(self.first, self.second, shape=self.shape, course=course)
        return self.solver.states(task, self.knots.near(course.s))


Corner: TypeAlias = JointCorner | LineCorner


def line_corner_task(first: Line, second: Line, *, shape: CornerShape, course: Course) -> TaskMotion:
    """Return the motion of the tool through a corner between two lines."""
    ending, beginning = shape.courses(course)
    return corner_task(first, second, ending=ending, beginning=beginning)
