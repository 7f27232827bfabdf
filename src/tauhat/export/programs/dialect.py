"""The languages of robot controllers by name: each writes a planned motion and reads back what it wrote."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from tauhat.errors import ExportError
from tauhat.excitation.waypoints.motion import WaypointMotion
from tauhat.excitation.waypoints.settings import WaypointSettings
from tauhat.export.controller_arms import SIX_JOINTS, harmless_name, has_six_revolute_joints, kinds_of_joints
from tauhat.export.programs import fanuc, krl, rapid, urscript, viapoints
from tauhat.export.programs.cell import Cell, Leg, legs_of
from tauhat.export.programs.program import Program, ProgramSettings, ProgramText
from tauhat.export.programs.words import Words
from tauhat.robots.naming import advice_on_name
from tauhat.robots.robot import Robot

_SAME = 1e-9  # [rad or m] within which a motion that repeats has to come back


@dataclass(frozen=True, slots=True, kw_only=True)
class Dialect:
    """A language for programs of moves.

    key : its name here
    title : its name in messages
    ending : of its files
    lines : writes a program
    parse : reads it
    unsaid : what it leaves to the controller
    six_joints : whether it moves arms of six revolute joints only
    words : what it can say of a move
    """

    key: str
    title: str
    ending: str
    lines: Callable[[Cell, Sequence[Leg], Sequence[str]], Iterator[str]]
    parse: Callable[[Cell, str], Program]
    unsaid: tuple[str, ...]
    six_joints: bool = True
    words: Words = field(default_factory=Words)

    def write(self, motion: WaypointMotion, *, settings: ProgramSettings | None = None) -> ProgramText:
        """Return the program that makes a controller run a motion.

        Speeds and accelerations are those asked for, not those that the plan slowed moves to.

        Raises
        ------
        ExportError
            when the language has no word for a zone, an override or the robot: names the move.
        """
        chosen = settings or ProgramSettings()
        cell = Cell(robot=motion.robot, planned=motion.settings, settings=chosen)
        self.check_robot(motion.robot, settings=chosen)
        legs = legs_of(motion)
        away = float(np.abs(legs[-1].end - motion.start).max())
        if chosen.repeats > 1 and away > _SAME:
            remedy = "plan it with WaypointSettings(ending='return')"
            raise ExportError(
                "a motion that does not come back cannot repeat",
                where=self.title,
                got=f"{away:.3g} away from its start",
                remedy=remedy,
            )
        unsaid = (*self.unsaid, *_left_to_the_controller(motion))
        lines = self.lines(cell, legs, (*_warning(cell, motion), *unsaid))
        return ProgramText(text="\n".join([*lines, ""]), unsaid=unsaid)

    def read(
        self,
        text: str,
        robot: Robot,
        *,
        planned: WaypointSettings | None = None,
        settings: ProgramSettings | None = None,
    ) -> Program:
        """Return the motion of a program that `write` wrote, from its text alone.

        Parameters
        ----------
        planned : limits, of which speeds are parts, and the tool's frame, as the motion had
        settings : how the controller counts, as it was written with; name, repeats and approach are not used

        Raises
        ------
        ExportError
            when a statement is not among those written here, or cannot be: names the line.
        """
        chosen = settings or ProgramSettings()
        self.check_robot(robot, settings=chosen)
        return self.parse(Cell(robot=robot, planned=planned or WaypointSettings(), settings=chosen), text)

    def check_robot(self, robot: Robot, *, settings: ProgramSettings) -> None:
        """Check that programs of this language can move a robot.

        Raises
        ------
        ExportError
            when its joints are not those of a controller's arm, or the controller counts others.
        """
        if self.six_joints and not has_six_revolute_joints(robot):
            raise ExportError(
                f"{self.title} programs",
                where=robot.name,
                expected=f"{SIX_JOINTS} revolute joints",
                got=kinds_of_joints(robot),
                remedy="write a table",
            )
        if settings.joints is not None and settings.joints.offset.size != robot.n_v:
            size = settings.joints.offset.size
            raise ExportError("controller joints of another robot", where=robot.name, expected=robot.n_v, got=size)


def _warning(cell: Cell, motion: WaypointMotion) -> tuple[str, ...]:
    robot = harmless_name(motion.robot)
    return (
        f"Motion of {robot}, {motion.duration:.1f} s as planned, run {cell.settings.repeats} times.",
        "RUN IT SLOWLY FIRST: at reduced speed, with a hand on the stop.",
        "The way to the first position is not checked for collisions.",
        "Check first position, zero pose of every joint and the tool data against this program.",
    )


def _left_to_the_controller(motion: WaypointMotion) -> tuple[str, ...]:
    jerk = ("The jerk is the controller's own.",)
    if not motion.slowed:
        return jerk
    return (*jerk, f"The plan slows {len(motion.slowed)} ways or corners; the controller decides for itself.")


DIALECTS: tuple[Dialect, ...] = (
    Dialect(
        key="urscript", title="URScript", ending=".script", lines=urscript.write, parse=urscript.read,
        unsaid=urscript.UNSAID, words=Words(joint_zone="radius", line_zone="radius"),
    ),
    Dialect(
        key="krl", title="KRL", ending=".src", lines=krl.write, parse=krl.read, unsaid=krl.UNSAID,
        words=Words(joint_zone="part", line_zone="radius"),
    ),
    Dialect(
        key="rapid", title="RAPID", ending=".mod", lines=rapid.write, parse=rapid.read, unsaid=rapid.UNSAID,
        words=Words(
            joint_zone="radius", line_zone="radius", least_acceleration=rapid.LEAST_ACCELERATION,
            least_line_acceleration=rapid.LEAST_PATH,
        ),
    ),
    Dialect(
        key="fanuc", title="FANUC", ending=".ls", lines=fanuc.write, parse=fanuc.read, unsaid=fanuc.UNSAID,
        words=Words(joint_zone="part", line_zone="part", line_speed_step=1e-3, dwell_step=fanuc.DWELL),
    ),
    Dialect(
        key="csv", title="via-points", ending=".csv", lines=viapoints.write_csv, parse=viapoints.read_csv,
        unsaid=viapoints.UNSAID, six_joints=False,
    ),
    Dialect(
        key="toml", title="via-points", ending=".toml", lines=viapoints.write_toml, parse=viapoints.read_toml,
        unsaid=viapoints.UNSAID, six_joints=False,
    ),
)  # fmt: skip


def program_named(key: str) -> Dialect:
    """Return the language of a name.

    Raises
    ------
    ExportError
        when there is none of that name.
    """
    for dialect in DIALECTS:
        if dialect.key == key:
            return dialect
    raise ExportError(
        "unknown program language", got=key[:60], remedy=advice_on_name(key, [one.key for one in DIALECTS])
    )
