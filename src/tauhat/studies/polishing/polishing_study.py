"""How well a polishing loop holds its force on the virtual sensor, from calibration to force."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from typing import ClassVar

from tauhat.errors import ModelError
from tauhat.excitation.trajectory import Trajectory
from tauhat.robots.library import load_robot
from tauhat.simulation.contact.cell import Cell
from tauhat.studies.polishing import chapters
from tauhat.studies.polishing.accidents import Accidents, all_met
from tauhat.studies.polishing.arm import ArmSettings
from tauhat.studies.polishing.findings import Findings
from tauhat.studies.polishing.incident_chapter import incident_chapter
from tauhat.studies.polishing.meeting import Met
from tauhat.studies.polishing.motions import MotionSettings, over_and_over, where_the_work_is, whole_room
from tauhat.studies.polishing.shift import ShiftSettings, ShiftTrial, Worked, shift_of
from tauhat.studies.polishing.trials import Drawn, Outcome, Trial, tried
from tauhat.studies.polishing.truth import DIFFICULTIES, Difficulty
from tauhat.studies.polishing.work import postures_of
from tauhat.studies.study import Study, StudyResult
from tauhat.workers import Workers


@dataclass(frozen=True, slots=True, kw_only=True)
class PolishingStudy(Study):
    """Settings of the study.

    seeds : random arms of each difficulty
    first_seed : of the first of them; those below ten were looked at while the study was made
    robot : a built-in name with places for a workpiece
    arm : what arms are like and what they do
    motions : of the calibration
    difficulties : of the arms
    shift : how long a shift is, and what is done in it
    shifts : arms that work one
    local : arms that are calibrated where the work is, too
    accidents : arms with which everything goes wrong
    """

    key: ClassVar[str] = "polishing"
    title: ClassVar[str] = "Polishing on the virtual force sensor"
    takes: ClassVar[tuple[str, ...]] = ("seeds", "robot")
    seeds: int = 10
    first_seed: int = 10
    robot: str = ""
    arm: ArmSettings = field(default_factory=ArmSettings)
    motions: MotionSettings = field(default_factory=MotionSettings)
    difficulties: tuple[Difficulty, ...] = DIFFICULTIES
    shift: ShiftSettings = field(default_factory=ShiftSettings)
    shifts: int = 2
    local: int = 6
    accidents: int = 1

    def __post_init__(self) -> None:
        if self.seeds < 1 or not self.difficulties:
            raise ModelError("arms of the study", where=self.key, expected="1 seed or more", got=self.seeds)
        if self.robot:
            object.__setattr__(self, "arm", replace(self.arm, robot=self.robot))
        postures_of(load_robot(self.arm.robot))

    def run(self, workers: Workers, *, tell: Callable[[str], None] = lambda _: None) -> StudyResult:
        """Return the force of all jobs, by what the polisher reads."""
        found = self.found(workers, tell=tell)
        told = [chapters.scene_chapter(found), chapters.force_chapter(found), chapters.drawn_chapter(found)]
        told += [chapters.shapes_chapter(found), chapters.others_chapter(found)]
        told += [chapters.local_chapter(found)] if self.local else []
        told += [chapters.shift_chapter(found, self.shift.hours)] if self.shifts else []
        told += [incident_chapter(found.met)] if self.accidents else []
        return StudyResult(
            name=self.key, title=f"{self.title}: {self.arm.robot}", summary=chapters.summary_of(found),
            chapters=tuple(told), settings={"seeds": self.seeds, **asdict(self.arm)},
        )  # fmt: skip

    def found(self, workers: Workers, *, tell: Callable[[str], None] = lambda _: None) -> Findings:
        """Return what the chapters are written from."""
        robot, seconds = load_robot(self.arm.robot), self.arm.calibration.seconds
        tell("designing the calibration")
        terms = self.arm.calibration.textbook
        motion = whole_room(robot, self.motions, terms=terms, seconds=seconds)
        near = self._near(workers) if self.local else None
        trials = self._trials(motion, near)
        outcomes: list[Outcome] = []
        drawn: list[Drawn] = []
        for number, (found, shown) in enumerate(workers.map(tried, trials), start=1):
            outcomes += found
            drawn += shown
            tell(f"{number} of {len(trials)} arms")
        return Findings(
            arm=self.arm, outcomes=tuple(outcomes), worked=self._worked(workers, motion, tell),
            met=self._met(workers, motion, tell), drawn=tuple(drawn),
        )  # fmt: skip

    def _trials(self, motion: Trajectory, near: Trajectory | None) -> list[Trial]:
        return [
            Trial(
                settings=self.arm, seed=self.first_seed + seed, difficulty=difficulty, motion=motion,
                near=near if difficulty == "easy" and seed < self.local else None,
                draw=difficulty == "easy" and seed == 0,
            )
            for difficulty in self.difficulties
            for seed in range(self.seeds)
        ]  # fmt: skip

    def _near(self, workers: Workers) -> Trajectory:
        robot = Cell(robot=load_robot(self.arm.robot), tool=self.arm.tool).robot_with_tip
        terms = self.arm.calibration.textbook
        posture = postures_of(robot)[0]
        once = where_the_work_is(robot, self.arm.work, posture, self.motions, terms=terms, workers=workers)
        return over_and_over(once, self.arm.calibration.seconds)

    def _worked(self, workers: Workers, motion: Trajectory, tell: Callable[[str], None]) -> tuple[Worked, ...]:
        trials = [
            ShiftTrial(settings=self.arm, shift=self.shift, seed=self.first_seed + seed, motion=motion)
            for seed in range(self.shifts)
        ]
        worked: list[Worked] = []
        for number, found in enumerate(workers.map(shift_of, trials), start=1):
            worked += found
            tell(f"{number} of {len(trials)} shifts")
        return tuple(worked)

    def _met(self, workers: Workers, motion: Trajectory, tell: Callable[[str], None]) -> tuple[Met, ...]:
        seeds = range(self.first_seed, self.first_seed + self.accidents)
        trials = [Accidents(settings=self.arm, seed=seed, motion=motion) for seed in seeds]
        met: list[Met] = []
        for number, found in enumerate(workers.map(all_met, trials), start=1):
            met += found
            tell(f"incidents of {number} of {len(trials)} arms")
        return tuple(met)
