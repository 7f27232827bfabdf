"""`tauhat excite`: the best motion for identifying a robot, inside its limits at all times."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tauhat.cli.options import TERM_NAMES, JsonOption, LockOption, ModelOption, RobotArgument, SeedOption
from tauhat.cli.output import show, unbroken
from tauhat.cli.reporting import searching, working

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tauhat.excitation import Design, DesignSettings, Knowledge
    from tauhat.robots.robot import Robot


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
    seconds: Annotated[float, typer.Option("--seconds", min=0.5, max=600.0, help="Length of one period (s).")] = 10.0
    harmonics: Annotated[int, typer.Option("--harmonics", min=2, max=50, help="Harmonics of each joint.")] = 5
    rate: Annotated[
        float, typer.Option("--rate", min=1.0, max=10_000.0, help="Samples per second of the motion file (Hz).")
    ] = 100.0
    periods: Annotated[int, typer.Option("--periods", min=1, max=10_000, help="How often the written motion runs.")] = 1
    motions: Annotated[
        int,
        typer.Option(
            "--motions",
            min=1,
            max=100,
            help="How many motions, each for what those before leave uncertain: MOTION-1 ..",
        ),
    ] = 1
    criterion: Annotated[
        str, typer.Option("--criterion", metavar="NAME", help="mixed, condition, d, a or e (optimal).")
    ] = "mixed"
    method: Annotated[str, typer.Option("--method", metavar="NAME", help="gradient, genetic or both.")] = "both"
    starts: Annotated[int, typer.Option("--starts", min=1, max=1000, help="Random starts of the gradient method.")] = 3
    margin: Annotated[
        float, typer.Option("--margin", min=0.0, max=0.9, help="Part of every joint limit that is left unused.")
    ] = 0.05
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
            "--report", metavar="MOTION.html", help="Page about the motion to write as well.", show_default=False
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
    """Design a motion that identifies a robot well and keeps its limits at all times."""
    from tauhat.cli.motions import check_motion_output, numbered, write_motion
    from tauhat.robots.library import load_robot

    robot = load_robot(options.robot, locked=options.lock)
    paths = numbered(options.output, options.motions)
    for path in paths:
        check_motion_output(path, robot)
    settings = _settings(options, robot)
    designs = _designs(robot, settings, options)
    for found, path in zip(designs, paths, strict=True):
        write_motion(found, robot, path, rate=options.rate, periods=options.periods)
    if options.report is not None:
        _write_pages(numbered(options.report, options.motions), robot, settings, designs, terms=options.model)
    distances = frozenset[str]() if settings.limits is None else settings.limits.distances
    document = _document(robot, designs, paths, seed=options.seed)
    show(document, lambda: _view(document, options, distances), as_json=options.as_json)


def _settings(options: Options, robot: Robot) -> DesignSettings:
    from tauhat.excitation import DesignSettings, information, load_limits, method_named, payload_information

    if options.payload and options.after is not None:
        message = "an estimate of the whole arm says nothing about a payload: leave out one of --payload and --after"
        raise typer.BadParameter(message, param_hint="'--payload'")
    return DesignSettings(
        period=options.seconds,
        harmonics=options.harmonics,
        method=method_named(options.method),
        starts=options.starts,
        margin=options.margin,
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

    rng, criterion = np.random.default_rng(options.seed), criterion_named(options.criterion)
    designs: list[Design] = []
    for number in range(1, options.motions + 1):
        which = f"motion {number} of {options.motions}" if options.motions > 1 else "a motion"
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
    if options.motions > 1:
        yield motions_table(document["motions"])
    yield limits_table(document["limits"], distances)
    yield "Every run starts and ends at rest in one pose, and may be repeated without a pause."
    for motion in document["motions"]:
        yield unbroken(f"Written: {motion['motion']}")
    if options.report is not None:
        for page in numbered(options.report, options.motions):
            yield unbroken(f"Written: {page}")
