"""The workpiece as MuJoCo has it, and where a point is on it."""

from __future__ import annotations

from typing import Any

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.control.force.surface import CylindricalSurface, FlatSurface, Surface
from tauhat.errors import SimulationError

WORKPIECE = "workpiece"
_HALF_WIDTH = 1.0  # [m] of a cylinder along its axis


def add_workpiece(mujoco: Any, specification: Any, surface: Surface) -> None:
    """Add a fixed plane or cylinder that collides with nothing by itself.

    Raises
    ------
    SimulationError
        when MuJoCo has no body of this shape.
    """
    refuse_shape(surface)
    shape, turn = mujoco.mjtGeom.mjGEOM_PLANE, np.eye(3)
    place, size = surface.place, [_HALF_WIDTH, _HALF_WIDTH, 0.1]
    if isinstance(surface, CylindricalSurface):
        shape, size = mujoco.mjtGeom.mjGEOM_CYLINDER, [surface.radius, _HALF_WIDTH, 0.0]
        place = surface.place - surface.radius * surface.rotation[:, 2]
        turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # the geom's axis is its z, ours y
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, (surface.rotation @ turn).ravel())
    specification.worldbody.add_geom(
        name=WORKPIECE, type=shape, size=size, pos=place, quat=quaternion, contype=0, conaffinity=0
    )


def refuse_shape(surface: Surface) -> None:
    """Refuse surfaces that MuJoCo has no body for."""
    if isinstance(surface, CylindricalSurface) and surface.radius < 0.0:
        raise SimulationError(
            "no body for a hollow cylinder", where="workpiece", expected="a positive radius", got=surface.radius
        )
    if not isinstance(surface, FlatSurface | CylindricalSurface):
        raise SimulationError("no body for this surface", where="workpiece", got=type(surface).__name__)


def arc_length(surface: Surface, point: FloatArray) -> float:
    """Return the arc length s at which a point (3,) is above the path [m]."""
    local = surface.rotation.T @ (point - surface.place)
    if surface.curvature == 0.0:
        return float(local[0])
    radius = 1.0 / surface.curvature
    return float(radius * np.arctan2(local[0], local[2] + radius))


def height(surface: Surface, point: FloatArray) -> float:
    """Return how far outside the surface a point (3,) is, negative inside the workpiece [m]."""
    local = surface.rotation.T @ (point - surface.place)
    if surface.curvature == 0.0:
        return float(local[2])
    radius = 1.0 / surface.curvature
    return float(np.hypot(local[0], local[2] + radius) - radius)
