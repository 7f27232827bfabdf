"""What a physically consistent estimate must keep to: margins, bounds on links, and a pull to the nominal robot."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import ModelError

_ORTHOGONALITY = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Box:
    """A box in the link's frame.

    lower, upper : (3,) corners [m]
    """

    lower: FloatArray
    upper: FloatArray

    def __post_init__(self) -> None:
        for name in ("lower", "upper"):
            object.__setattr__(self, name, frozen(name, getattr(self, name), (3,), where="box"))
        if (self.lower > self.upper).any():
            raise ModelError("a corner is below its opposite", where="box", got=(self.lower - self.upper).tolist())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ellipsoid:
    """A solid ellipsoid in the link's frame.

    centre : (3,) [m]
    semi_axes : (3,) [m]
    rotation : (3, 3), its columns are the directions of the axes
    """

    centre: FloatArray
    semi_axes: FloatArray
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        for name, shape in (("centre", (3,)), ("semi_axes", (3,)), ("rotation", (3, 3))):
            object.__setattr__(self, name, frozen(name, getattr(self, name), shape, where="ellipsoid"))
        if self.semi_axes.min() <= 0.0:
            raise ModelError("the semi-axes must be positive", where="ellipsoid", got=self.semi_axes.tolist())
        if np.abs(self.rotation.T @ self.rotation - np.eye(3)).max() > _ORTHOGONALITY:
            raise ModelError("rotation is not orthonormal", where="ellipsoid")

    @property
    def whitening(self) -> FloatArray:
        """Matrix (3, 3) [1/m] that takes the ellipsoid to the unit ball around its centre."""
        return np.asarray(self.rotation.T / self.semi_axes[:, None])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinkConstraints:
    """What is known of one link beyond the data.

    joint : name of the joint that moves the link
    mass : smallest and largest mass [kg]
    centre : where the centre of mass may be, in the link's frame
    body : an ellipsoid that holds all of the link's mass; bounds its inertia, too
    trust : factor on the pull of this link towards its nominal figures
    """

    joint: str
    mass: tuple[float, float] = (0.0, np.inf)
    centre: Box | Ellipsoid | None = None
    body: Ellipsoid | None = None
    trust: float = 1.0

    def __post_init__(self) -> None:
        where = f"link of joint {self.joint}"
        object.__setattr__(self, "mass", (float(self.mass[0]), float(self.mass[1])))
        lower, upper = self.mass
        if not (0.0 <= lower < np.inf and lower <= upper and upper > 0.0):
            raise ModelError("no mass is within these bounds", where=where, got=f"{lower:g} to {upper:g} kg")
        if not 0.0 < self.trust < np.inf:
            raise ModelError("the trust in a link must be positive", where=where, got=self.trust)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Pull:
    """A pull with the strength of a measurement of every nominal figure with a relative deviation.

    deviation : 1 means the nominal figures are good to a factor of about two; large values only decide what the
        recordings leave open
    """

    key: ClassVar[str]
    deviation: float = 10.0

    def __post_init__(self) -> None:
        if not 0.0 < self.deviation < np.inf:
            raise ModelError("the deviation of the nominal figures must be positive", got=self.deviation)


@dataclass(frozen=True, slots=True, kw_only=True)
class GaussianPull(_Pull):
    """Squared distance of the pseudo-inertias, `|L^-1 (J - J0) L^-T|^2 / 2`, in the metric `L L'` of the nominal body.

    Does not depend on the choice of frames or units.
    """

    key: ClassVar[str] = "gaussian"


@dataclass(frozen=True, slots=True, kw_only=True)
class EntropicPull(_Pull):
    """Log-det Bregman divergence `tr(J J0^-1) - log det(J J0^-1) - 4`: infinite for a body without thickness.

    It is the relative entropy of Gaussian distributions of mass; near the nominal body it equals `GaussianPull` in that
    body's own metric. Friction and rotor inertia are pulled by squared distance as there.

    Source: Lee, Wensing, Park, "Geometric robot dynamic identification: a convex programming approach", 2020.
    """

    key: ClassVar[str] = "entropic"


Pull: TypeAlias = GaussianPull | EntropicPull


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PhysicalConstraints:
    """What physics, drawings and the nominal model say about the parameters.

    margin : smallest eigenvalue of every link's pseudo-inertia over its trace; 1e-6 is a link of 1 mm (root mean
        square) in its thinnest direction
    least_mass : share of its nominal mass below which no link may fall
    links : bounds on single links
    unbounded : symbols of friction and rotor parameters whose lower bound is not kept, e.g. `("Ia",)` where the torque
        is measured behind the gear: a rotor inertia then stands for small delays, and may be negative
    pull : towards the nominal robot; decides what the recordings leave open

    Raises
    ------
    ModelError
        when the margin or the share of mass is out of range, or a link is named twice.
    """

    margin: float = 1e-6
    least_mass: float = 1e-3
    links: tuple[LinkConstraints, ...] = ()
    unbounded: tuple[str, ...] = ()
    pull: Pull = field(default_factory=GaussianPull)

    def __post_init__(self) -> None:
        object.__setattr__(self, "links", tuple(self.links))
        object.__setattr__(self, "unbounded", tuple(str(symbol) for symbol in self.unbounded))
        if not 0.0 < self.margin < 0.25:
            raise ModelError("margin out of range", expected="above 0, below 0.25", got=self.margin)
        if not 0.0 < self.least_mass < 1.0:
            raise ModelError("least share of the nominal mass out of range", expected="0 to 1", got=self.least_mass)
        names = [link.joint for link in self.links]
        if len(set(names)) < len(names):
            raise ModelError("a link is constrained twice", got=", ".join(names))
