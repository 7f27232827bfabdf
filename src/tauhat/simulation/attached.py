"""Bodies that a robot carries: tools and payloads, bolted to a link."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import SimulationError
from tauhat.robots.inertia_checks import inertia_defect
from tauhat.robots.joint import inertia_at_origin


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AttachedBody:
    """A rigid body on the link of a joint, in the axes of that joint's frame.

    name : for people, e.g. `gripper`
    joint : whose link carries it, from zero; -1 is the last
    mass : [kg]
    centre : (3,) centre of mass from the joint frame's origin [m]
    inertia : (3, 3) about the centre of mass [kg m^2]; a point by default
    """

    name: str
    mass: float
    centre: FloatArray
    inertia: FloatArray = field(default_factory=lambda: np.zeros((3, 3)))
    joint: int = -1

    def __post_init__(self) -> None:
        where = f"attached body {self.name}"
        object.__setattr__(self, "centre", frozen("centre", self.centre, (3,), where=where))
        object.__setattr__(self, "inertia", frozen("inertia", self.inertia, (3, 3), where=where))
        if not (np.isfinite(self.mass) and self.mass > 0.0):
            raise SimulationError("mass must be above zero", where=where, got=self.mass)
        if np.abs(self.inertia - self.inertia.T).max() > 1e-12 * np.abs(self.inertia).max():
            raise SimulationError("inertia is not symmetric", where=where)
        defect = inertia_defect(self.mass, self.inertia) if self.inertia.any() else ""
        if defect:
            raise SimulationError(defect, where=where)

    @property
    def parameters(self) -> FloatArray:
        """The ten inertial parameters about the joint frame's origin, (10,), by the parallel axis theorem."""
        return inertia_at_origin(mass=self.mass, com=self.centre, inertia_at_com=self.inertia)

    def check(self, n_v: int) -> None:
        """Refuse a robot without the joint."""
        if not -n_v <= self.joint < n_v:
            where = f"attached body {self.name}"
            raise SimulationError("no such joint", where=where, expected=f"-1 to {n_v - 1}", got=self.joint)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        values = {item.name: getattr(self, item.name) for item in fields(self)}
        return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in values.items()}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> AttachedBody:
        """Return what `to_dict` described."""
        return cls(**{item.name: data[item.name] for item in fields(cls)})
