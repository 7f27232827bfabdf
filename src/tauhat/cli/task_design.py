"""`tauhat excite --task`: programs of via-points where the work is, checked before the search, written after it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tauhat.cli.output import show, unbroken
from tauhat.cli.reporting import working

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tauhat.cli.commands.excite import Options
    from tauhat.excitation.task_design import TaskDesign, TaskSettings
    from tauhat.export.programs import Dialect
    from tauhat.robots.robot import Robot


@dataclass(frozen=True, slots=True, kw_only=True)
class _Outputs:
    """Where everything goes, checked to be writable.

    motions : one a stage
    programs : a language, and a file a stage
    """

    motions: tuple[Path, ...]
    programs: tuple[tuple[Dialect, tuple[Path, ...]], ...]


def excite_task(options: Options, task: Path) -> None:
    """Design the programs of a task, write them and tell what they are worth."""
    import numpy as np

    from tauhat.excitation.task_design import design_task
    from tauhat.export.programs import language_of, sayable
    from tauhat.robots.library import load_robot

    robot = load_robot(options.robot, locked=options.lock)
    stated = _settings(options, task, robot)
    settings = sayable(stated, robot, [language_of(path) for path in options.program or ()])
    outputs = _outputs(options, task, settings)
    if options.report is not None:
        from tauhat.report.page import require_libraries

        require_libraries()
    rng, count = np.random.default_rng(options.seed), len(settings.stages)
    with working(f"searching programs of {count} stage{'s' * (count > 1)} for {robot.name}"):
        found = design_task(robot, settings, rng=rng, terms=options.model)
    motions = _write_motions(found, outputs.motions, rate=options.rate)
    programs = _write_programs(found, outputs.programs)
    if options.report is not None:
        from tauhat.report.task_page import write_task_report

        with working("drawing"):
            write_task_report(options.report, found)
    document = {
        "motion": str(outputs.motions[0]), "task": str(task), "robot": robot.name, "seed": options.seed,
        "report": None if options.report is None else str(options.report), **found.to_dict(),
        "motions": motions, "programs": programs, "radii": _radii(stated, settings),
    }  # fmt: skip
    show(document, lambda: _view(document), as_json=options.as_json)


def _settings(options: Options, task: Path, robot: Robot) -> TaskSettings:
    """Return the task of the file, in the limits of the other."""
    from tauhat.excitation import load_limits
    from tauhat.excitation.task_design import load_task

    settings = load_task(task, robot)
    return settings if options.limits is None else replace(settings, limits=load_limits(options.limits, robot))


def _radii(stated: TaskSettings, settings: TaskSettings) -> dict[str, float]:
    """Return the largest radius of zones for stages to which a language gave one [m]."""
    pairs = zip(stated.stages, settings.stages, strict=True)
    return {used.name: used.radius for given, used in pairs if used.radius is not None and given.radius is None}


def _outputs(options: Options, task: Path, settings: TaskSettings) -> _Outputs:
    """Return where everything goes, after checking that all of it can be written and nothing twice."""
    from tauhat.cli.motions import named
    from tauhat.errors import OutputError
    from tauhat.export.programs import language_of
    from tauhat.files import check_output
    from tauhat.recordings.writing import log_ending

    if options.output.suffix.lower() == ".script":
        remedy = "a program goes to --program"
        raise OutputError("a motion is no program", where=options.output, expected=".parquet, .csv", remedy=remedy)
    log_ending(options.output)
    names = tuple(stage.name for stage in settings.stages)
    motions = named(options.output, names)
    programs = tuple((language_of(path), named(path, names)) for path in options.program or ())
    pages = () if options.report is None else (options.report,)
    places = [*motions, *(path for _, paths in programs for path in paths), *pages]
    inputs = [path for path in (task, options.limits, Path(options.robot)) if path is not None]
    known = [check_output(path, inputs=inputs) for path in places]
    twice = next((path for path, place in zip(places, known, strict=True) if known.count(place) > 1), None)
    if twice is not None:
        raise OutputError("two outputs have one name", where=twice, remedy="choose another name for one")
    return _Outputs(motions=motions, programs=programs)


def _write_motions(found: TaskDesign, paths: Sequence[Path], *, rate: float) -> list[dict[str, Any]]:
    from tauhat.recordings.writing import write_recording

    written = []
    for stage, path in zip(found.stages, paths, strict=True):
        write_recording(stage.recording(rate=rate), path)
        seconds = stage.repeats * stage.motion.duration
        written.append({"stage": stage.stage.name, "motion": str(path), "seconds": seconds})
    return written


def _write_programs(found: TaskDesign, programs: Sequence[tuple[Dialect, tuple[Path, ...]]]) -> list[dict[str, Any]]:
    from tauhat.export.programs import task_program

    written = []
    for language, paths in programs:
        for stage, path in zip(found.stages, paths, strict=True):
            text = task_program(stage, language)
            text.save(path)
            written.append(
                {
                    "stage": stage.stage.name, "program": str(path), "language": language.title,
                    "repeats": stage.repeats, "unsaid": list(text.unsaid),
                }
            )  # fmt: skip
    return written


def _view(document: dict[str, Any]) -> Iterator[RenderableType]:
    from rich.text import Text

    from tauhat.cli.views.task import blocks_table, errors_table, stages_table, visible_text

    yield Text(f"The arm reaches {100.0 * document['reached']:.0f} % of the region from home.")
    yield stages_table(document["stages"])
    yield blocks_table(document)
    yield errors_table(document)
    yield from map(Text, visible_text(document))
    for name, radius in document["radii"].items():
        yield Text(f"Zones of the stage {name} are radii of the tool, at most {1e3 * radius:g} mm, for the controller.")
    for motion in document["motions"]:
        yield unbroken(f"Written: {motion['motion']} ({motion['seconds']:.1f} s)")
    for program in document["programs"]:
        yield unbroken(f"Written: {program['program']} ({program['language']}, runs: {program['repeats']})")
    if document["report"] is not None:
        yield unbroken(f"Written: {document['report']}")
    yield from map(Text, _unsaid(document["programs"]))


def _unsaid(programs: Sequence[dict[str, Any]]) -> Iterator[str]:
    """Yield what the languages leave to the controllers, every sentence once."""
    sentences = dict.fromkeys(sentence for program in programs for sentence in program["unsaid"])
    if sentences:
        yield "What the programs leave to the controller:"
    yield from (f"- {sentence}" for sentence in sentences)
