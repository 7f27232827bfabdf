"""One joint with the link it carries: placement, axis, limits, nominal inertia and friction."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, TypeAlias, get_args

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import RobotError

JointKind: TypeAlias = Literal["revolute", "prismatic"]
"""How a joint moves."""

_ORTHOGONALITY = 1e-6  # how far R^T R may be from the identity before a placement is refused
_LARGEST_LENGTH = 1e3  # [m] a link longer than this is a unit error
_LARGEST_MASS = 1e6  # [kg]


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Joint limits on the joint side of the gear; infinite where unknown.

    lower, upper : position [rad or m]
    velocity : largest speed [rad/s or m/s]
    effort : largest torque or force [Nm or N]
    acceleration : largest acceleration [rad/s^2 or m/s^2]
    """

    lower: float = -np.inf
    upper: float = np.inf
    velocity: float = np.inf
    effort: float = np.inf
    acceleration: float = np.inf

    def __post_init__(self) -> None:
        if np.isnan([self.lower, self.upper, self.velocity, self.effort, self.acceleration]).any():
            raise RobotError("a joint limit is not a number", got=self)
        if self.lower > self.upper:
            raise RobotError("lower limit above upper limit", got=f"[{self.lower}, {self.upper}]")
        if min(self.velocity, self.effort, self.acceleration) < 0:
            raise RobotError("a velocity, effort or acceleration limit is negative", got=self)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Joint:
    """A one-degree-of-freedom joint and the link that moves with it.

    name : unique in its robot
    kind : "revolute" or "prismatic"
    parent : index of the joint that carries it, -1 for the base; always smaller than its own index
    rotation, translation : (3, 3), (3,) [m] pose of the joint frame at q = 0 in the parent's joint frame
    axis : (3,) unit vector in the joint frame
    inertia : (10,) nominal `m, mx, my, mz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz` of the link about the joint frame's
        origin in link axes [kg, kg m, kg m^2]; zeros where unknown
    limits : position, velocity, effort, acceleration
    rotor_inertia : nominal, reflected to the joint side [kg m^2 or kg]
    viscous, coulomb : nominal friction [Nm s/rad, Nm] or [N s/m, N]
    """

    name: str
    kind: JointKind
    parent: int
    rotation: FloatArray
    translation: FloatArray
    axis: FloatArray
    inertia: FloatArray = field(default_factory=lambda: np.zeros(10))
    limits: Limits = field(default_factory=Limits)
    rotor_inertia: float = 0.0
    viscous: float = 0.0
    coulomb: float = 0.0

    def __post_init__(self) -> None:
        where = f"joint {self.name}"
        if self.kind not in get_args(JointKind):
            raise RobotError("unknown kind of joint", where=where, expected=get_args(JointKind), got=self.kind)
        for name, shape in (("rotation", (3, 3)), ("translation", (3,)), ("axis", (3,)), ("inertia", (10,))):
            object.__setattr__(self, name, frozen(name, getattr(self, name), shape, where=where))
        if np.abs(self.rotation.T @ self.rotation - np.eye(3)).max() > _ORTHOGONALITY:
            raise RobotError("rotation is not orthonormal", where=where)
        if abs(np.linalg.norm(self.axis) - 1.0) > _ORTHOGONALITY:
            raise RobotError("axis is not a unit vector", where=where, got=self.axis.tolist())
        self._check_sizes(where)

    def _check_sizes(self, where: str) -> None:
        if np.abs(self.translation).max() > _LARGEST_LENGTH:
            remedy = "lengths are metres: is the description in millimetres?"
            raise RobotError("absurd size", where=where, got=f"{np.abs(self.translation).max():g} m", remedy=remedy)
        if self.inertia[0] < 0:
            raise RobotError("negative mass", where=f"link of {where}", got=f"{self.inertia[0]:g} kg")
        if self.inertia[0] > _LARGEST_MASS:
            raise RobotError("absurd mass", where=f"link of {where}", got=f"{self.inertia[0]:g} kg")
        if min(self.rotor_inertia, self.viscous, self.coulomb) < 0:
            raise RobotError("rotor inertia and friction cannot be negative", where=where)

    @property
    def unit(self) -> str:
        """Unit of the joint's position: rad or m."""
        return "rad" if self.kind == "revolute" else "m"

    @property
    def effort_unit(self) -> str:
        """Unit of the joint's torque: Nm or N."""
        return "Nm" if self.kind == "revolute" else "N"


def inertia_at_origin(*, mass: float, com: FloatArray, inertia_at_com: FloatArray) -> FloatArray:
    """Return the ten inertial parameters about the frame origin from mass, centre and central inertia.

    com : (3,) [m]; inertia_at_com : (3, 3) [kg m^2], both in the frame's axes. Parallel axis theorem:
    `I_o = I_c + m (c.c E - c c^T)`.
    """
    about_origin = inertia_at_com + mass * (com @ com * np.eye(3) - np.outer(com, com))
    xx, xy, yy = about_origin[0, 0], about_origin[0, 1], about_origin[1, 1]
    xz, yz, zz = about_origin[0, 2], about_origin[1, 2], about_origin[2, 2]
    return np.array([mass, *(mass * com), xx, xy, yy, xz, yz, zz])


def central_inertia(parameters: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """Return mass, centre of mass (3,) and central inertia (3, 3): the inverse of `inertia_at_origin`.

    A massless link has its centre at the origin.
    """
    mass = float(parameters[0])
    com = parameters[1:4] / mass if mass > 0 else np.zeros(3)
    xx, xy, yy, xz, yz, zz = parameters[4:]
    about_origin = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return mass, com, about_origin - mass * (com @ com * np.eye(3) - np.outer(com, com))
