"""Describe, excite, simulate, identify, verify by torque and by motion, hold, load, and account for the error."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar, cast

import numpy as np

from tauhat.dynamics.model import known_terms
from tauhat.errors import ModelError, TauhatWarning
from tauhat.estimation.estimators import estimator_named
from tauhat.robots.library import load_robot
from tauhat.simulation.attached import AttachedBody
from tauhat.simulation.planned_experiment import MotionPlan, PlannedExperiment
from tauhat.studies.error_budget import ErrorBudgetStudy, typical_experiment
from tauhat.studies.gain_tuning import TunedGains
from tauhat.studies.study import Study, StudyResult
from tauhat.studies.whole_rehearsal.chapters import chapters_of
from tauhat.studies.whole_rehearsal.conclusions import summary_of
from tauhat.studies.whole_rehearsal.findings import Findings, modelled
from tauhat.studies.whole_rehearsal.proofs import Held, Proof, Tracked, Tuned, Weighed, proved
from tauhat.studies.whole_rehearsal.scene import UNSEEN, Scene, staged
from tauhat.verification.known_payload import PayloadCheck
from tauhat.verification.motion_tracking import TrackingComparison
from tauhat.verification.static import StaticCheck
from tauhat.workers import Workers

_REACH = np.array([0.03, 0.02, 0.08])  # [m] from the last joint's frame to the payload's centre


@dataclass(frozen=True, slots=True, kw_only=True)
class WholeRehearsalStudy(Study):
    """One arm rehearsed end to end on a simulated plant with typical sensors and effects.

    robot : a built-in name or a file
    seconds : of the motion that is identified from [s]
    unseen_seconds : of each motion that is verified on, about [s]
    poses : held from both sides
    trials : of the search for gains, the hand-set ones among them
    payload : mass that the robot carries on the loaded run [kg]
    seeds : true robots of the error budget
    terms, estimator : of the model
    robot_seed : of the true robot
    """

    key: ClassVar[str] = "whole-rehearsal"
    title: ClassVar[str] = "An arm rehearsed end to end"
    robot: str = "ur5e"
    seconds: float = 10.0
    unseen_seconds: float = 12.0
    poses: int = 4
    trials: int = 16
    payload: float = 2.0
    seeds: int = 2
    terms: str = "plain"
    estimator: str = "wls"
    robot_seed: int = 1

    def __post_init__(self) -> None:
        for name in ("poses", "seeds"):
            if getattr(self, name) < 1:
                raise ModelError(f"whole rehearsal: {name}", expected="at least 1", got=getattr(self, name))
        if not 1.0 <= self.unseen_seconds <= 600.0:
            raise ModelError("whole rehearsal: unseen_seconds", expected="1 to 600 s", got=self.unseen_seconds)
        known_terms(self.terms)
        estimator_named(self.estimator)

    @classmethod
    def quick(cls) -> WholeRehearsalStudy:
        """Return settings of a few seconds on a planar arm of two joints."""
        return cls(
            robot="two_link", seconds=2.5, unseen_seconds=3.0, poses=2, trials=3, payload=1.0, seeds=1
        )  # fmt: skip

    def run(self, workers: Workers, *, tell: Callable[[str], None] = lambda _: None) -> StudyResult:
        """Return the whole story with its numbers.

        Raises
        ------
        ExcitationError, RobotError
            when no motion can be designed.
        MissingExtraError
            when Optuna, which searches the gains, is not installed.
        """
        found = self.found(workers, tell=tell)
        robot = found.scene.robot.name
        return StudyResult(
            name=self.key,
            title=f"{self.title}: {robot}",
            summary=summary_of(found),
            chapters=chapters_of(found),
            settings=self._described(),
        )

    def found(self, workers: Workers, *, tell: Callable[[str], None] = lambda _: None) -> Findings:
        """Return what the chapters are written from; errors as `run`."""
        experiment = self._experiment()
        body = AttachedBody(name="payload", mass=self.payload, centre=_REACH)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", TauhatWarning)  # torque at its limit: its cost is in the errors
            tell("motions")
            scene = staged(experiment, body, unseen_seconds=self.unseen_seconds, poses=self.poses)
            tell("logs")
            fitted, unseen = scene.run("designed"), tuple(scene.run(name) for name in UNSEEN)
            tell("models")
            models = modelled(scene, fitted.recording, unseen, terms=self.terms, estimator=self.estimator)
        tell("tracking, gains, poses, payload")
        answers = tuple(workers.map(proved, self._proofs(scene, models.final)))
        tracking, tuning, static, payload = cast(
            "tuple[TrackingComparison, TunedGains, StaticCheck, PayloadCheck]", answers
        )
        tell("error budget")
        settings, budget = self._budget(experiment, scene).budget(workers, tell=tell)
        return Findings(
            scene=scene,
            fitted=fitted,
            unseen=unseen,
            models=models,
            tracking=tracking,
            tuning=tuning,
            static=static,
            payload=payload,
            budget_settings=settings,
            budget=budget,
        )

    def _experiment(self) -> PlannedExperiment:
        plan = MotionPlan(seconds=self.seconds)
        return replace(typical_experiment(load_robot(self.robot)), motion=plan, robot_seed=self.robot_seed)

    def _proofs(self, scene: Scene, estimate: Any) -> tuple[Proof, ...]:
        asked = {"scene": scene, "estimate": estimate}
        return (Tracked(**asked), Tuned(**asked, trials=self.trials), Held(**asked), Weighed(**asked))

    def _budget(self, experiment: PlannedExperiment, scene: Scene) -> ErrorBudgetStudy:
        """Return the budget of the same experiment, with the motion that is designed already."""
        given = replace(experiment, motion=MotionPlan(given=scene.motions["designed"]))
        return ErrorBudgetStudy(experiment=given, seeds=self.seeds, terms=self.terms, estimator=self.estimator)

    def _described(self) -> dict[str, Any]:
        """Return the settings as plain data."""
        return asdict(self)
