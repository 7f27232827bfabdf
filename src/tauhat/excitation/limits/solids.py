"""Convex solids on the links: what coal measures distances between, and where they are lowest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import ExcitationError
from tauhat.excitation.limits.link_poses import LinkPoses
from tauhat.files import existing_file
from tauhat.robots.robot import Robot
from tauhat.robots.solid import Solid

_LARGEST = 1e3  # [m]
_MOST_BYTES = 200 * 2**20
_THIN = 1e-9  # [m]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinkSolid:
    """A convex solid fixed to a link: the hull of its corners, widened by a disc about z and by a ball.

    link : index of the joint that moves it, -1 for the base
    label : how messages call it
    shape : coal geometry of the same solid
    rotation, translation : (3, 3), (3,) [m] pose in the link frame
    corners : (n, 3) in its own frame [m]
    disc, ball : radii, zero for none [m]
    """

    link: int
    label: str
    shape: Any
    rotation: FloatArray
    translation: FloatArray
    corners: FloatArray
    disc: float = 0.0
    ball: float = 0.0

    def __post_init__(self) -> None:
        for name, shape in (("rotation", (3, 3)), ("translation", (3,)), ("corners", (None, 3))):
            object.__setattr__(self, name, frozen(name, getattr(self, name), shape, where=self.label))

    @property
    def lower(self) -> FloatArray:
        """Lowest corner of the bounding box in its own frame, (3,) [m]."""
        return np.asarray(self.corners.min(axis=0) - self._widening)

    @property
    def upper(self) -> FloatArray:
        """Highest corner of the bounding box in its own frame, (3,) [m]."""
        return np.asarray(self.corners.max(axis=0) + self._widening)

    @property
    def _widening(self) -> FloatArray:
        return self.ball + self.disc * np.array([1.0, 1.0, 0.0])

    def turned(self, poses: LinkPoses) -> FloatArray:
        """Return its orientation along a motion, (n_t, 3, 3)."""
        if self.link < 0:
            return np.broadcast_to(self.rotation, (poses.origin.shape[1], 3, 3))
        return np.asarray(poses.rotation[self.link] @ self.rotation)

    def placed_corners(self, poses: LinkPoses) -> FloatArray:
        """Return where its corners are along a motion, (n, n_t, 3) [m]."""
        return np.array([poses.point(self.link, self.translation + self.rotation @ corner) for corner in self.corners])

    def lowest(self, poses: LinkPoses, normal: FloatArray) -> FloatArray:
        """Return its point that lies furthest against a unit normal (3,) at each sample, (n_t, 3) [m]."""
        turned = self.turned(poses)
        along = normal @ turned  # the normal in the solid's own axes, (n_t, 3)
        place = self.corners[np.argmin(along @ self.corners.T, axis=1)] - self.ball * along
        flat = np.hypot(along[:, 0], along[:, 1])
        place[:, :2] -= self.disc * along[:, :2] / np.maximum(flat, _THIN)[:, None]
        return np.asarray(poses.point(self.link, self.translation) + np.einsum("tij,tj->ti", turned, place))


def link_solid(robot: Robot, solid: Solid) -> LinkSolid:
    """Return a solid of the robot's description on its link.

    Raises
    ------
    ExcitationError
        when its mesh is missing or none of a solid, or the description of it cannot be read.
    """
    frame = next(frame for frame in robot.frames if frame.name == solid.frame)
    shape, corners = _shape(solid)
    return LinkSolid(
        link=frame.joint,
        label=f"link {solid.frame}",
        shape=shape,
        rotation=frame.rotation @ solid.rotation,
        translation=frame.translation + frame.rotation @ solid.translation,
        corners=corners,
        disc=float(solid.size[0]) if solid.kind == "cylinder" else 0.0,
        ball=float(solid.size[0]) if solid.kind in {"sphere", "capsule"} else 0.0,
    )


def _shape(solid: Solid) -> tuple[Any, FloatArray]:
    """Return a solid as coal geometry, and its corners (n, 3) [m]."""
    import coal

    size = solid.size.tolist()
    match solid.kind:
        case "box":
            return coal.Box(*size), 0.5 * solid.size * np.array(list(product((-1.0, 1.0), repeat=3)))
        case "sphere":
            return coal.Sphere(*size), np.zeros((1, 3))
        case "cylinder":
            return coal.Cylinder(*size), _line(size[1])
        case "capsule":
            return coal.Capsule(*size), _line(size[1])
        case "mesh":
            return convex_hull(_mesh_path(solid), scale=solid.size, where=f"link {solid.frame}")
        case _:
            raise ExcitationError(solid.defect, where=f"link {solid.frame}")


def capsule_solid(*, link: int, label: str, ends: tuple[FloatArray, FloatArray], radius: float) -> LinkSolid:
    """Return a capsule between two places (3,) of a link as a solid."""
    import coal

    start, end = ends
    length = float(np.linalg.norm(end - start))
    return LinkSolid(
        link=link,
        label=label,
        shape=coal.Capsule(radius, length),
        rotation=_turn_to(end - start),
        translation=0.5 * (start + end),
        corners=_line(length),
        ball=radius,
    )


def convex_hull(path: str | Path, *, scale: Sequence[float] | FloatArray, where: str) -> tuple[Any, FloatArray]:
    """Return the convex hull of a mesh file (STL, OBJ, PLY, DAE) as coal geometry, and its corners (n, 3) [m].

    Parameters
    ----------
    scale : metres per unit of the file along each axis (3,)
    where : what messages call the mesh

    Raises
    ------
    ExcitationError
        when the file is missing, no mesh, flat or absurdly large.
    """
    import coal

    place = existing_file(path, error=ExcitationError)
    if place.stat().st_size > _MOST_BYTES:
        raise ExcitationError("absurd size", where=f"{where}, {place}", expected=f"at most {_MOST_BYTES} bytes")
    try:
        mesh = coal.MeshLoader().load(str(place), np.array(scale, dtype=np.float64))
        points = np.array(mesh.vertices(), dtype=np.float64).reshape(-1, 3)
        if not (np.isfinite(points).all() and np.abs(points).max(initial=0.0) < _LARGEST):
            raise ExcitationError("absurd size", where=f"{where}, {place}", remedy="is the mesh in millimetres?")
        mesh.buildConvexHull(True, "Qt")
    except (ValueError, RuntimeError) as error:
        reason = str(error).rpartition("message:")[2][:200]
        raise ExcitationError("not a mesh of a solid", where=f"{where}, {place}", got=reason) from error
    corners = np.array(mesh.convex.points(), dtype=np.float64).reshape(-1, 3)
    if np.ptp(corners, axis=0).min() < _THIN:
        got = np.ptp(corners, axis=0).tolist()
        raise ExcitationError("a flat mesh is no solid", where=f"{where}, {place}", got=got)
    return mesh.convex, corners


def _mesh_path(solid: Solid) -> Path:
    path = solid.path
    if path is None:
        raise ExcitationError("the mesh is not found", where=f"link {solid.frame}", got=solid.file[:200])
    return path


def _line(length: float) -> FloatArray:
    return np.array([[0.0, 0.0, -0.5 * length], [0.0, 0.0, 0.5 * length]])


def _turn_to(along: FloatArray) -> FloatArray:
    """Return a rotation (3, 3) whose third column points along a row; any where the row is zero."""
    size = float(np.linalg.norm(along))
    third = along / size if size > _THIN else np.array([0.0, 0.0, 1.0])
    helper = np.eye(3)[0] if abs(third[0]) < 0.9 else np.eye(3)[1]
    first = np.cross(helper, third)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(third, first), third], axis=1)
