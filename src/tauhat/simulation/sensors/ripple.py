"""Ripple: an error of the torque that repeats with the angle, from cogging, gear teeth or the flexspline of a gear."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import SimulationError
from tauhat.simulation.sensors.joint_values import checked, per_joint

Turning: TypeAlias = Literal["joint", "motor"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ripple:
    """`amplitude sin(order angle + phase)` on the torque that is shown; one number for all joints or (n_v,) each.

    amplitude : [Nm or N]
    order : periods in a revolution of what turns (in 2 pi m of a prismatic joint)
    turns : whose angle counts, the `joint`'s or the `motor`'s before its gear
    gear_ratio : revolutions of the motor in one of the joint; counts for the motor only
    phase : at the angle zero [rad]; None draws one for every joint
    """

    amplitude: float | FloatArray
    order: float | FloatArray
    turns: Turning = "joint"
    gear_ratio: float | FloatArray = 1.0
    phase: float | FloatArray | None = 0.0

    def __post_init__(self) -> None:
        if self.turns not in {"joint", "motor"}:
            raise SimulationError("ripple, turns", expected="joint or motor", got=self.turns)
        for name in ("amplitude", "order"):
            object.__setattr__(self, name, checked(f"ripple.{name}", getattr(self, name), least=0.0))
        object.__setattr__(self, "gear_ratio", checked("ripple.gear_ratio", self.gear_ratio))
        if self.phase is not None:
            object.__setattr__(self, "phase", checked("ripple.phase", self.phase))

    def scaled(self, factor: float) -> Ripple:
        """Return the same ripple, `factor` times as high."""
        return replace(self, amplitude=factor * np.asarray(self.amplitude))

    def drawn(self, n_v: int, rng: np.random.Generator) -> Ripple:
        """Return the ripple with a phase for every joint, drawn where none is given."""
        return self if self.phase is not None else replace(self, phase=rng.uniform(0.0, 2.0 * np.pi, n_v))

    def torque(self, angle: FloatArray) -> FloatArray:
        """Return what it adds, (n, n_v), where the joint side's angle of what turns is `angle` (n, n_v) [rad or m].

        Raises
        ------
        SimulationError
            when it has no phase yet, or not one value a joint.
        """
        if self.phase is None:
            raise SimulationError("the ripple's phase is not drawn yet", remedy="use SensorErrors.drawn")
        n_v = angle.shape[1]
        values = [per_joint(f"ripple.{name}", getattr(self, name), n_v) for name in ("amplitude", "order", "phase")]
        ratio = per_joint("ripple.gear_ratio", self.gear_ratio, n_v) if self.turns == "motor" else np.ones(n_v)
        amplitude, order, phase = values
        return np.asarray(amplitude * np.sin(order * ratio * angle + phase))
