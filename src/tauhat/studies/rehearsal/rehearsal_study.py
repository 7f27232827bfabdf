"""How long a motion and how good sensors must be for an error: the whole way on simulated robots, many times."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from tauhat.dynamics.model import known_terms
from tauhat.errors import ModelError
from tauhat.estimation.estimators import estimator_named
from tauhat.excitation.design import Design
from tauhat.excitation.limits import motion_limits
from tauhat.excitation.point_to_point import PointToPoint, point_to_point
from tauhat.excitation.repeated import Repeated
from tauhat.excitation.trajectory import Trajectory
from tauhat.robots.robot import Robot
from tauhat.simulation.planned_experiment import MotionPlan, PlannedExperiment
from tauhat.simulation.sensors import PRESETS, sensor_preset
from tauhat.studies.rehearsal.chapters import chapters_of, summary_of
from tauhat.studies.rehearsal.findings import Findings
from tauhat.studies.rehearsal.trials import NamedSensors, Outcome, Trial, rehearsed
from tauhat.studies.study import Study, StudyResult
from tauhat.workers import Workers

_UNSEEN_SECONDS = 10.0  # at least, of the motion that is verified on
_MOST_POSES = 50  # of it
_MARGIN = 0.05  # of the joint limits that it leaves unused


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RehearsalStudy(Study):
    """Describe, excite, simulate, identify and verify, for every length of motion, kind of sensors and true robot.

    experiment : what is rehearsed
    lengths : of the motion [s]; the experiment's own where it is empty
    sensors : the worst first; the experiment's own where it is empty
    seeds : true robots
    target : error that is wanted, as a fraction of the torque; None to look on without
    terms, estimator : of the models
    """

    key: ClassVar[str] = "rehearsal"
    title: ClassVar[str] = "Rehearsal of an identification"
    experiment: PlannedExperiment
    lengths: tuple[float, ...] = ()
    sensors: tuple[NamedSensors, ...] = ()
    seeds: int = 20
    target: float | None = None
    terms: str = "robust"
    estimator: str = "wls"

    def __post_init__(self) -> None:
        if self.seeds < 1:
            raise ModelError("rehearsal: robots", expected="at least 1", got=self.seeds)
        if self.target is not None and not 0.0 < self.target < 1.0:
            raise ModelError("rehearsal: target", expected="above 0 and below 100 %", got=f"{100 * self.target:g} %")
        known_terms(self.terms)
        estimator_named(self.estimator)
        own = self.experiment.motion
        if self.lengths and own.given is not None and set(self.lengths) != {own.duration}:
            raise ModelError("rehearsal: a given motion has one length", got=self.lengths)
        lengths = tuple(sorted(set(self.lengths))) or (own.duration,)
        own_sensors = NamedSensors(name=self.experiment.sensors, errors=self.experiment.settings.sensors)
        object.__setattr__(self, "lengths", lengths)
        object.__setattr__(self, "sensors", tuple(self.sensors) or (own_sensors,))
        names = [sensors.name for sensors in self.sensors]
        if len(set(names)) < len(names):
            raise ModelError("rehearsal: sensors", expected="none twice", got=", ".join(names))
        for plan in self._plans():
            replace(self.experiment, motion=plan)  # refuses a log that is absurdly long

    def run(self, workers: Workers, *, tell: Callable[[str], None] = lambda _: None) -> StudyResult:
        """Return the errors over length and sensors, and what they cost least for the target.

        Raises
        ------
        ExcitationError, RobotError
            when no motion can be designed.
        """
        found = self.findings(workers, tell=tell)
        return StudyResult(
            name=self.key,
            title=f"{self.title}: {self.experiment.robot.name}",
            summary=summary_of(found),
            chapters=chapters_of(found),
            settings=self._described(),
        )

    def findings(self, workers: Workers, *, tell: Callable[[str], None] = lambda _: None) -> Findings:
        """Return what happened to every robot; errors as `run`."""
        designs = self._designs(tell)
        trials = self._trials(designs)
        outcomes: list[Outcome] = []
        for number, found in enumerate(workers.map(rehearsed, trials), start=1):
            outcomes += found
            tell(f"{number} of {len(trials)} robots")
        return Findings(
            experiment=self.experiment,
            designs=designs,
            sensors=self.sensors,
            outcomes=tuple(outcomes),
            terms=self.terms,
            estimator=self.estimator,
            unseen=f"{trials[0].unseen.duration:.3g} s of motion from random pose to random pose",
            target=self.target,
        )

    def _plans(self) -> Iterator[MotionPlan]:
        for seconds in self.lengths:
            own = self.experiment.motion
            yield own if own.given is not None else replace(own, seconds=seconds)

    def _designs(self, tell: Callable[[str], None]) -> dict[float, Design]:
        """Return the designs by the length of their period, each made once."""
        designs: dict[float, Design] = {}
        for plan in self._plans():
            if plan.given is None and plan.kind == "designed" and plan.period not in designs:
                rng = np.random.default_rng(self.experiment.seed)
                found = plan.designed(self.experiment.robot, rng)
                designs[plan.period] = found
                tell(f"a motion of {plan.period:g} s with condition number {found.condition:.3g}")
        return designs

    def _trials(self, designs: dict[float, Design]) -> tuple[Trial, ...]:
        rng = np.random.default_rng([self.experiment.seed, 1])
        robot = self.experiment.robot
        unseen = unseen_motion(robot, rng)
        motions = tuple(self._motion(plan, designs, rng) for plan in self._plans())
        # Limits have done their work, and need not travel to the workers.
        experiment = replace(self.experiment, motion=MotionPlan())
        return tuple(
            Trial(
                experiment=experiment,
                motions=motions,
                unseen=unseen,
                sensors=self.sensors,
                terms=self.terms,
                estimator=self.estimator,
                seed=seed,
            )
            for seed in range(self.seeds)
        )

    def _motion(self, plan: MotionPlan, designs: dict[float, Design], rng: np.random.Generator) -> Trajectory:
        if plan.given is not None or plan.kind == "random":
            return plan.trajectory(self.experiment.robot, rng)
        return Repeated(series=designs[plan.period].trajectory, periods=plan.periods)

    def _described(self) -> dict[str, Any]:
        """Return the settings as plain data."""
        experiment = self.experiment
        return {
            "robot": experiment.robot.name,
            "seeds": self.seeds,
            "target": None if self.target is None else 100.0 * self.target,
            "lengths": list(self.lengths),
            "sensors": [sensors.name for sensors in self.sensors],
            "model": self.terms,
            "estimator": self.estimator,
            "spread": experiment.spread,
            "friction": experiment.friction,
            "rate": experiment.settings.sample_rate,
            "seed": experiment.seed,
            "robot_seed": experiment.robot_seed,
        }


def unseen_motion(robot: Robot, rng: np.random.Generator) -> PointToPoint:
    """Return a motion of another kind than those that identify: from pose to pose as fast as the limits allow."""
    limits = motion_limits(robot, margin=_MARGIN)
    poses = limits.lower + rng.uniform(size=(_MOST_POSES, robot.n_v)) * (limits.upper - limits.lower)
    ways = int(np.searchsorted(np.cumsum(point_to_point(poses, limits).times), _UNSEEN_SECONDS)) + 1
    return point_to_point(poses[: ways + 1], limits)


def sensors_named(
    names: tuple[str, ...], scales: tuple[float, ...], experiment: PlannedExperiment
) -> tuple[NamedSensors, ...]:
    """Return typical sensors, and the experiment's own where no name is given, each as bad as every scale says.

    The worst come first: in the order of the presets, and with each the largest scale.

    Raises
    ------
    SimulationError
        when a name is unknown, a scale negative, or the robot states no largest torque.
    """
    known = list(PRESETS)
    ordered = sorted(dict.fromkeys(names), key=lambda name: known.index(name) if name in known else 0)
    bases = [NamedSensors(name=name, errors=sensor_preset(name, experiment.robot)) for name in ordered]
    bases = bases or [NamedSensors(name=experiment.sensors, errors=experiment.settings.sensors)]
    return tuple(
        NamedSensors(name=base.name if scale == 1.0 else f"{base.name} x {scale:g}", errors=base.errors.scaled(scale))
        for base in bases
        for scale in sorted(set(scales), reverse=True)
    )
