"""What an observer knows of friction that warms up: the thermal term of an estimate, and the estimate without it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.dynamics.model import TorqueModel
from tauhat.dynamics.terms import Thermal
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.rotor_load import standard_with_rotors
from tauhat.estimation.warming import slopes_of, thermal_term


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SensedHeat:
    """How friction of a model changes with the warmth of its joints.

    term : time constants, and what heats
    slopes : change of dry and viscous friction by one unit of warmth, (n_v, 2) [Nm, Nm s/rad]
    """

    term: Thermal
    slopes: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "slopes", frozen("slopes", self.slopes, (None, 2), where="sensed heat"))

    def numbers(self, step: float) -> FloatArray:
        """Return what `dynamics.thermal_kernel` reads at samples `step` seconds apart, (n_v, 5)."""
        return self.term.numbers(len(self.slopes), step)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Parted:
    """An estimate in two: the model without its thermal term, with standard parameters (n_p,), and the heat.

    Where there is no such term, there is no heat either.
    """

    model: TorqueModel
    standard: FloatArray
    heat: SensedHeat | None


def parted(estimate: Estimate) -> Parted:
    """Return an estimate with its thermal term taken out: friction as it was where the fitted recording began."""
    model = estimate.model
    standard = standard_with_rotors(model, estimate.base, estimate.values)
    term = thermal_term(model)
    if term is None:
        return Parted(model=model, standard=standard, heat=None)
    own = np.array([other is term for other in model.terms for _ in other.parameters(model.robot)])
    rest = replace(model, terms=tuple(other for other in model.terms if other is not term))
    return Parted(
        model=rest, standard=standard[~own], heat=SensedHeat(term=term, slopes=slopes_of(model, standard))
    )  # fmt: skip
