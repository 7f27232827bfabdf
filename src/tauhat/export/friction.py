"""Friction as other programs are told it: one law a term, with the same coefficients on every joint."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.dynamics.terms.presliding import LENGTHS
from tauhat.errors import ExportError


class LawForm(NamedTuple):
    """What a law is made of.

    symbols : of its coefficients
    shape_field : of its term, that holds the shape
    lengths : of its Dahl states [rad or m]; empty for laws without a memory
    of_load : whether it is in proportion to the rigid torque through the gear
    """

    symbols: tuple[str, ...]
    shape_field: str = ""
    lengths: tuple[float, ...] = ()
    of_load: bool = False


LAWS: Mapping[str, LawForm] = {
    "viscous": LawForm(("Fv",)),
    "coulomb": LawForm(("Fc",), "widths"),
    "offset": LawForm(("To",)),
    "cube-root": LawForm(("Fr",)),
    "viscous-asymmetry": LawForm(("Fva",)),
    "asymmetric": LawForm(("Fv+", "Fv-", "Fc+", "Fc-"), "widths"),
    "stribeck": LawForm(("Fs",), "speeds"),
    "polynomial": LawForm(("k0", "k1", "k2", "k3", "k4"), "speeds"),
    "dahl": LawForm(("Fd", "Fe"), "scales", LENGTHS),
    "load-coulomb": LawForm(("Fl",), "widths", of_load=True),
    "load-dahl": LawForm(("Fl",), "", LENGTHS[:1], of_load=True),
}
_SHAPE_NEEDED = ("stribeck", "polynomial")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrictionLaw:
    """A torque that brakes each joint by its own motion, in the forms of `tauhat.dynamics`.

    key : a name of `LAWS`
    coefficients : (n_symbols, n_v) [SI, joint side]; zero on joints without the law
    shape : (n_v,) widths or speeds [rad/s or m/s], or scales of the lengths; empty for laws without, for the plain
        sign, and for scales of one
    load : (n_v, 10) inertial parameters whose rigid torque loads the gears; empty for laws without
    """

    key: str
    coefficients: FloatArray
    shape: FloatArray = field(default_factory=lambda: np.zeros(0))
    load: FloatArray = field(default_factory=lambda: np.zeros((0, 10)))

    def __post_init__(self) -> None:
        if self.key not in LAWS:
            raise ExportError("unknown law of friction", expected=", ".join(LAWS), got=self.key)
        where, form = f"friction {self.key}", LAWS[self.key]
        coefficients = frozen("coefficients", self.coefficients, (len(form.symbols), None), where=where)
        object.__setattr__(self, "coefficients", coefficients)
        object.__setattr__(self, "shape", frozen("shape", self.shape, (None,), where=where))
        loaded = self.n_v if form.of_load else 0
        object.__setattr__(self, "load", frozen("load", self.load, (loaded, 10), where=where))
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

    @property
    def has_memory(self) -> bool:
        """Whether the torque depends on the way that the joint came."""
        return bool(LAWS[self.key].lengths) and self.largest > 0.0

    def lengths(self, joint: int) -> tuple[float, ...]:
        """Return the lengths over which the law's Dahl states turn round on a joint [rad or m]."""
        scale = float(self.shape[joint]) if self.shape.size else 1.0
        return tuple(scale * length for length in LAWS[self.key].lengths)
