"""Elastic transmissions: a spring, a damper and a gap between each motor and its link.

The motor turns by itself: its kinetic energy is that of its own spin, `1/2 rotor dq_m^2` (Spong's assumption, good for
gears of high ratio), so that motor and link only meet in the spring:

    rotor ddq_m + friction(q_m, dq_m) + gear_torque = tau
    inverse dynamics(q, dq, ddq) + springs(q) = gear_torque (+ what pushes from outside)
    gear_torque = stiffness (d -+ gap/2) + damping dd beyond the gap, 0 inside;  d = q_m - q

Source: Spong, "Modeling and control of elastic joint robots", 1987.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import SimulationError


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ElasticJoints:
    """Which joints have an elastic transmission, and of what kind; n_e of them.

    With a gap the transmission only pushes: where its damper would pull the teeth together, it lets go.

    joints : from zero
    stiffness : (n_e,) [Nm/rad or N/m]
    damping : (n_e,) [Nm s/rad or N s/m]
    gap : (n_e,) whole backlash, motor against link [rad or m], or one number for all; none by default
    """

    joints: tuple[int, ...]
    stiffness: FloatArray
    damping: FloatArray
    gap: FloatArray = field(default_factory=lambda: np.array(0.0))

    def __post_init__(self) -> None:
        object.__setattr__(self, "joints", tuple(int(joint) for joint in self.joints))
        if not self.joints or len(set(self.joints)) < len(self.joints) or min(self.joints) < 0:
            raise SimulationError("elastic joints", expected="different joints, from zero", got=self.joints)
        size = len(self.joints)
        if np.size(self.gap) == 1:
            object.__setattr__(self, "gap", np.full(size, float(np.ravel(self.gap)[0])))
        for name in ("stiffness", "damping", "gap"):
            values = frozen(name, getattr(self, name), (size,), where="elastic joints")
            object.__setattr__(self, name, values)
            refused = values <= 0.0 if name == "stiffness" else values < 0.0
            if refused.any():
                wanted = "above zero" if name == "stiffness" else "at least zero"
                worst = int(np.argmax(refused))
                where = f"elastic joints, joint {self.joints[worst] + 1}"
                raise SimulationError(f"{name} must be {wanted}", where=where, got=values[worst])

    def check(self, n_v: int) -> None:
        """Refuse a robot without these joints."""
        if max(self.joints) >= n_v:
            raise SimulationError("elastic joints: no such joint", expected=f"0 to {n_v - 1}", got=max(self.joints))

    def spread(self, values: FloatArray, n_v: int) -> FloatArray:
        """Return values (n_e,) joint by joint, (n_v,), with zeros on the rigid ones."""
        whole = np.zeros(n_v)
        whole[list(self.joints)] = values
        return whole

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        arrays = {name: getattr(self, name).tolist() for name in ("stiffness", "damping", "gap")}
        return {"joints": list(self.joints)} | arrays

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> ElasticJoints:
        """Return what `to_dict` described."""
        return cls(**{item.name: data[item.name] for item in fields(cls)})
