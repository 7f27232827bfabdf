"""Surfaces to be worked on: a path over arc length, with its outward normal."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import ArrayError

_ORTHONORMAL = 1e-9  # [-] by which a rotation may miss being one


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surface(ABC):
    """A surface that bends in one direction only, and the path across it.

    The local frame has x along the path, z along the outward normal, both at s = 0; the path lies in local x-z.

    place : (3,) of the path's middle, s = 0, in the robot's base frame [m]
    rotation : (3, 3) of the local frame, in the robot's base frame
    half : length of the path to either side of its middle [m]; s runs from -half to half
    """

    place: FloatArray
    rotation: FloatArray
    half: float = 0.15

    def __post_init__(self) -> None:
        where = type(self).__name__
        rotation = frozen("rotation", self.rotation, (3, 3), where=where)
        missed = np.abs(rotation @ rotation.T - np.eye(3)).max()
        if missed > _ORTHONORMAL or np.linalg.det(rotation) < 0.0:
            raise ArrayError("rotation is not a rotation", where=where, expected="orthonormal, right-handed")
        object.__setattr__(self, "place", frozen("place", self.place, (3,), where=where))
        object.__setattr__(self, "rotation", rotation)
        if not 0.0 < self.half < np.inf:
            raise ArrayError("half is not a length", where=where, expected="> 0 m", got=self.half)

    @property
    @abstractmethod
    def curvature(self) -> float:
        """One over the radius [1/m]: positive on a convex surface, zero on a flat one, negative in a hollow one."""

    @abstractmethod
    def _heights(self, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return local x and z of the path, (n,) each [m]."""

    def points(self, s: FloatArray) -> FloatArray:
        """Return points of the path at the arc lengths s, (n, 3) in base axes [m].

        s : (n,) [m]
        """
        x, z = self._heights(_lengths(s))
        return self._in_base(x, z) + self.place

    def normals(self, s: FloatArray) -> FloatArray:
        """Return outward unit normals at the arc lengths s, (n, 3) in base axes.

        s : (n,) [m]
        """
        angle = self.curvature * _lengths(s)
        return self._in_base(np.sin(angle), np.cos(angle))

    def tangents(self, s: FloatArray) -> FloatArray:
        """Return unit tangents towards growing s, (n, 3) in base axes.

        s : (n,) [m]
        """
        angle = self.curvature * _lengths(s)
        return self._in_base(np.cos(angle), -np.sin(angle))

    def _in_base(self, x: FloatArray, z: FloatArray) -> FloatArray:
        local = np.column_stack([x, np.zeros_like(x), z])
        return np.asarray(local @ self.rotation.T)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FlatSurface(Surface):
    """A plane: `p = place + s x`."""

    @property
    def curvature(self) -> float:
        """Zero."""
        return 0.0

    def _heights(self, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        return s, np.zeros_like(s)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CylindricalSurface(Surface):
    """A cylinder whose axis is along local y, crossed at right angles: `x = R sin(s/R)`, `z = R cos(s/R) - R`.

    radius : R [m]; positive for a convex surface, whose axis is below the path, negative for a hollow one
    """

    radius: float

    def __post_init__(self) -> None:
        super(CylindricalSurface, self).__post_init__()
        if not 0.0 < abs(self.radius) < np.inf:
            raise ArrayError("radius is not one", where="CylindricalSurface", expected="not zero", got=self.radius)
        quarter = 0.5 * np.pi * abs(self.radius)
        if self.half > quarter:
            remedy = "a shorter half, or a larger radius"
            expected, got = f"half <= a quarter of the circle, {quarter:g} m", self.half
            raise ArrayError(
                "the path winds round the cylinder", where="CylindricalSurface",
                expected=expected, got=got, remedy=remedy,
            )  # fmt: skip

    @property
    def curvature(self) -> float:
        """`1/R` [1/m]."""
        return 1.0 / self.radius

    def _heights(self, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        angle = s / self.radius
        # 1 - cos as a square: exact where the radius is large against s
        return self.radius * np.sin(angle), -2.0 * self.radius * np.sin(0.5 * angle) ** 2


def _lengths(s: FloatArray) -> FloatArray:
    return frozen("s", s, (None,), where="surface")
