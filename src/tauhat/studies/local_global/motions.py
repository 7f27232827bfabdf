"""The motions that are compared: where the work is, in the whole room, and the work itself; none depends on a seed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ModelError
from tauhat.excitation.criteria import Criterion, Mixed
from tauhat.excitation.design import Design, DesignSettings, design
from tauhat.excitation.genetic import GeneticSettings
from tauhat.excitation.limits.joint_limits import MotionLimits, motion_limits
from tauhat.excitation.point_to_point import point_to_point
from tauhat.excitation.repeated import Repeated
from tauhat.excitation.sampled import SampledMotion, sampled_motion
from tauhat.excitation.task_design import (
    StageDesign,
    TaskDesign,
    TaskRegion,
    TaskSettings,
    TaskStage,
    design_task,
    one_stage,
    two_stages,
)
from tauhat.excitation.trajectory import Trajectory
from tauhat.robots.robot import Robot
from tauhat.studies.local_global.task import Polishing
from tauhat.workers import Workers

GLOBAL, PATH = "global", "path"
RATE = 500.0  # [Hz] of references that are given as samples
_PERIOD = 10.0  # [s] about, of the global motion
_MARGIN = 0.2  # of the joints' limits that motions elsewhere leave unused
_MOST_POSES = 60
_STREAM = 20261122  # of all random numbers of the designs
_LOCAL, _WHOLE, _SERIES = range(3)


@dataclass(frozen=True, slots=True, kw_only=True)
class Designs:
    """How the motions to identify from are designed.

    stages : of the design near the work, one after the other
    whole : the design in one stage that it is compared with, as long as all of `stages`
    genetic, islands : of the search for both
    criterion : what both minimise
    harmonics, starts : of the global motion
    margin : part of the joints' limits that all of them leave unused
    """

    stages: tuple[TaskStage, ...] = field(default_factory=two_stages)
    whole: tuple[TaskStage, ...] = field(default_factory=one_stage)
    genetic: GeneticSettings = field(default_factory=lambda: GeneticSettings(population=40, generations=40))
    islands: int = 2
    criterion: Criterion = field(default_factory=Mixed)
    harmonics: int = 5
    starts: int = 2
    margin: float = 0.05

    def __post_init__(self) -> None:
        lengths = [sum(stage.seconds for stage in stages) for stages in (self.stages, self.whole)]
        if not np.isclose(lengths[0], lengths[1]):
            raise ModelError("lengths of designs that are compared", expected="the same", got=lengths)

    @property
    def seconds(self) -> float:
        """How long each model's motions are recorded [s]."""
        return sum(stage.seconds for stage in self.stages)

    @property
    def of_series(self) -> DesignSettings:
        """How the global motion is designed: in periods of about 10 s that fill the same time."""
        period = self.seconds / max(1, round(self.seconds / _PERIOD))
        return DesignSettings(period=period, harmonics=self.harmonics, starts=self.starts, margin=self.margin)

    def near(self, region: TaskRegion, home: FloatArray, stages: tuple[TaskStage, ...]) -> TaskSettings:
        """Return how programs for a region are designed."""
        return TaskSettings(
            region=region, home=home, stages=stages, margin=self.margin, criterion=self.criterion,
            genetic=self.genetic, islands=self.islands,
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motions:
    """What the arm is asked to do.

    stages, whole : designs near the work, in several stages and in one
    series : design of one period of the global motion
    fitted : motions to identify from, by name
    path : the work
    """

    stages: TaskDesign
    whole: TaskDesign
    series: Design
    fitted: Mapping[str, Trajectory]
    path: SampledMotion

    @property
    def fits(self) -> Mapping[str, tuple[str, ...]]:
        """Names of the motions that each model is fitted to."""
        local = tuple(found.stage.name for found in self.stages.stages)
        whole = tuple(found.stage.name for found in self.whole.stages)
        return {"local": local, GLOBAL: (GLOBAL,), "both": (*local, GLOBAL), "one stage": whole}

    def seconds(self, fit: str) -> float:
        """Return how long the motions last that a model is fitted to [s]."""
        return sum(self.fitted[name].duration for name in self.fits[fit])


def designed(
    robot: Robot,
    work: Polishing,
    designs: Designs,
    *,
    terms: str,
    workers: Workers,
    tell: Callable[[str], None] = lambda _: None,
) -> Motions:
    """Return all motions that do not depend on a seed; those to identify from last equally long.

    Raises
    ------
    ExcitationError, RobotError
        when the arm does not reach the path, or no motion keeps the limits.
    """
    path = sampled_motion(work.path(robot).recording(rate=RATE))

    def near(stages: tuple[TaskStage, ...], stream: int) -> TaskDesign:
        settings = designs.near(work.region(robot), work.home_of(robot), stages)
        rng = np.random.default_rng([_STREAM, stream])
        return design_task(
            robot, settings, rng=rng, terms=terms, workers=workers, tell=lambda name: tell(f"motion {name}")
        )

    stages, whole = near(designs.stages, _LOCAL), near(designs.whole, _WHOLE)
    tell(f"motion {GLOBAL}")
    fitted: dict[str, Trajectory] = {found.stage.name: _run(found) for found in (*stages.stages, *whole.stages)}
    wanted = designs.of_series
    series = design(robot, rng=np.random.default_rng([_STREAM, _SERIES]), settings=wanted, terms=terms)
    fitted[GLOBAL] = Repeated(series=series.trajectory, periods=round(designs.seconds / wanted.period))
    return Motions(stages=stages, whole=whole, series=series, fitted=fitted, path=path)


def _run(found: StageDesign) -> SampledMotion:
    """Return the program of a stage, over and over until its time is up: all models get equally long logs."""
    whole = found.motion.recording(rate=RATE, name=found.stage.name, repeats=found.repeats + 1)
    return sampled_motion(whole.rows(0, round(found.stage.seconds * RATE) + 1))


def elsewhere(robot: Robot, seconds: float, rng: np.random.Generator) -> Trajectory:
    """Return a random motion from pose to pose in the whole room, about as long as asked."""
    limits = motion_limits(robot, margin=_MARGIN)
    poses = _poses(limits, rng)
    ways = int(np.searchsorted(np.cumsum(point_to_point(poses, limits).times), seconds)) + 1
    return point_to_point(poses[: ways + 1], limits)


def _poses(limits: MotionLimits, rng: np.random.Generator) -> FloatArray:
    return limits.lower + rng.uniform(size=(_MOST_POSES, limits.lower.size)) * (limits.upper - limits.lower)
