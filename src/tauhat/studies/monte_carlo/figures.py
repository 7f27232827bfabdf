"""Everything the chapters tell of: settings, cells and standings, and how single figures are found among them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tauhat.studies.monte_carlo.cells import Cell, cells_of
from tauhat.studies.monte_carlo.families import family_of
from tauhat.studies.monte_carlo.fitting import Fit
from tauhat.studies.monte_carlo.standings import Standing, reference_of, standings_of

if TYPE_CHECKING:
    from tauhat.studies.monte_carlo.monte_carlo_study import MonteCarloStudy


@dataclass(frozen=True, slots=True, kw_only=True)
class Figures:
    """What was found, fit by fit and in sum."""

    study: MonteCarloStudy
    fits: tuple[Fit, ...]
    cells: tuple[Cell, ...]
    standings: tuple[Standing, ...]

    @classmethod
    def of(cls, study: MonteCarloStudy, fits: Sequence[Fit]) -> Figures:
        """Return the fits with what follows from them."""
        return cls(
            study=study,
            fits=tuple(fits),
            cells=cells_of(fits, usable=study.usable),
            standings=standings_of(fits, noises=study.noises, usable=study.usable),
        )

    @property
    def reference(self) -> str:
        """Whom the others are compared with."""
        return reference_of(self.study.estimators)

    @property
    def middle_noise(self) -> float:
        """The level of noise at which rates are compared."""
        return sorted(self.study.noises)[len(self.study.noises) // 2]

    @property
    def middle_rate(self) -> float:
        """The rate at which levels of noise are compared [Hz]."""
        return sorted(self.study.rates)[len(self.study.rates) // 2]

    def estimators_of(self, family: str) -> tuple[str, ...]:
        """Return the family's estimators that were fitted."""
        return tuple(key for key in self.study.estimators if family_of(key) == family)

    def cells_where(self, *, robot: str, estimator: str) -> tuple[Cell, ...]:
        """Return the cells of an estimator on a robot, by noise and rate."""
        found = [cell for cell in self.cells if cell.robot == robot and cell.estimator == estimator]
        return tuple(sorted(found, key=lambda cell: (cell.noise, cell.rate)))

    def standing_of(self, estimator: str) -> Standing:
        """Return the standing of an estimator that was fitted."""
        return next(row for row in self.standings if row.estimator == estimator)
