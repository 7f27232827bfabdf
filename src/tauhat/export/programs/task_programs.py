"""Programs for controllers from a task-oriented design: what their languages cannot say is found before the search."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from tauhat.errors import ExportError
from tauhat.excitation.task_design import StageDesign, TaskSettings, TaskStage
from tauhat.excitation.waypoints.moves import ToolLimits
from tauhat.export.programs.dialect import DIALECTS, Dialect
from tauhat.export.programs.program import ProgramSettings, ProgramText
from tauhat.export.programs.words import ZoneKind
from tauhat.robots.robot import Robot

USUAL_RADIUS = 0.05  # [m] of a zone at most, where a language wants radii and none is stated
_WHOLE = 1e-7  # of a step


def language_of(path: str | Path) -> Dialect:
    """Return the language of a program file by its ending.

    Raises
    ------
    ExportError
        when no language has it.
    """
    ending = Path(path).suffix.lower()
    for dialect in DIALECTS:
        if dialect.ending == ending:
            return dialect
    known = ", ".join(f"{dialect.ending} ({dialect.title})" for dialect in DIALECTS)
    raise ExportError("no language has this ending", where=path, expected=known, got=ending or "no ending")


def sayable(settings: TaskSettings, robot: Robot, languages: Sequence[Dialect]) -> TaskSettings:
    """Return a task of which the languages can say every program; zones become radii where they have to.

    Raises
    ------
    ExportError
        when a language cannot move the robot, or has no word for what a stage may ask for: names both.
    """
    for language in languages:
        for stage in settings.stages:
            language.check_robot(robot, settings=_settings_for(stage))
    stages = tuple(_with_zones(stage, languages) for stage in settings.stages)
    for language in languages:
        for stage in stages:
            _check_pace(stage, language, settings.tool)
    return replace(settings, stages=stages)


def task_program(found: StageDesign, language: Dialect) -> ProgramText:
    """Return the program of a stage, which repeats as often as it fits into the stage's time.

    Raises
    ------
    ExportError
        when the language has no word for something: names the move.
    """
    return language.write(found.motion, settings=_settings_for(found.stage, repeats=found.repeats))


def _settings_for(stage: TaskStage, *, repeats: int = 1) -> ProgramSettings:
    return ProgramSettings(name=f"task_{stage.name.replace('-', '_')}", repeats=repeats)


def _with_zones(stage: TaskStage, languages: Sequence[Dialect]) -> TaskStage:
    """Return the stage with the kind of zone that all languages know."""
    wanted = dict(_zones_of(stage, languages))
    if not wanted or stage.zone == 0.0:
        return stage
    where = f"stage {stage.name}"
    if len(wanted) > 1:
        raise ExportError(
            "the languages share no kind of zone", where=where,
            got=" and ".join(f"{title}: {kind}" for kind, title in wanted.items()),
            remedy="write them in two runs, or stop everywhere (zone = 0)",
        )  # fmt: skip
    ((kind, title),) = wanted.items()
    if kind == "part" and stage.radius is not None:
        raise ExportError(f"{title} knows no radius here", where=where, remedy="leave out the radius of the zones")
    if kind == "radius" and stage.radius is None:
        return replace(stage, radius=USUAL_RADIUS)
    return stage


def _zones_of(stage: TaskStage, languages: Iterable[Dialect]) -> Iterator[tuple[ZoneKind, str]]:
    for language in languages:
        kind = language.words.line_zone if stage.moves == "line" else language.words.joint_zone
        if kind is not None:
            yield kind, language.title


def _check_pace(stage: TaskStage, language: Dialect, tool: ToolLimits) -> None:
    words, where, line = language.words, f"stage {stage.name}", stage.moves == "line"
    given, least, unit = stage.acceleration[0], words.least_acceleration, ""
    if line:
        given, least, unit = given * tool.acceleration, words.least_line_acceleration, " m/s^2"
    if given < least:
        raise ExportError(
            f"{language.title} knows no acceleration this low", where=where, expected=f"at least {least:g}{unit}",
            got=f"{given:g}", remedy="a larger least acceleration of the stage",
        )  # fmt: skip
    if line and not _is_whole(0.01 * tool.speed, words.line_speed_step):
        raise ExportError(
            f"{language.title} says speeds of lines in whole steps", where=where,
            expected=f"a speed in [line] of whole {100.0 * words.line_speed_step:g} m/s", got=f"{tool.speed:g}",
        )  # fmt: skip
    if not _is_whole(stage.dwell, words.dwell_step):
        raise ExportError(
            f"{language.title} says dwells in whole steps", where=where,
            expected=f"a dwell of whole {words.dwell_step:g} s", got=f"{stage.dwell:g}",
        )  # fmt: skip


def _is_whole(value: float, step: float) -> bool:
    return step == 0.0 or abs(value / step - round(value / step)) < _WHOLE
