"""Which cause makes which share of the error of a rehearsed experiment: motions, robots, budget, page."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from tauhat.dynamics.model import known_terms
from tauhat.errors import ModelError
from tauhat.estimation.estimators import estimator_named
from tauhat.simulation.planned_experiment import PlannedExperiment
from tauhat.studies.error_budget.chapters import chapters_of, summary_of
from tauhat.studies.rehearsal.rehearsal_study import unseen_motion
from tauhat.studies.study import Study, StudyResult
from tauhat.verification.error_budget import BudgetMotions, BudgetSettings, ErrorBudget, error_budget
from tauhat.workers import Workers

_FURTHER, _UNSEEN = 1, 2  # streams of random numbers beside those of the fitted motion


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ErrorBudgetStudy(Study):
    """Identify and verify on simulated robots with each cause of error switched off alone, and on alone.

    experiment : what is rehearsed
    seeds : true robots
    terms, estimator : of the models
    warmer : how much warmer the joints are on the unseen motion, where the experiment has heat [K]
    """

    key: ClassVar[str] = "error-budget"
    title: ClassVar[str] = "Error budget"
    experiment: PlannedExperiment
    seeds: int = 5
    terms: str = "robust"
    estimator: str = "wls"
    warmer: float = 10.0

    def __post_init__(self) -> None:
        if self.seeds < 1:
            raise ModelError("error budget: robots", expected="at least 1", got=self.seeds)
        known_terms(self.terms)
        estimator_named(self.estimator)

    def run(self, workers: Workers, *, tell: Callable[[str], None] = lambda _: None) -> StudyResult:
        """Return the ranked causes with what to do about each.

        Raises
        ------
        ExcitationError, RobotError
            when no motion can be designed.
        ModelError
            when no robot gives all its models.
        """
        return self.result(*self.budget(workers, tell=tell))

    def budget(
        self, workers: Workers, *, tell: Callable[[str], None] = lambda _: None
    ) -> tuple[BudgetSettings, ErrorBudget]:
        """Return what the budget was made of, and the budget; errors as `run`."""
        tell("motions")
        settings = BudgetSettings(
            experiment=self.experiment,
            motions=self._motions(),
            terms=self.terms,
            estimator=self.estimator,
            seeds=self.seeds,
            warmer=self.warmer,
        )
        return settings, error_budget(settings, workers, tell=tell)

    def result(self, settings: BudgetSettings, budget: ErrorBudget) -> StudyResult:
        """Return the text, tables and drawing of a budget."""
        return StudyResult(
            name=self.key,
            title=f"{self.title}: {self.experiment.robot.name}",
            summary=summary_of(settings, budget),
            chapters=chapters_of(settings, budget),
            settings=self._described(settings),
        )

    def _motions(self) -> BudgetMotions:
        """Return the experiment's motion, a designed one of the same length, and one from pose to pose."""
        plan, robot, seed = self.experiment.motion, self.experiment.robot, self.experiment.seed
        another = replace(plan, given=None, kind="designed", seconds=plan.duration)
        return BudgetMotions(
            fitted=plan.trajectory(robot, np.random.default_rng(seed)),
            further=another.trajectory(robot, np.random.default_rng([seed, _FURTHER])),
            unseen=unseen_motion(robot, np.random.default_rng([seed, _UNSEEN])),
        )

    def _described(self, settings: BudgetSettings) -> dict[str, Any]:
        """Return the settings as plain data."""
        experiment = self.experiment
        return {
            "robot": experiment.robot.name,
            "seeds": self.seeds,
            "seconds": settings.motions.fitted.duration,
            "sensors": experiment.sensors,
            "model": self.terms,
            "estimator": self.estimator,
            "spread": experiment.spread,
            "friction": experiment.friction,
            "warmer": self.warmer,
            "rate": experiment.settings.sample_rate,
            "seed": experiment.seed,
            "robot_seed": experiment.robot_seed,
        }
