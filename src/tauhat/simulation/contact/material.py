"""What the workpiece is made of: friction, stiffness of its skin, and where that changes along the path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tauhat.errors import SimulationError

_IMPEDANCE = 1e-3  # of MuJoCo's contact row: a spring and a damper, with hardly any mass of its own
_STEADY = 2.0  # half of what an explicit spring and damper bear: `h^2 K / m + 2 h C / m` is unstable at 4
_STICKING = 0.5  # part of a step's speed that a sticking contact takes away in the step


class Region(NamedTuple):
    """A stretch of the path, from `start` up to `end`, with a skin of its own stiffness [m, m, N/m]."""

    start: float
    end: float
    stiffness: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Material:
    """A skin that yields as a spring with a damper, and Coulomb friction between it and the tip.

    friction : tangential over normal force while the tip slides
    stiffness : of the skin under the tip [N/m]
    relaxation : damping over stiffness [s]
    regions : stretches of the path where the skin is harder or softer; the first that holds the tip counts
    """

    friction: float = 0.2
    stiffness: float = 1e5
    relaxation: float = 1e-3
    regions: tuple[Region, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "regions", tuple(Region(*region) for region in self.regions))
        if not 0.0 <= self.friction < np.inf:
            raise SimulationError("material, friction", expected="a number >= 0", got=self.friction)
        for name, value in (("stiffness", self.hardest), ("stiffness", self.softest), ("relaxation", self.relaxation)):
            if not 0.0 < value < np.inf:
                raise SimulationError(f"material, {name}", expected="a positive number", got=value)
        for region in self.regions:
            if not region.start < region.end:
                raise SimulationError("material, region", expected="start before end", got=region[:2])

    @property
    def hardest(self) -> float:
        """Largest stiffness anywhere [N/m]."""
        return max(self.stiffness, *(region.stiffness for region in self.regions), 0.0)

    @property
    def softest(self) -> float:
        """Smallest stiffness anywhere [N/m]."""
        return min(self.stiffness, *(region.stiffness for region in self.regions), np.inf)

    def stiffness_at(self, s: float) -> float:
        """Return the stiffness of the skin at the arc length s [m], in [N/m]."""
        for region in self.regions:
            if region.start <= s < region.end:
                return region.stiffness
        return self.stiffness


@dataclass(frozen=True, slots=True, kw_only=True)
class SkinConstraint:
    """A skin in MuJoCo's terms: its contact force is that of a spring and a damper, `f = K depth + C speed`.

    MuJoCo's contact row has `f = (b speed + k depth - a) d / ((1 - d) A)` with the impedance d, the row's approximate
    mobility A, and the acceleration a out of the surface; hence `k = K (1 - d) A / d`, and b as k from C. The term of a
    is a mass `d / ((1 - d) A)` that moves with the contact. With d near one, MuJoCo's habit, it is many times the
    tip's: the force then does not fall to nothing where the tip leaves, and a light tip on a spring hops for ever
    (measured: 0.1 kg at 400 N/mm and d = 0.96). With d near zero the force is the spring's and the damper's.

    mobility : A [1/kg]
    relaxation : C over K [s]
    timestep : [s]

    Source: MuJoCo documentation, "Computation", the constraint model; Todorov, "Convex and analytically-invertible
    dynamics with contacts and constraints", 2014.
    """

    mobility: float
    relaxation: float
    timestep: float

    @property
    def solimp(self) -> tuple[float, ...]:
        """Impedance that does not depend on the depth."""
        return (_IMPEDANCE, _IMPEDANCE, 1e-3, 0.5, 2.0)

    @property
    def sliding_solref(self) -> tuple[float, float]:
        """Return the direct form for the tangents, which know speeds only."""
        return (-1.0, -_IMPEDANCE * _STICKING / self.timestep)

    def solref(self, stiffness: float) -> tuple[float, float]:
        """Return MuJoCo's direct form, (-k d, -b d), of a skin's stiffness [N/m]."""
        # MuJoCo divides by d^2 and multiplies by d on its way from these numbers to k; by d on the way to b.
        scaled = stiffness * (1.0 - _IMPEDANCE) * self.mobility
        return (-scaled, -scaled * self.relaxation)


def skin_constraint(material: Material, *, mobility: float, tip_mass: float, timestep: float) -> SkinConstraint:
    """Return the contact row of a material.

    Parameters
    ----------
    mobility : MuJoCo's approximation for the contact row [1/kg]
    tip_mass : [kg]
    timestep : [s]

    Raises
    ------
    SimulationError
        when the skin is too stiff for the tip and the timestep.
    """
    largest = _STEADY * tip_mass / (timestep * (timestep + 2.0 * material.relaxation))
    if material.hardest > largest:
        raise SimulationError(
            "the material is too stiff for the timestep", where="material", expected=f"at most {largest:.3g} N/m",
            got=f"{material.hardest:.3g} N/m", remedy="shorten the timestep, or make the tip heavier",
        )  # fmt: skip
    return SkinConstraint(mobility=mobility, relaxation=material.relaxation, timestep=timestep)
