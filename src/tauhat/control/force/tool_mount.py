"""How a tool sits on the robot and stands on a surface."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.control.force.surface import Surface
from tauhat.errors import ControlError
from tauhat.robots.kinematics import Pose


@dataclass(frozen=True, slots=True, kw_only=True)
class ToolMount:
    """A straight tool along z of a frame of the robot; at work that z points against the surface's outward normal.

    frame : that carries the tool, by name
    length : from the frame's origin to the unloaded tip, along the frame's z [m]
    turn : of the frame about the outward normal, from x along the path [rad]
    """

    frame: str
    length: float
    turn: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.length < math.inf:
            raise ControlError("length of the tool", where="tool mount", expected=">= 0 m", got=self.length)
        if not math.isfinite(self.turn):
            raise ControlError("turn is not an angle", where="tool mount", got=self.turn)

    def poses(self, surface: Surface, s: FloatArray, depth: float) -> list[Pose]:
        """Return poses of the frame that put the tip below the surface by a depth [m], at arc lengths s (n,) [m]."""
        normals, tangents = surface.normals(s), surface.tangents(s)
        origins = surface.points(s) + (self.length - depth) * normals
        across = np.cross(normals, tangents)
        x = math.cos(self.turn) * tangents + math.sin(self.turn) * across
        rotations = np.stack([x, np.cross(-normals, x), -normals], axis=2)
        return [Pose(rotation=r, translation=p) for r, p in zip(rotations, origins, strict=True)]
