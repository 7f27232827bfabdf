"""One set of numbers for the full and the simplified model of the CRS A465: its minimal barycentric parameters.

The base parameters of the two models differ in number and in what they stand for. But whatever torque the simplified
model can make, the full one can too: with `e` the columns of the full model that are the simplified one's base columns,

    Y_s x_s = Y e x_s = Y_b (P e) x_s          P: standard -> full base parameters, (n_b, n_p)

so `x_b = P e x_s` is the one set of full base parameters that predicts the same on every motion. Barycentric parameters
beta follow the standard ones through `x = B beta` (drives are left as they are), and those of a minimal set k are

    x_b = P B beta = (P B)[:, k] beta_k,       beta_k = (P B)[:, k]^-1 x_b

Both maps are linear, and the error bars go with them: `cov(beta) = T cov(x) T'`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.barycentric import SYMBOLS, barycentric_parameters
from tauhat.dynamics.base import BaseParameters
from tauhat.dynamics.closed_form_base import PREFERENCE, base_of_projection
from tauhat.dynamics.selection import independent_columns
from tauhat.dynamics.terms import INERTIAL_SYMBOLS, Parameter
from tauhat.studies.crs_a465.experiment import TERMS, Identifiable, identifiable


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Coordinates:
    """The minimal barycentric parameters and how both models' base parameters become them.

    parameters : of the minimal set, n_c of them, those of the drives unchanged behind the links'
    formulas : what each is the sum of
    to_full : from these to the full model's base parameters, (n_b, n_c)
    from_base : from each model's base parameters to these, (n_c, n_b)
    """

    parameters: tuple[Parameter, ...]
    formulas: tuple[str, ...]
    to_full: FloatArray
    from_base: dict[str, FloatArray]

    @property
    def n_c(self) -> int:
        """Number of parameters."""
        return len(self.parameters)

    @property
    def n_rigid(self) -> int:
        """Number of parameters of the links; they come first."""
        return sum(parameter.symbol in SYMBOLS for parameter in self.parameters)


@cache
def coordinates() -> Coordinates:
    """Return the coordinates of the arm's two models."""
    full = identifiable("full")
    bodies = barycentric_parameters(full.model.robot)
    standard = full.model.parameters
    count = len(bodies.parameters)
    inverse = np.eye(full.model.n_p)
    inverse[:count, :count] = bodies.inverse
    every = (*bodies.parameters, *standard[count:])
    projection = full.base.projection @ inverse
    kept = independent_columns(projection, [item.unit for item in every], _order(standard, count))
    base = base_of_projection(tuple(item.name for item in every), projection, kept)
    turned = np.linalg.solve(projection[:, kept], np.eye(full.base.n_b))
    return Coordinates(
        parameters=tuple(every[index] for index in kept),
        formulas=base.formulas(),
        to_full=np.asarray(projection[:, kept]),
        from_base={name: turned @ _to_full(full.base, identifiable(name)) for name in TERMS},
    )


def _order(standard: tuple[Parameter, ...], count: int) -> list[int]:
    """Return the links' parameters from the base on, in each the preferred ones first; then the drives'."""

    def key(index: int) -> tuple[int, int]:
        return standard[index].joint, PREFERENCE.index(INERTIAL_SYMBOLS[index % 10])

    return [*sorted(range(count), key=key), *range(count, len(standard))]


def _to_full(full: BaseParameters, other: Identifiable) -> FloatArray:
    """Return the matrix (n_b, n_b of the other) to the full base parameters that predict the same on every motion."""
    places = [full.names.index(other.base.names[index]) for index in other.base.independent]
    return np.asarray(full.projection[:, places])
