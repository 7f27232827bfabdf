"""The links stay clear of boxes and meshes: distances and nearest points by coal."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.dynamics.motion import Motion, MotionGradient
from tauhat.errors import ExcitationError
from tauhat.excitation.limits.capsules import Body
from tauhat.excitation.limits.collision_limit import FAR, DistanceLimit, check_clearance, pulled
from tauhat.excitation.limits.distances import PlacedSolid, placed, separation
from tauhat.excitation.limits.link_poses import link_poses, no_wrenches
from tauhat.excitation.limits.motion_limit import Pull
from tauhat.excitation.limits.solids import convex_hull

_LARGEST = 1e3  # [m]


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
    shape, corners = convex_hull(path, scale=np.full(3, scale), where=label)
    return Obstacle(
        label=label,
        shape=shape,
        rotation=rotation,
        translation=translation,
        lower=corners.min(axis=0),
        upper=corners.max(axis=0),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ObstacleLimit(DistanceLimit):
    """The links that the joints can move stay clear of a convex solid; margins end at one.

    body : what stands for the robot
    clearance : [m]
    moving : its parts that are looked at
    """

    body: Body
    obstacle: Obstacle
    clearance: float
    moving: tuple[int, ...] = field(init=False)

    def __post_init__(self) -> None:
        check_clearance(self.clearance, self.name)
        object.__setattr__(self, "moving", self.body.moving_parts())

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
        standing = self._standing(motion.n_t)
        moving = [self.body.parts[index] for index in self.moving]
        found = [separation(placed(part, poses), standing, within=self.clearance + FAR) for part in moving]
        margins = np.minimum([(apart.gap - self.clearance) / FAR for apart in found], 1.0)

        def pull(bars: FloatArray) -> MotionGradient:
            wrenches = no_wrenches(self.body.robot, motion.n_t)
            for part, apart, margin, bar in zip(moving, found, margins, bars, strict=True):
                force = np.where(margin < 1.0, bar / FAR, 0.0)[:, None] * apart.away
                wrenches.add(part.link, apart.first, force)
            return pulled(self.body.robot, poses, wrenches)

        return margins, pull

    def _standing(self, n_t: int) -> PlacedSolid:
        solid = self.obstacle
        rotation = np.broadcast_to(solid.rotation, (n_t, 3, 3))
        return PlacedSolid(
            solid.shape, rotation, np.broadcast_to(solid.translation, (n_t, 3)), solid.lower, solid.upper
        )
