"""Where the work is: regions for the tool's pose that a few numbers between 0 and 1 pick a pose from."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tauhat.arrays import FloatArray, frozen, read_only
from tauhat.errors import ExcitationError
from tauhat.robots.kinematics import Pose
from tauhat.robots.transforms import rotation_of_vector, rotation_vector

_CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)], dtype=np.float64)
_EDGES = tuple((a, b) for a in range(8) for b in range(a + 1, 8) if np.abs(_CORNERS[a] - _CORNERS[b]).sum() == 1.0)
_ORTHOGONAL = 1e-6  # of a rotation matrix
_SMALLEST_DRAWN = 0.01  # [m] radius of a ball


@dataclass(frozen=True, slots=True, kw_only=True)
class Freedom:
    """How far the tool may turn away from its orientation in the region.

    tilt : largest angle between the tool's z axis and its direction there [rad]
    spin : largest turn about the tool's z axis, either way [rad]
    """

    tilt: float = 0.0
    spin: float = 0.0

    def __post_init__(self) -> None:
        for name in ("tilt", "spin"):
            if not 0.0 <= getattr(self, name) <= np.pi:
                raise ExcitationError(f"{name} of a region", expected="0 to pi", got=getattr(self, name))

    def turned(self, rotation: FloatArray, genes: FloatArray) -> FloatArray:
        """Return an orientation that three genes pick around `rotation`, (3, 3)."""
        across = 2.0 * genes[:2] - 1.0
        across = across / max(1.0, float(np.linalg.norm(across)))
        lean = rotation_of_vector(np.array([*(self.tilt * across), 0.0]))
        about = rotation_of_vector(np.array([0.0, 0.0, self.spin * (2.0 * genes[2] - 1.0)]))
        return np.asarray(rotation @ lean @ about)


class TaskRegion(ABC):
    """A set of poses of the tool in the base frame; genes from 0 to 1 pick one, and near genes give near poses."""

    __slots__ = ()
    kind: ClassVar[str]

    @property
    @abstractmethod
    def n_genes(self) -> int:
        """How many genes pick a pose."""

    @abstractmethod
    def pose(self, genes: FloatArray) -> Pose:
        """Return the pose that genes pick, (n_genes,) from 0 to 1."""

    @abstractmethod
    def outside(self, points: FloatArray) -> FloatArray:
        """Return how far points (n, 3) of the base frame are outside the region, (n,) [m]; 0 inside."""

    @abstractmethod
    def outline(self) -> tuple[FloatArray, ...]:
        """Return the lines that draw the region, (n, 3) each [m]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BoxRegion(TaskRegion):
    """A box along the axes of the base frame.

    lower, upper : (3,) corners [m]
    rotation : (3, 3) orientation of the tool
    """

    kind: ClassVar[str] = "box"
    lower: FloatArray
    upper: FloatArray
    rotation: FloatArray
    freedom: Freedom = field(default_factory=Freedom)

    def __post_init__(self) -> None:
        for name in ("lower", "upper"):
            object.__setattr__(self, name, frozen(name, getattr(self, name), (3,), where="box region"))
        object.__setattr__(self, "rotation", _rotation(self.rotation))
        if not (self.lower <= self.upper).all():
            raise ExcitationError(
                "corners of a box region", expected="lower <= upper", got=[self.lower.tolist(), self.upper.tolist()]
            )

    @property
    def n_genes(self) -> int:
        """Three for the place, three for the orientation."""
        return 6

    def pose(self, genes: FloatArray) -> Pose:
        """Return the pose that genes pick, (6,) from 0 to 1."""
        translation = self.lower + genes[:3] * (self.upper - self.lower)
        return Pose(rotation=self.freedom.turned(self.rotation, genes[3:]), translation=translation)

    def outside(self, points: FloatArray) -> FloatArray:
        """Return how far points (n, 3) are outside the box, (n,) [m]."""
        return np.asarray(np.linalg.norm(np.maximum(np.maximum(self.lower - points, points - self.upper), 0.0), axis=1))

    def outline(self) -> tuple[FloatArray, ...]:
        """Return the twelve edges."""
        corners = self.lower + _CORNERS * (self.upper - self.lower)
        return tuple(read_only(corners[list(edge)]) for edge in _EDGES)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PosesRegion(TaskRegion):
    """Balls around poses of the tool, such as those at which a program was taught.

    poses : one or more
    clearance : radius of the balls [m]
    """

    kind: ClassVar[str] = "poses"
    poses: tuple[Pose, ...]
    clearance: float
    freedom: Freedom = field(default_factory=Freedom)

    def __post_init__(self) -> None:
        object.__setattr__(self, "poses", tuple(_checked(pose) for pose in self.poses))
        if not self.poses:
            raise ExcitationError("a region of poses", expected="one pose or more")
        _check_clearance(self.clearance)

    @property
    def n_genes(self) -> int:
        """One for the ball, three for the place in it, three for the orientation."""
        return 7

    def pose(self, genes: FloatArray) -> Pose:
        """Return the pose that genes pick, (7,) from 0 to 1."""
        chosen = self.poses[min(int(genes[0] * len(self.poses)), len(self.poses) - 1)]
        translation = chosen.translation + self.clearance * _in_ball(genes[1:4])
        return Pose(rotation=self.freedom.turned(chosen.rotation, genes[4:]), translation=translation)

    def outside(self, points: FloatArray) -> FloatArray:
        """Return how far points (n, 3) are outside all balls, (n,) [m]."""
        centres = np.array([pose.translation for pose in self.poses])
        nearest = np.linalg.norm(points[:, None] - centres, axis=2).min(axis=1)
        return np.asarray(np.maximum(nearest - self.clearance, 0.0))

    def outline(self) -> tuple[FloatArray, ...]:
        """Return three great circles of every ball."""
        return tuple(
            read_only(pose.translation + circle)
            for pose in self.poses
            for circle in _circles(max(self.clearance, _SMALLEST_DRAWN))
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PathRegion(TaskRegion):
    """A tube around the path of the tool: straight between points, while it turns from one orientation to the next.

    poses : two or more, in the order in which they are passed
    clearance : radius of the tube [m]
    """

    kind: ClassVar[str] = "path"
    poses: tuple[Pose, ...]
    clearance: float
    freedom: Freedom = field(default_factory=Freedom)

    def __post_init__(self) -> None:
        object.__setattr__(self, "poses", tuple(_checked(pose) for pose in self.poses))
        if len(self.poses) < 2 or not (self.lengths > 0.0).all():
            raise ExcitationError("a region along a path", expected="two points or more, each other than the last")
        _check_clearance(self.clearance)

    @property
    def lengths(self) -> FloatArray:
        """Lengths of the straight parts, (n - 1,) [m]."""
        return np.asarray(np.linalg.norm(np.diff(self._points(), axis=0), axis=1))

    @property
    def n_genes(self) -> int:
        """One for the place along the path, three for that beside it, three for the orientation."""
        return 7

    def pose(self, genes: FloatArray) -> Pose:
        """Return the pose that genes pick, (7,) from 0 to 1."""
        lengths = self.lengths
        ends = np.cumsum(lengths)
        along = float(genes[0]) * ends[-1]
        part = min(int(np.searchsorted(ends, along)), lengths.size - 1)
        share = 1.0 - (ends[part] - along) / lengths[part]
        before, after = self.poses[part], self.poses[part + 1]
        translation = before.translation + share * (after.translation - before.translation)
        turn = rotation_of_vector(share * rotation_vector(before.rotation.T @ after.rotation))
        return Pose(
            rotation=self.freedom.turned(before.rotation @ turn, genes[4:]),
            translation=translation + self.clearance * _in_ball(genes[1:4]),
        )

    def outside(self, points: FloatArray) -> FloatArray:
        """Return how far points (n, 3) are outside the tube, (n,) [m]."""
        path = self._points()
        starts, steps = path[:-1], np.diff(path, axis=0)
        away = points[:, None] - starts
        share = np.clip(np.einsum("npi,pi->np", away, steps) / (self.lengths**2), 0.0, 1.0)
        nearest = np.linalg.norm(away - share[:, :, None] * steps, axis=2).min(axis=1)
        return np.asarray(np.maximum(nearest - self.clearance, 0.0))

    def outline(self) -> tuple[FloatArray, ...]:
        """Return the path, and six lines along the tube's wall where it has one."""
        path = self._points()
        if self.clearance == 0.0:
            return (read_only(path),)
        sides = [pose.rotation[:, axis] * sign for pose in self.poses[:1] for axis in (0, 1, 2) for sign in (1.0, -1.0)]
        return (read_only(path), *(read_only(path + self.clearance * side) for side in sides))

    def _points(self) -> FloatArray:
        return np.array([pose.translation for pose in self.poses])


def _rotation(matrix: FloatArray) -> FloatArray:
    rotation = frozen("rotation", matrix, (3, 3), where="task region")
    if np.abs(rotation.T @ rotation - np.eye(3)).max() > _ORTHOGONAL or np.linalg.det(rotation) < 0.0:
        raise ExcitationError("orientation in a region", expected="a rotation matrix", got=rotation.tolist())
    return rotation


def _checked(pose: Pose) -> Pose:
    return Pose(
        rotation=_rotation(pose.rotation),
        translation=frozen("translation", pose.translation, (3,), where="task region"),
    )


def _check_clearance(clearance: float) -> None:
    if not 0.0 <= clearance < np.inf:
        raise ExcitationError("clearance of a region", expected="a length of at least 0 m", got=clearance)


def _in_ball(genes: FloatArray) -> FloatArray:
    """Return a point of the unit ball: a point of the cube, its outer part drawn in."""
    point = 2.0 * genes - 1.0
    return np.asarray(point / max(1.0, float(np.linalg.norm(point))))


def _circles(radius: float) -> tuple[FloatArray, ...]:
    angle = np.linspace(0.0, 2.0 * np.pi, 33)
    cosine, sine, zero = radius * np.cos(angle), radius * np.sin(angle), np.zeros_like(angle)
    rounds = ((cosine, sine, zero), (cosine, zero, sine), (zero, cosine, sine))
    return tuple(np.stack(parts, axis=1) for parts in rounds)
