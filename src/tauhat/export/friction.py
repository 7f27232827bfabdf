"""Friction as other programs are told it: one law a term, with the same coefficients on every joint."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import ExportError


class LawForm(NamedTuple):
    """What a law is made of: the symbols of its coefficients, and the field of its term that holds the shape."""

    symbols: tuple[str, ...]
    shape_field: str = ""


LAWS: Mapping[str, LawForm] = {
    "viscous": LawForm(("Fv",)),
    "coulomb": LawForm(("Fc",), "widths"),
    "offset": LawForm(("To",)),
    "cube-root": LawForm(("Fr",)),
    "viscous-asymmetry": LawForm(("Fva",)),
    "asymmetric": LawForm(("Fv+", "Fv-", "Fc+", "Fc-"), "widths"),
    "stribeck": LawForm(("Fs",), "speeds"),
    "polynomial": LawForm(("k0", "k1", "k2", "k3", "k4"), "speeds"),
}
_SHAPE_NEEDED = ("stribeck", "polynomial")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrictionLaw:
    """A torque that depends on the joint's own speed alone, in the forms of `tauhat.dynamics`.

    key : a name of `LAWS`
    coefficients : (n_symbols, n_v) [SI, joint side]; zero on joints without the law
    shape : (n_v,) widths or speeds [rad/s or m/s]; empty for laws without, and for the plain sign
    """

    key: str
    coefficients: FloatArray
    shape: FloatArray = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        if self.key not in LAWS:
            raise ExportError("unknown law of friction", expected=", ".join(LAWS), got=self.key)
        where = f"friction {self.key}"
        rows = len(LAWS[self.key].symbols)
        coefficients = frozen("coefficients", self.coefficients, (rows, None), where=where)
        object.__setattr__(self, "coefficients", coefficients)
        object.__setattr__(self, "shape", frozen("shape", self.shape, (None,), where=where))
        if self.shape.size and (self.shape.size != self.n_v or self.shape.min() <= 0.0):
            raise ExportError(
                "the shape must be one positive value a joint", where=where, expected=self.n_v, got=self.shape
            )
        if self.key in _SHAPE_NEEDED and not self.shape.size:
            raise ExportError("the law has no shape yet", where=where, remedy="identify first: the fit chooses it")

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return int(self.coefficients.shape[1])

    @property
    def largest(self) -> float:
        """The largest size of a coefficient."""
        return float(np.abs(self.coefficients).max(initial=0.0))
