"""Whether a model fitted where the work is predicts torque better there, and what it costs elsewhere.

Random arms with effects that the model does not know do a polishing path, run programs of via-points designed for the
region around it, and a Fourier motion in the whole room. Models fitted to the one, the other or both are judged on the
path, warm and cold, and elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field, replace
from typing import Any, ClassVar

import numpy as np

from tauhat.dynamics.model import known_terms
from tauhat.errors import ModelError
from tauhat.estimation.estimators import estimator_named
from tauhat.excitation.genetic import GeneticSettings
from tauhat.excitation.task_design import one_stage, two_stages
from tauhat.robots.library import load_robot
from tauhat.studies.local_global.arms import Arm, ArmFigures, Plant, figures_of
from tauhat.studies.local_global.chapters import error_chapter, friction_chapter, scene_chapter, stages_chapter
from tauhat.studies.local_global.conclusions import conclusions, summary
from tauhat.studies.local_global.findings import FITS, Findings, blocks_of_fit
from tauhat.studies.local_global.motions import Designs, Motions, designed
from tauhat.studies.local_global.task import Polishing
from tauhat.studies.study import Chapter, Study, StudyResult, require_arms
from tauhat.workers import Workers

_TOLD = 5  # how often a run says how far it is


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalGlobalStudy(Study):
    """Settings of the study.

    robot : a built-in name or a file
    seeds : random arms
    first_seed : of the first of them
    work : the path that models are for
    designs : of the motions to identify from
    plant : what the arms have and the model does not know
    also : other kinds of friction that the same arms are tried with
    seconds : of the motion elsewhere, about [s]
    terms, estimator : of all models
    cutoff : low-pass of all fits and judgements [Hz]
    """

    key: ClassVar[str] = "local-global"
    title: ClassVar[str] = "Local against global calibration"
    takes: ClassVar[tuple[str, ...]] = ("seeds", "robot")
    robot: str = "ur5e"
    seeds: int = 10
    first_seed: int = 0
    work: Polishing = field(default_factory=Polishing)
    designs: Designs = field(default_factory=Designs)
    plant: Plant = field(default_factory=Plant)
    also: tuple[str, ...] = ("plain",)
    seconds: float = 25.0
    terms: str = "plain"
    estimator: str = "wls"
    cutoff: float = 10.0

    def __post_init__(self) -> None:
        require_arms(self.key, self.seeds)
        for name in ("seconds", "cutoff"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise ModelError(f"setting {name}", where=self.key, expected="above zero", got=getattr(self, name))
        known_terms(self.terms)
        estimator_named(self.estimator)

    @classmethod
    def quick(cls) -> LocalGlobalStudy:
        """Return settings of a few seconds: short motions, a small search, two arms."""
        designs = Designs(
            stages=two_stages(points=3, seconds=3.0),
            whole=one_stage(points=5, seconds=6.0),
            genetic=GeneticSettings(population=8, generations=2),
            islands=1,
            starts=1,
            harmonics=2,
        )
        return cls(
            seeds=2, work=Polishing(length=0.06, passes=2, spacing=0.02), designs=designs, seconds=2.0,
            plant=Plant(gap=0.0, timestep=5e-4), also=(), terms="inertia,rotor,viscous,offset",
        )  # fmt: skip

    def run(self, workers: Workers, *, tell: Callable[[str], None] = lambda _: None) -> StudyResult:
        """Return what local and global models are worth.

        Raises
        ------
        ModelError, RobotError, ExcitationError
            when the robot is unknown, there is no surface below it, or no motion can be designed.
        MissingExtraError
            when pymoo, which searches the programs, is not installed.
        """
        found = self.found(workers, tell=tell)
        return StudyResult(
            name=self.key,
            title=f"{self.title}: {found.robot.name}",
            summary=summary(found),
            chapters=self.chapters(found),
            settings=self.described(),
        )

    def found(self, workers: Workers, *, tell: Callable[[str], None] = lambda _: None) -> Findings:
        """Return what the chapters are written from; errors as `run`."""
        arms = self.arms(self.motions(workers, tell=tell))
        done = list(_heard(workers.map(figures_of, arms), len(arms), tell))
        kinds = (self.plant.friction, *self.also)
        of_kind = {kind: tuple(done[place :: len(kinds)]) for place, kind in enumerate(kinds)}
        motions = arms[0].motions
        return Findings(
            robot=arms[0].robot, work=self.work, motions=motions, frictions=kinds, arms=of_kind,
            blocks={fit: blocks_of_fit(motions, fit) for fit in FITS},
        )  # fmt: skip

    def motions(self, workers: Workers, *, tell: Callable[[str], None] = lambda _: None) -> Motions:
        """Return the motions, which are the same for all arms; errors as `run`."""
        robot = load_robot(self.robot)
        return designed(robot, self.work, self.designs, terms=self.terms, workers=workers, tell=tell)

    def arms(self, motions: Motions) -> list[Arm]:
        """Return the work on all arms, those of one seed beside each other: one for each kind of friction."""
        robot = load_robot(self.robot)
        plants = [replace(self.plant, friction=kind) for kind in (self.plant.friction, *self.also)]
        return [
            Arm(
                robot=robot, plant=plant, motions=motions, seed=self.first_seed + seed, seconds=self.seconds,
                terms=self.terms, estimator=self.estimator, cutoff=self.cutoff,
            )
            for seed in range(self.seeds)
            for plant in plants
        ]  # fmt: skip

    def chapters(self, found: Findings) -> tuple[Chapter, ...]:
        """Return the story of what was found."""
        others = (friction_chapter(found),) if self.also else ()
        return (
            scene_chapter(found, self.plant, self.terms),
            error_chapter(found),
            stages_chapter(found),
            *others,
            conclusions(found),
        )

    def described(self) -> dict[str, Any]:
        """Return the settings as plain data, stages by their names."""
        described = asdict(self)
        for name in ("stages", "whole"):
            described["designs"][name] = {stage["name"]: stage for stage in described["designs"][name]}
        return described


def _heard(results: Iterator[ArmFigures], count: int, tell: Callable[[str], None]) -> Iterator[ArmFigures]:
    """Yield the results and tell now and then how many there are."""
    every = max(1, count // _TOLD)
    for number, result in enumerate(results, start=1):
        if number % every == 0 or number == count:
            tell(f"{number} of {count} arms")
        yield result
