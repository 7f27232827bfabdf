"""How well forces are sensed without a sensor: known pushes on simulated arms, by every observer, cold and warm."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from typing import ClassVar

from tauhat.dynamics.model import known_terms
from tauhat.errors import ModelError
from tauhat.robots.library import load_robot
from tauhat.sensing.wrench import directions_named
from tauhat.studies.force_sensing.chapters import chapters_of, summary_of
from tauhat.studies.force_sensing.findings import Findings
from tauhat.studies.force_sensing.scene import SceneSettings
from tauhat.studies.force_sensing.trials import Outcome, Trial, tried
from tauhat.studies.study import Study, StudyResult, require_arms
from tauhat.workers import Workers


@dataclass(frozen=True, slots=True, kw_only=True)
class ForceSensingStudy(Study):
    """Settings of the study.

    seeds : random arms
    first_seed : of the first of them
    robot : a built-in name or a file; that of the scene where empty
    scene : what an arm is like and what it does
    terms : of the model without warmth
    directions : that the wrench is solved for
    """

    key: ClassVar[str] = "force-sensing"
    title: ClassVar[str] = "The virtual force sensor against known forces"
    takes: ClassVar[tuple[str, ...]] = ("seeds", "robot")
    seeds: int = 10
    first_seed: int = 0
    robot: str = ""
    scene: SceneSettings = field(default_factory=SceneSettings)
    terms: str = "robust"
    directions: str = "force"

    def __post_init__(self) -> None:
        require_arms(self.key, self.seeds)
        known_terms(self.terms)
        directions_named(self.directions)
        if self.robot:
            object.__setattr__(self, "scene", replace(self.scene, robot=self.robot))
        if load_robot(self.scene.robot).n_v != len(self.scene.middle):
            raise ModelError("poses of the work", where=self.key, expected=f"{len(self.scene.middle)} joints")

    def run(self, workers: Workers, *, tell: Callable[[str], None] = lambda _: None) -> StudyResult:
        """Return the errors of all observers, their error bars, and what warmth does."""
        found = self.found(workers, tell=tell)
        return StudyResult(
            name=self.key,
            title=f"{self.title}: {self.scene.robot}",
            summary=summary_of(found),
            chapters=chapters_of(found),
            settings={"seeds": self.seeds, "terms": self.terms, "directions": self.directions, **asdict(self.scene)},
        )

    def found(self, workers: Workers, *, tell: Callable[[str], None] = lambda _: None) -> Findings:
        """Return what the chapters are written from."""
        trials = [
            Trial(scene=self.scene, seed=self.first_seed + seed, terms=self.terms, directions=self.directions)
            for seed in range(self.seeds)
        ]
        outcomes: list[Outcome] = []
        for number, found in enumerate(workers.map(tried, trials), start=1):
            outcomes += found
            tell(f"{number} of {len(trials)} arms")
        return Findings(scene=self.scene, outcomes=tuple(outcomes))
