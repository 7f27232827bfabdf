"""Robust least squares on a CRS A465: which method survives which noise, and what a simplified model costs.

The arms' torque is the library's own regressor times true parameters, so that the truth of every parameter is known and
hundreds of fits take a minute; one chapter asks the same of arms that a controller moves in MuJoCo. Compared are
ordinary, weighted and iteratively reweighted least squares, each with the full model and with the one without products
of inertia, on logs with equal noise, unequal noise, and gross errors.

Source: Gautier, Khalil, "Direct calculation of minimum set of inertial parameters of serial robots", 1990 (base
parameters); Maes, Samin, Willems, "Linearity of multibody systems with respect to barycentric parameters", 1989;
Huber, Ronchetti, "Robust statistics", 2009 (reweighting).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from typing import ClassVar, TypeAlias

import numpy as np

from tauhat.blas import single_threaded
from tauhat.errors import ModelError
from tauhat.studies.crs_a465.chapters import (
    arm_chapter,
    interval_chapter,
    length_chapter,
    parameter_chapter,
    plant_chapter,
    torque_chapter,
)
from tauhat.studies.crs_a465.conclusions import conclusions, summary
from tauhat.studies.crs_a465.experiment import Experiment
from tauhat.studies.crs_a465.findings import Findings
from tauhat.studies.crs_a465.fits import ArmFigures, ArmPiece, Case
from tauhat.studies.crs_a465.plant import PlantFit, PlantPiece
from tauhat.studies.study import Chapter, Study, StudyResult
from tauhat.workers import Workers

Piece: TypeAlias = ArmPiece | PlantPiece
_SEEDS_A_PLANT = 10  # an arm in MuJoCo takes about ten times as long as one without
_TOLD = 5  # how often a run says how far it is


@dataclass(frozen=True, slots=True, kw_only=True)
class CrsA465Study(Study):
    """Settings of the study.

    seeds : random arms whose torque is the model's
    plants : random arms that MuJoCo moves; one for every ten seeds by default, and 0 leaves their chapter out
    lengths : of the fitted logs that the models are compared on [s]
    plant_seconds : of each motion on a plant
    experiment : how arms and logs are made
    """

    key: ClassVar[str] = "crs-a465"
    title: ClassVar[str] = "Robust least squares on a CRS A465"
    seeds: int = 20
    plants: int | None = None
    lengths: tuple[float, ...] = (2.5, 5.0, 10.0, 20.0, 40.0, 80.0)
    plant_seconds: float = 10.0
    experiment: Experiment = field(default_factory=Experiment)

    def __post_init__(self) -> None:
        if self.seeds < 1 or self.n_plants < 0:
            got = f"{self.seeds} and {self.n_plants}"
            raise ModelError(
                "arms of the study", where=self.key, expected="1 seed or more, no negative plants", got=got
            )
        if not self.lengths or not (np.isfinite(self.lengths).all() and min(self.lengths) > 0.0):
            raise ModelError("lengths of the logs", where=self.key, expected="positive seconds", got=self.lengths)

    @property
    def n_plants(self) -> int:
        """Number of arms that MuJoCo moves."""
        return self.seeds // _SEEDS_A_PLANT if self.plants is None else self.plants

    def run(self, workers: Workers, *, tell: Callable[[str], None] = lambda _: None) -> StudyResult:
        """Return what the methods and models are worth on this arm."""
        # Plants take longest: begun first, they do not keep the others waiting at the end.
        pieces: list[Piece] = [
            *(PlantPiece(experiment=self.experiment, seed=k, seconds=self.plant_seconds) for k in range(self.n_plants)),
            *(ArmPiece(experiment=self.experiment, seed=k, lengths=self.lengths) for k in range(self.seeds)),
        ]
        done = list(_heard(workers.map(piece_done, pieces), len(pieces), tell))
        found = Findings(
            experiment=self.experiment,
            lengths=self.lengths,
            arms=tuple(figures for figures in done if isinstance(figures, ArmFigures)),
            plants=tuple(figures for figures in done if not isinstance(figures, ArmFigures)),
        )
        return StudyResult(
            name=self.key,
            title=self.title,
            summary=summary(found),
            chapters=self._chapters(found),
            settings=asdict(self),
        )

    def _chapters(self, found: Findings) -> tuple[Chapter, ...]:
        on_plants = (plant_chapter(found, self.plant_seconds),) if found.plants else ()
        return (
            arm_chapter(found),
            parameter_chapter(found),
            torque_chapter(found),
            length_chapter(found),
            interval_chapter(found),
            *on_plants,
            conclusions(found),
        )


@single_threaded
def piece_done(piece: Piece) -> ArmFigures | Mapping[Case, PlantFit]:
    """Return what one piece of work finds."""
    return piece.done()


def _heard(
    results: Iterator[ArmFigures | Mapping[Case, PlantFit]], count: int, tell: Callable[[str], None]
) -> Iterator[ArmFigures | Mapping[Case, PlantFit]]:
    """Yield the results and tell now and then how many there are."""
    every = max(1, count // _TOLD)
    for number, result in enumerate(results, start=1):
        if number % every == 0 or number == count:
            tell(f"{number} of {count} arms")
        yield result
