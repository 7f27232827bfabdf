"""How well a polishing loop holds its force on the virtual sensor, from calibration to force."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from itertools import chain
from typing import ClassVar

from tauhat.errors import ModelError
from tauhat.excitation.trajectory import Trajectory
from tauhat.robots.library import load_robot
from tauhat.simulation.contact.cell import Cell
from tauhat.studies.failures import Failures
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
from tauhat.studies.study import Chapter, Study, StudyResult, require_arms
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
        require_arms(self.key, self.seeds * len(self.difficulties))
        if self.robot:
            object.__setattr__(self, "arm", replace(self.arm, robot=self.robot))
        postures_of(load_robot(self.arm.robot))

    def run(self, workers: Workers, *, tell: Callable[[str], None] = lambda _: None) -> StudyResult:
        """Return the force of all jobs, by what the polisher reads.

        An arm, a shift or a chapter that fails is named in `failures`, and what is done stays.

        Raises
        ------
        ModelError
            when no arm comes through.
        """
        failures = Failures(tell)
        tell("designing the calibration")
        motion = self._whole_room()
        found = self._found(workers, motion, failures)
        writers: dict[str, Callable[[], Chapter]] = {
            "From calibration to force": lambda: chapters.scene_chapter(found),
            "The force that was pressed with": lambda: chapters.force_chapter(found),
            "One arm at work": lambda: chapters.drawn_chapter(found),
            "Flat and curved workpieces": lambda: chapters.shapes_chapter(found),
            "Observers and solves": lambda: chapters.others_chapter(found),
        }
        if self.local:
            writers["Local and global calibration"] = lambda: chapters.local_chapter(found)
        if self.shifts:
            writers["A shift"] = lambda: chapters.shift_chapter(
                self._worked(workers, motion, failures), self.shift.hours
            )
        if self.accidents:
            writers["When something goes wrong"] = lambda: incident_chapter(self._met(workers, motion, failures))
        told = tuple(failures.chapter(title, write) for title, write in writers.items())
        return StudyResult(
            name=self.key, title=f"{self.title}: {self.arm.robot}",
            summary=failures.summary(chapters.summary_of(found)), chapters=told,
            settings={"seeds": self.seeds, **asdict(self.arm)}, failures=failures.lines,
        )  # fmt: skip

    def _whole_room(self) -> Trajectory:
        calibration = self.arm.calibration
        return whole_room(
            load_robot(self.arm.robot), self.motions, terms=calibration.textbook, seconds=calibration.seconds
        )

    def _found(self, workers: Workers, motion: Trajectory, failures: Failures) -> Findings:
        """Return what most chapters are written from."""
        near = self._near(workers) if self.local else None
        outcomes: list[Outcome] = []
        drawn: list[Drawn] = []
        for found, shown in failures.results(workers, tried, self._trials(motion, near), what="arms"):
            outcomes += found
            drawn += shown
        if not outcomes:
            raise ModelError("no arm came through", where=self.key, got=failures.lines[0])
        return Findings(arm=self.arm, outcomes=tuple(outcomes), drawn=tuple(drawn))

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

    def _worked(self, workers: Workers, motion: Trajectory, failures: Failures) -> tuple[Worked, ...]:
        trials = [
            ShiftTrial(settings=self.arm, shift=self.shift, seed=self.first_seed + seed, motion=motion)
            for seed in range(self.shifts)
        ]
        return tuple(chain.from_iterable(failures.results(workers, shift_of, trials, what="shifts")))

    def _met(self, workers: Workers, motion: Trajectory, failures: Failures) -> tuple[Met, ...]:
        seeds = range(self.first_seed, self.first_seed + self.accidents)
        trials = [Accidents(settings=self.arm, seed=seed, motion=motion) for seed in seeds]
        return tuple(chain.from_iterable(failures.results(workers, all_met, trials, what="arms with incidents")))
