"""What balances and couples joints: springs, a gas cylinder, motors that turn with two joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.dynamics.terms import GasSpring
from tauhat.dynamics.terms.presliding import LENGTHS
from tauhat.errors import ExportError
from tauhat.robots.shared_motor import SharedMotor


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LoadedGasSpring:
    """A gas cylinder and what it holds.

    spring : geometry, as in `tauhat.dynamics`
    energy : of the gas, pressure times volume [J]
    """

    spring: GasSpring
    energy: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CoupledMotors:
    """Motors that turn with two joints, `q_m = q_own + ratio q_other`: what they do beyond the joints' own parameters.

    motors : own joint, other joint, ratio
    inertia, viscous : (n_motors,) [kg m^2, Nm s/rad] or [kg, N s/m]
    dry : (n_motors, 1) of a sign, or (n_motors, 2) of two Dahl states [Nm or N]
    widths : (n_motors,) of the smooth sign [rad/s]; empty for the plain one, and with Dahl states
    scales : (n_motors,) of the lengths of Dahl states; empty: one
    """

    motors: tuple[SharedMotor, ...]
    inertia: FloatArray
    viscous: FloatArray
    dry: FloatArray
    widths: tuple[float, ...] = ()
    scales: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        count = len(self.motors)
        for name, shape in (("inertia", (count,)), ("viscous", (count,)), ("dry", (count, None))):
            object.__setattr__(self, name, frozen(name, getattr(self, name), shape, where="coupled motors"))
        for name, values in (("width", self.widths), ("scale", self.scales)):
            if values and len(values) != count:
                raise ExportError(f"one {name} a motor is needed", where="coupled motors", got=len(values))
        if self.dry.shape[1] not in {1, len(LENGTHS)}:
            raise ExportError("dry friction is of one sign or two Dahl states", where="coupled motors")

    def lengths(self, motor: int) -> tuple[float, ...]:
        """Return the lengths over which a motor's Dahl states turn round [rad or m]."""
        scale = self.scales[motor] if self.scales else 1.0
        return tuple(scale * length for length in LENGTHS)

    @property
    def has_memory(self) -> bool:
        """Whether dry friction is that of Dahl states."""
        return self.dry.shape[1] == len(LENGTHS) and bool(self.dry.any())

    @property
    def key(self) -> str:
        """Name of the term."""
        return "coupling-dahl" if self.dry.shape[1] == len(LENGTHS) else "coupling"

    @property
    def largest(self) -> float:
        """The largest size of a coefficient."""
        sizes = [np.abs(part).max(initial=0.0) for part in (self.inertia, self.viscous, self.dry)]
        return float(max(sizes))
