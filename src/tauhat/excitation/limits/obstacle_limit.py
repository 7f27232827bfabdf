"""The links stay clear of boxes and meshes: distances and nearest points by coal."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray, IntArray, frozen, read_only
from tauhat.dynamics.motion import Motion, MotionGradient
from tauhat.errors import ExcitationError
from tauhat.excitation.limits.capsules import Body
from tauhat.excitation.limits.collision_limit import FAR, DistanceLimit, check_clearance, pulled
from tauhat.excitation.limits.link_poses import link_poses, no_wrenches
from tauhat.excitation.limits.motion_limit import Pull
from tauhat.files import existing_file

_LARGEST = 1e3  # [m]
_MOST_BYTES = 200 * 2**20
_THIN = 1e-9  # [m]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Obstacle:
    """A convex solid that stands in the base frame.

    label : how messages call it
    shape : coal geometry, convex
    rotation, translation : (3, 3), (3,) [m] its pose in the base frame
    lower, upper : (3,) corners of its bounding box in its own frame [m]
    """

    label: str
    shape: Any
    rotation: FloatArray
    translation: FloatArray
    lower: FloatArray
    upper: FloatArray

    def __post_init__(self) -> None:
        shapes = (("rotation", (3, 3)), ("translation", (3,)), ("lower", (3,)), ("upper", (3,)))
        for name, shape in shapes:
            object.__setattr__(self, name, frozen(name, getattr(self, name), shape, where=self.label))


def box_obstacle(label: str, *, size: FloatArray, rotation: FloatArray, translation: FloatArray) -> Obstacle:
    """Return a box of edges `size` (3,) [m] about its centre.

    Raises
    ------
    ExcitationError
        when an edge is not positive or absurdly long.
    """
    import coal

    edges = frozen("size", size, (3,), where=label)
    if not ((edges > 0.0).all() and (edges < _LARGEST).all()):
        expected = f"edges in (0, {_LARGEST:g}) m"
        raise ExcitationError("not a box", where=label, expected=expected, got=edges.tolist())
    half = 0.5 * edges
    return Obstacle(
        label=label,
        shape=coal.Box(*edges.tolist()),
        rotation=rotation,
        translation=translation,
        lower=-half,
        upper=half,
    )


def mesh_obstacle(
    label: str, *, path: str | Path, scale: float = 1.0, rotation: FloatArray, translation: FloatArray
) -> Obstacle:
    """Return the convex hull of a mesh file (STL, OBJ, PLY, DAE): a hollow thing is best given in several parts.

    Parameters
    ----------
    scale : metres per unit of the file

    Raises
    ------
    ExcitationError
        when the file is missing, no mesh, flat or absurdly large.
    """
    import coal

    place = existing_file(path, error=ExcitationError)
    if place.stat().st_size > _MOST_BYTES:
        raise ExcitationError("absurd size", where=f"{label}, {place}", expected=f"at most {_MOST_BYTES} bytes")
    try:
        mesh = coal.MeshLoader().load(str(place), np.full(3, scale))
        points = np.array(mesh.vertices(), dtype=np.float64).reshape(-1, 3)
        if not (np.isfinite(points).all() and np.abs(points).max(initial=0.0) < _LARGEST):
            raise ExcitationError("absurd size", where=f"{label}, {place}", remedy="is the mesh in millimetres?")
        mesh.buildConvexHull(True, "Qt")
    except (ValueError, RuntimeError) as error:
        reason = str(error).rpartition("message:")[2][:200]
        raise ExcitationError("not a mesh of a solid", where=f"{label}, {place}", got=reason) from error
    lower, upper = points.min(axis=0), points.max(axis=0)
    if (upper - lower).min() < _THIN:
        raise ExcitationError("a flat mesh is no solid", where=f"{label}, {place}", got=(upper - lower).tolist())
    return Obstacle(
        label=label, shape=mesh.convex, rotation=rotation, translation=translation, lower=lower, upper=upper
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ObstacleLimit(DistanceLimit):
    """The links that the joints can move stay clear of a convex solid; margins end at one.

    body : the robot's capsules
    clearance : [m]
    moving : capsules that are looked at
    """

    body: Body
    obstacle: Obstacle
    clearance: float
    moving: tuple[int, ...] = field(init=False)

    def __post_init__(self) -> None:
        check_clearance(self.clearance, self.name)
        object.__setattr__(self, "moving", tuple(sorted({index for index, _ in self.body.moving_ends()})))

    @property
    def kept(self) -> float:
        """The clearance [m]."""
        return self.clearance

    @property
    def name(self) -> str:
        """The obstacle's label."""
        return self.obstacle.label

    @property
    def parts(self) -> tuple[str, ...]:
        """The links."""
        return tuple(self.body.label(index) for index in self.moving)

    def evaluate(self, motion: Motion) -> tuple[FloatArray, Pull]:
        """Return the distances beyond the clearance, (n_c, n_t), and the pullback through the nearest points."""
        poses = link_poses(self.body.robot, motion.q)
        starts, ends = (np.ascontiguousarray(side) for side in self.body.ends(poses))
        margins = np.ones((len(self.moving), motion.n_t))
        away, places = np.zeros((*margins.shape, 3)), np.zeros((*margins.shape, 3))
        for row, index in enumerate(self.moving):
            near = self._near(starts[index], ends[index], index)
            gap, away[row, near], places[row, near] = self._distances(starts[index, near], ends[index, near], index)
            margins[row, near] = np.minimum((gap - self.clearance) / FAR, 1.0)

        def pull(bars: FloatArray) -> MotionGradient:
            wrenches = no_wrenches(self.body.robot, motion.n_t)
            for row, index in enumerate(self.moving):
                force = np.where(margins[row] < 1.0, bars[row] / FAR, 0.0)[:, None] * away[row]
                wrenches.add(self.body.capsules[index].link, places[row], force)
            return pulled(self.body.robot, poses, wrenches)

        return margins, pull

    def _near(self, start: FloatArray, end: FloatArray, index: int) -> IntArray:
        """Return the samples (n,) at which the capsule may be within reach: none of the solid's axes separates them."""
        a, b = ((side - self.obstacle.translation) @ self.obstacle.rotation for side in (start, end))
        reach = self.body.capsules[index].radius + self.clearance + FAR
        lowest, highest = np.minimum(a, b) - reach, np.maximum(a, b) + reach
        return np.flatnonzero(((lowest < self.obstacle.upper) & (highest > self.obstacle.lower)).all(axis=1))

    def _distances(self, start: FloatArray, end: FloatArray, index: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return distance (n,), direction from the solid (n, 3) and nearest point of the link (n, 3) by coal."""
        import coal

        capsule = self.body.capsules[index]
        shape = coal.Capsule(capsule.radius, capsule.length)
        solid = coal.Transform3s(np.array(self.obstacle.rotation), np.array(self.obstacle.translation))
        request, result = coal.DistanceRequest(True), coal.DistanceResult()
        request.enable_signed_distance = True
        request.gjk_tolerance = request.epa_tolerance = _TOLERANCE
        gap, away, places = np.empty(len(start)), np.empty((len(start), 3)), np.empty((len(start), 3))
        centres = 0.5 * (start + end)
        for sample, turn in enumerate(_turns_to(end - start)):
            result.clear()
            pose = coal.Transform3s(turn, centres[sample])
            gap[sample] = coal.distance(shape, pose, self.obstacle.shape, solid, request, result)
            away[sample], places[sample] = -result.normal, result.getNearestPoint1()
        return gap, away, places


_TOLERANCE = 1e-9


def _turns_to(along: FloatArray) -> FloatArray:
    """Return rotations (n, 3, 3) whose third column points along each row, (n, 3); any where a row is zero."""
    size = np.linalg.norm(along, axis=1, keepdims=True)
    third = np.where(size > _THIN, along / np.maximum(size, _THIN), np.array([0.0, 0.0, 1.0]))
    helper = np.where(np.abs(third[:, :1]) < 0.9, np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    first = np.cross(helper, third)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return read_only(np.stack([first, np.cross(third, first), third], axis=2))
