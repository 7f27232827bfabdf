"""A load cell behind the tip: the true normal force with errors of its own."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tauhat.arrays import check_fields
from tauhat.errors import SimulationError

_HOUR = 3600.0  # [s]
_SIGNED, _OR_ZERO = ("offset", "drift"), ("noise", "offset_spread", "walk")


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadCell:
    """Errors of a force sensor; zero means a perfect one. The figures are orders of magnitude chosen by us.

    noise : standard deviation of white noise [N]
    offset : constant error [N]
    offset_spread : standard deviation of a further one, drawn for each cell [N]
    drift : growth of the error [N/h]
    walk : standard deviation of a random walk after an hour [N]
    """

    noise: float = 0.2
    offset: float = 0.0
    offset_spread: float = 0.5
    drift: float = 0.2
    walk: float = 0.2

    def __post_init__(self) -> None:
        check_fields(self, error=SimulationError, name="load cell", or_zero=_OR_ZERO, signed=_SIGNED)

    def drawn(self, rng: np.random.Generator) -> LoadCell:
        """Return one cell, its offset drawn."""
        return replace(self, offset=self.offset + self.offset_spread * rng.standard_normal(), offset_spread=0.0)


class LoadCellReader:
    """A load cell read sample after sample; it remembers its walk.

    cell : what is not drawn yet is drawn
    """

    __slots__ = ("_before", "_cell", "_rng", "_walked")

    def __init__(self, cell: LoadCell, rng: np.random.Generator) -> None:
        self._cell, self._rng = cell.drawn(rng), rng
        self._walked, self._before = 0.0, 0.0

    def read(self, t: float, force: float) -> float:
        """Return what it shows of a force at the time t, which never falls [N, s]."""
        cell, passed = self._cell, max(t - self._before, 0.0) / _HOUR
        noise, walk = self._rng.standard_normal(2)
        self._walked += cell.walk * passed**0.5 * walk
        self._before = t
        return float(force + cell.offset + cell.drift * t / _HOUR + self._walked + cell.noise * noise)
