"""`tauhat excite`: the best motion for identifying a robot, inside its limits at all times."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tauhat.cli.options import TERM_NAMES, JsonOption, LockOption, ModelOption, RobotArgument, SeedOption, page
from tauhat.cli.output import show, unbroken
from tauhat.cli.reporting import searching, working

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tauhat.excitation import Design, DesignSettings, Knowledge
    from tauhat.robots.robot import Robot

_METHOD, _STARTS, _CRITERION = "both", 3, "mixed"
_NOT_OF_A_TASK = {
    "seconds": "state seconds of its stages",
    "harmonics": "leave it out",
    "periods": "a program repeats to fill the seconds of its stage",
    "motions": "state its stages",
    "criterion": "state it in [search]",
    "method": "leave it out",
    "starts": "leave it out",
    "margin": "state it in [search]",
    "after": "leave it out",
    "payload": "leave it out",
}  # option -> what to do instead


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What `tauhat excite` takes."""

    robot: RobotArgument
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            metavar="MOTION",
            help="Motion to write: .parquet, .csv, .csv.gz, or .script for a Universal Robots program.",
            show_default=False,
        ),
    ]
    task: Annotated[
        Path | None,
        typer.Option(
            "--task",
            metavar="TASK.toml",
            help="Design programs of via-points where the work is, stage by stage: MOTION-NAME ..",
            show_default=False,
            readable=False,
        ),
    ] = None
    program: Annotated[
        list[Path] | None,
        typer.Option(
            "--program",
            metavar="FILE",
            help="Controller's program of --task: .script, .src, .mod, .ls, .csv, .toml; may be repeated.",
            show_default=False,
        ),
    ] = None
    seconds: Annotated[
        float | None,
        typer.Option("--seconds", min=0.5, max=600.0, help="Length of one period (s).", show_default="10"),
    ] = None
    harmonics: Annotated[
        int | None, typer.Option("--harmonics", min=2, max=50, help="Harmonics of each joint.", show_default="5")
    ] = None
    rate: Annotated[
        float, typer.Option("--rate", min=1.0, max=10_000.0, help="Samples per second of the motion file (Hz).")
    ] = 100.0
    periods: Annotated[
        int | None,
        typer.Option("--periods", min=1, max=10_000, help="How often the written motion runs.", show_default="1"),
    ] = None
    motions: Annotated[
        int | None,
        typer.Option(
            "--motions",
            min=1,
            max=100,
            help="How many motions, each for what those before leave uncertain: MOTION-1 ..",
            show_default="1",
        ),
    ] = None
    criterion: Annotated[
        str | None,
        typer.Option(
            "--criterion", metavar="NAME", help="mixed, condition, d, a or e (optimal).", show_default="mixed"
        ),
    ] = None
    method: Annotated[
        str | None,
        typer.Option("--method", metavar="NAME", help="gradient, genetic or both.", show_default="both"),
    ] = None
    starts: Annotated[
        int | None,
        typer.Option("--starts", min=1, max=1000, help="Random starts of the gradient method.", show_default="3"),
    ] = None
    margin: Annotated[
        float | None,
        typer.Option(
            "--margin", min=0.0, max=0.9, help="Part of every joint limit that is left unused.", show_default="0.05"
        ),
    ] = None
    limits: Annotated[
        Path | None,
        typer.Option(
            "--limits",
            metavar="LIMITS.toml",
            help="Torque, tool, collisions and obstacles to keep, and joint limits instead of the robot's.",
            show_default=False,
            readable=False,
        ),
    ] = None
    report: Annotated[
        Path | None,
        typer.Option(
            "--report",
            metavar="MOTION.html",
            parser=page,
            help="Page about the motion to write as well.",
            show_default=False,
        ),
    ] = None
    after: Annotated[
        Path | None,
        typer.Option(
            "--after", metavar="ESTIMATE.json", help="Design for what this estimate is unsure of.", show_default=False
        ),
    ] = None
    payload: Annotated[
        bool, typer.Option("--payload", help="Design for the inertia of the last link alone: what it carries.")
    ] = False
    model: ModelOption = TERM_NAMES
    lock: LockOption = None
    seed: SeedOption = 0
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Design a motion that identifies a robot well and keeps its limits at all times.

    With --task it is programs of via-points in the region of the work, as an industrial controller runs them.
    """
    _refuse_strange(options)
    if options.task is not None:
        from tauhat.cli.task_design import excite_task

        excite_task(options, options.task)
    else:
        _excite(options)


def _refuse_strange(options: Options) -> None:
    """Refuse options that would be ignored."""
    if options.task is None:
        if options.program:
            raise typer.BadParameter("needs --task, whose motions are programs", param_hint="'--program'")
        return
    for name, instead in _NOT_OF_A_TASK.items():
        if getattr(options, name) not in (None, False):
            raise typer.BadParameter(f"is of periodic motions; with --task {instead}", param_hint=f"'--{name}'")


def _excite(options: Options) -> None:
    from tauhat.cli.motions import check_motion_output, numbered, write_motion
    from tauhat.robots.library import load_robot

    robot = load_robot(options.robot, locked=options.lock)
    paths = numbered(options.output, options.motions or 1)
    for path in paths:
        check_motion_output(path, robot)
    settings = _settings(options, robot)
    designs = _designs(robot, settings, options)
    for found, path in zip(designs, paths, strict=True):
        write_motion(found, robot, path, rate=options.rate, periods=options.periods or 1)
    if options.report is not None:
        _write_pages(numbered(options.report, len(paths)), robot, settings, designs, terms=options.model)
    distances = frozenset[str]() if settings.limits is None else settings.limits.distances
    document = _document(robot, designs, paths, seed=options.seed)
    show(document, lambda: _view(document, options, distances), as_json=options.as_json)


def _settings(options: Options, robot: Robot) -> DesignSettings:
    from tauhat.excitation import DesignSettings, information, load_limits, method_named, payload_information

    if options.payload and options.after is not None:
        message = "an estimate of the whole arm says nothing about a payload: leave out one of --payload and --after"
        raise typer.BadParameter(message, param_hint="'--payload'")
    usual = DesignSettings()
    return DesignSettings(
        period=options.seconds or usual.period,
        harmonics=options.harmonics or usual.harmonics,
        method=method_named(options.method or _METHOD),
        starts=options.starts or _STARTS,
        margin=usual.margin if options.margin is None else options.margin,
        limits=None if options.limits is None else load_limits(options.limits, robot),
        after=None if options.after is None else _knowledge(options.after, robot),
        counted=payload_information if options.payload else information,
    )


def _knowledge(path: Path, robot: Robot) -> Knowledge:
    from tauhat.estimation.estimate import load_estimate
    from tauhat.excitation import Knowledge

    estimate = load_estimate(path)
    estimate.check_robot(robot)
    return Knowledge(
        names=tuple(estimate.base.names[index] for index in estimate.base.independent),
        covariance=estimate.covariance,
        torque_noise=estimate.joint_rms,
        rows_per_second=2.0 * estimate.processing.cutoff,
    )


def _designs(robot: Robot, settings: DesignSettings, options: Options) -> tuple[Design, ...]:
    """Return the motions, each designed for what the ones before it leave uncertain."""
    import numpy as np

    from tauhat.excitation import criterion_named, design

    rng, criterion = np.random.default_rng(options.seed), criterion_named(options.criterion or _CRITERION)
    designs: list[Design] = []
    count = options.motions or 1
    for number in range(1, count + 1):
        which = f"motion {number} of {count}" if count > 1 else "a motion"
        earlier = tuple(found.trajectory for found in designs)
        with searching(f"{which} for {robot.name}", settings.genetic.generations) as progress:
            found = design(
                robot,
                rng=rng,
                criterion=criterion,
                settings=replace(settings, earlier=earlier),
                terms=options.model,
                progress=progress,
            )
        designs.append(found)
    return tuple(designs)


def _write_pages(
    paths: Sequence[Path], robot: Robot, settings: DesignSettings, designs: Sequence[Design], *, terms: str
) -> None:
    from tauhat.dynamics.model import torque_model
    from tauhat.report.page import write_motion_report

    limits = None if settings.limits is None else settings.limits.of_joints()
    counted = settings.counted(torque_model(robot, terms))
    with working("drawing"):
        for path, found in zip(paths, designs, strict=True):
            margins = found.margins
            write_motion_report(path, robot, found.trajectory, counted=counted, limits=limits, margins=margins)


def _document(robot: Robot, designs: Sequence[Design], paths: Sequence[Path], *, seed: int) -> dict[str, Any]:
    """Return the figures: those of the last motion count all before it, times add up, margins are the smallest."""
    together = designs[-1].to_dict() | {
        "mean_error_before": designs[0].mean_error_before,
        "seconds": sum(found.seconds for found in designs),
        "evaluations": sum(found.evaluations for found in designs),
        "limits": {name: min(found.margins[name] for found in designs) for name in designs[0].margins},
    }
    motions = [{"motion": str(path), **found.to_dict()} for path, found in zip(paths, designs, strict=True)]
    return {"motion": str(paths[0]), "robot": robot.name, "seed": seed, **together, "motions": motions}


def _view(document: dict[str, Any], options: Options, distances: frozenset[str]) -> Iterator[RenderableType]:
    from rich.text import Text

    from tauhat.cli.motions import numbered
    from tauhat.cli.views.motion import limits_table, motions_table, quality

    yield Text(quality(document, after=None if options.after is None else options.after.name))
    count = len(document["motions"])
    if count > 1:
        yield motions_table(document["motions"])
    yield limits_table(document["limits"], distances)
    yield "Every run starts and ends at rest in one pose, and may be repeated without a pause."
    for motion in document["motions"]:
        yield unbroken(f"Written: {motion['motion']}")
    if options.report is not None:
        for path in numbered(options.report, count):
            yield unbroken(f"Written: {path}")
