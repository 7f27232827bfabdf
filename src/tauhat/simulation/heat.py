"""Friction that depends on the temperature of its joint, which friction itself heats.

dT/dt = heating |friction dq_m| - (T - ambient) / time_constant
friction = friction at the reference (1 + slope (T - reference)), never less than nothing
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import SimulationError
from tauhat.simulation.laws import JointLaw, PassiveLaw


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrictionHeat:
    """Thermal state of each joint, and what it does to friction.

    heating : (n_v,) rise of temperature by a joule of friction heat, one over the heat capacity [K/J]
    time_constant : (n_v,) of cooling [s]
    viscous, coulomb : (n_v,) change of the plant's own friction by a kelvin, relative [1/K]
    initial : (n_v,) temperature at the start [deg C]
    laws : (n_laws, n_v) change of the passive laws, in their order; no rows where no law changes [1/K]
    ambient, reference : surroundings, and where friction is as the parameters say [deg C]
    """

    heating: FloatArray
    time_constant: FloatArray
    viscous: FloatArray
    coulomb: FloatArray
    initial: FloatArray
    laws: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    ambient: float = 20.0
    reference: float = 20.0

    def __post_init__(self) -> None:
        where = "heat of friction"
        if not np.isfinite([self.ambient, self.reference]).all():
            raise SimulationError("temperature", where=where, expected="finite", got=(self.ambient, self.reference))
        heating = frozen("heating", self.heating, (None,), where=where)
        for name in ("heating", "time_constant", "viscous", "coulomb", "initial"):
            object.__setattr__(self, name, frozen(name, getattr(self, name), heating.shape, where=where))
        rows = np.asarray(self.laws, dtype=np.float64)
        rows = rows if rows.size else np.zeros((0, heating.size))
        object.__setattr__(self, "laws", frozen("laws", rows, (None, heating.size), where=where))
        if self.heating.min() < 0.0:
            raise SimulationError("heating is negative", where=where, got=self.heating.min())
        if self.time_constant.min() <= 0.0:
            raise SimulationError("time_constant must be above zero", where=where, got=self.time_constant.min())

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return int(self.heating.size)

    def check(self, laws: Sequence[PassiveLaw], n_v: int) -> None:
        """Refuse a robot of another number of joints, and laws whose friction has no temperature of its own."""
        where = "heat of friction"
        if self.n_v != n_v:
            raise SimulationError("of another robot", where=where, expected=f"{n_v} joints", got=self.n_v)
        if len(self.laws) not in {0, len(laws)}:
            raise SimulationError("rows of laws", where=where, expected=len(laws), got=len(self.laws))
        for law, row in zip(laws, self.laws, strict=False):
            friction = isinstance(law, JointLaw) and law.side == "motor"
            if row.any() and not friction:
                raise SimulationError("only friction of single joints can depend on heat", where=where, got=law.key)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        values = {item.name: getattr(self, item.name) for item in fields(self)}
        return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in values.items()}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> FrictionHeat:
        """Return what `to_dict` described."""
        return cls(**{item.name: data[item.name] for item in fields(cls)})
