"""Task-oriented calibration: programs of via-points in the region of the work, designed stage by stage."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.dynamics.model import PLAIN_TERMS, torque_model
from tauhat.errors import ExcitationError
from tauhat.excitation.criteria import Criterion, Mixed
from tauhat.excitation.genetic import GeneticSettings
from tauhat.excitation.information import Information, information, with_exact_sign, with_smooth_sign
from tauhat.excitation.limits import LimitSet, MotionLimits
from tauhat.excitation.task_design.blocks import Blocks, blocks_of
from tauhat.excitation.task_design.found import StageDesign, TaskDesign
from tauhat.excitation.task_design.program import ProgramSpace
from tauhat.excitation.task_design.reach import Reach, reach_of
from tauhat.excitation.task_design.regions import TaskRegion
from tauhat.excitation.task_design.search import FINE, Island, StageSearch, is_allowed, sampled
from tauhat.excitation.task_design.stages import TaskStage, two_stages
from tauhat.excitation.waypoints.motion import WaypointMotion
from tauhat.excitation.waypoints.moves import ToolLimits
from tauhat.excitation.waypoints.ramps import AccelerationLimited, JerkLimited
from tauhat.excitation.waypoints.settings import WaypointSettings
from tauhat.robots.robot import Robot
from tauhat.workers import LocalWorkers, Workers

USUAL_SEARCH = GeneticSettings(population=40, generations=40)
Telling = Callable[[str], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskSettings:
    """Where the work is and how programs for it are searched for.

    region : where the tool works
    home : (n_v,) where every program begins and ends; its configuration of the arm is kept [rad or m]
    frame : the tool's; the robot's last where not stated
    stages : one after the other, each for what those before leave uncertain
    limits : of joints and of several joints at once; the robot's own where not stated. With jerk, ramps keep it
    tool : what line moves may ask of the tool
    margin : part of every limit that is left unused
    criterion : what is minimised, of the information on a stage's columns
    genetic : size of each population
    islands : populations that evolve side by side; they share nothing but the end
    """

    region: TaskRegion
    home: FloatArray
    frame: str | None = None
    stages: tuple[TaskStage, ...] = field(default_factory=two_stages)
    limits: LimitSet | None = None
    tool: ToolLimits = field(default_factory=ToolLimits)
    margin: float = 0.05
    criterion: Criterion = field(default_factory=Mixed)
    genetic: GeneticSettings = USUAL_SEARCH
    islands: int = 2

    def __post_init__(self) -> None:
        object.__setattr__(self, "home", frozen("home", self.home, (None,), where="task"))
        object.__setattr__(self, "stages", tuple(self.stages))
        names = [stage.name for stage in self.stages]
        if not names or len(set(names)) < len(names):
            raise ExcitationError("stages of a task", expected="one or more, no name twice", got=", ".join(names))
        if self.islands < 1:
            raise ExcitationError("populations of a search", expected="at least 1", got=self.islands)


def design_task(
    robot: Robot,
    settings: TaskSettings,
    *,
    rng: np.random.Generator,
    terms: str | Iterable[str] = PLAIN_TERMS,
    workers: Workers | None = None,
    tell: Telling | None = None,
) -> TaskDesign:
    """Return programs of via-points in a region that identify the model where the work is.

    Each stage is searched for genetically through the planner of `waypoint_motion`, and judged by what it adds to the
    information on its own columns while all other columns are unknown.

    Parameters
    ----------
    terms : of the torque model whose columns count
    workers : where the populations evolve; on all cores by default
    tell : called with the name of each stage before it is searched for

    Raises
    ------
    ExcitationError
        when the region is not reached, a stage has no columns, or no program keeps its limits: names the stage.
    MissingExtraError
        when pymoo, or for bounded jerk Ruckig, is not installed.
    """
    limits = settings.limits or LimitSet(robot=robot)
    limits.check_robot(robot)
    frame = planning_of(limits, settings).tool_frame(limits.robot)
    reach = reach_of(
        limits.robot, settings.region, home=settings.home, frame=frame, limits=limits.of_joints(margin=settings.margin)
    )
    facts = information(torque_model(limits.robot, terms))
    task = _Task(settings=settings, limits=limits, reach=reach, facts=facts, blocks=blocks_of(facts))
    found: list[StageDesign] = []
    for stage in settings.stages:
        if tell is not None:
            tell(stage.name)
        found.append(task.designed(stage, found, rng=rng, workers=workers or LocalWorkers()))
    return TaskDesign(
        stages=tuple(found),
        facts=with_settled_sign(facts),
        blocks=task.blocks,
        region=settings.region,
        reached=reach.share,
    )


def planning_of(limits: LimitSet, settings: TaskSettings) -> WaypointSettings:
    """Return how programs are planned: inside the limits drawn in by the margin, from home to home."""
    of_joints = limits.of_joints(margin=settings.margin)
    ramps = AccelerationLimited() if of_joints.jerk is None else JerkLimited()
    return WaypointSettings(limits=of_joints, tool=settings.tool, ramps=ramps, frame=settings.frame, ending="return")


def with_settled_sign(facts: Information) -> Information:
    """Return the same columns with the exact sign of the speed, by which figures are told."""
    return replace(facts, model=with_exact_sign(facts.model))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Task:
    settings: TaskSettings
    limits: LimitSet
    reach: Reach
    facts: Information
    blocks: Blocks

    def designed(
        self, stage: TaskStage, before: list[StageDesign], *, rng: np.random.Generator, workers: Workers
    ) -> StageDesign:
        """Return the program of a stage, given those of the stages before."""
        began, settings = time.perf_counter(), self.settings
        search = self._search(stage, before)
        island = Island(search, settings.genetic)
        seeds = [int(seed) for seed in rng.integers(2**31, size=settings.islands)]
        islands = list(workers.map(island, seeds))
        genes = np.concatenate([best for best, _ in islands])
        values = np.concatenate([least for _, least in islands])
        motion = self._allowed(search, genes[np.argsort(values, kind="stable")], np.sort(values, kind="stable"))
        return StageDesign(
            stage=stage,
            motion=motion,
            information=with_settled_sign(self.facts).matrix(sampled(motion, FINE)),
            evaluations=settings.islands * settings.genetic.population * settings.genetic.generations,
            seconds=time.perf_counter() - began,
            margins={limit.name: search.room(sampled(motion, FINE), limit) for limit in self.limits.others},
        )  # fmt: skip

    def _search(self, stage: TaskStage, before: list[StageDesign]) -> StageSearch:
        weights = {each.name: each.weight * each.seconds for each in self.settings.stages}
        whole = sum(weights.values())
        known = np.zeros((self.facts.n, self.facts.n))
        for found in before:
            known += found.stage.weight * found.recorded / whole * found.information
        counted = self.blocks.of(stage.counted)
        if not counted.size:
            raise ExcitationError(
                "a stage without columns", where=f"stage {stage.name}", got=f"no column of {', '.join(stage.counted)}",
                remedy="another model, or other columns",
            )  # fmt: skip
        smooth = replace(self.facts, model=with_smooth_sign(self.facts.model, self._joint_limits()))
        space = ProgramSpace(stage=stage, reach=self.reach, planning=planning_of(self.limits, self.settings))
        return StageSearch(
            space=space, facts=smooth, known=known, share=weights[stage.name] / whole, counted=counted,
            criterion=self.settings.criterion, others=self.limits.others, margin=self.settings.margin,
        )  # fmt: skip

    def _joint_limits(self) -> MotionLimits:
        return self.limits.of_joints(margin=self.settings.margin)

    def _allowed(self, search: StageSearch, genes: FloatArray, values: FloatArray) -> WaypointMotion:
        """Return the motion of the best program that keeps its limits on the fine grid, too."""
        for row, value in zip(genes, values, strict=True):
            if not is_allowed(value):
                break
            motion = search.space.motion(row)
            fine = sampled(motion, FINE)
            if all(search.room(fine, limit) >= 0.0 for limit in search.others):
                return motion
        raise search.refusal(genes[0])
