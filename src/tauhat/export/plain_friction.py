"""Friction in the two words that simulators have: damping and dry friction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.export.friction import FrictionLaw


@dataclass(frozen=True, slots=True, kw_only=True)
class Approximation:
    """How near `damping dq + dry_friction` comes to a joint's identified friction in steady motion.

    joint, unit, speed_unit : its name, and those of its torque and speed
    damping, dry_friction : [Nm s/rad, Nm] or [N s/m, N]
    deviation : the largest, of all speeds compared [Nm or N]
    share : the largest, in parts of the friction at the same speed; inf where that is zero
    worst_speed : at which the share is that large [rad/s or m/s]
    slowest, fastest : speeds compared [rad/s or m/s]
    """

    joint: str
    unit: str
    speed_unit: str
    damping: float
    dry_friction: float
    deviation: float
    share: float
    worst_speed: float
    slowest: float
    fastest: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlainFriction:
    """Damping and dry friction of all joints.

    damping, dry_friction : (n_v,) [Nm s/rad, Nm] or [N s/m, N]; None where the model has nothing of the kind
    approximations : one a joint where these are not exactly the model's
    """

    damping: FloatArray | None = None
    dry_friction: FloatArray | None = None
    approximations: tuple[Approximation, ...] = ()

    def __post_init__(self) -> None:
        for name in ("damping", "dry_friction"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, frozen(name, value, (None,), where="plain friction"))

    def of_joint(self, joint: int) -> tuple[float | None, float | None]:
        """Return damping and dry friction of one joint."""
        both = (self.damping, self.dry_friction)
        damping, dry = (None if values is None else float(values[joint]) for values in both)
        return damping, dry


def textbook_friction(laws: Sequence[FrictionLaw]) -> PlainFriction:
    """Return the viscous and the Coulomb law of a model, as they are."""
    found = {law.key: np.asarray(law.coefficients[0]) for law in laws if law.key in {"viscous", "coulomb"}}
    return PlainFriction(damping=found.get("viscous"), dry_friction=found.get("coulomb"))
