"""`tauhat excite`: the best motion for identifying a robot, inside its limits at all times."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
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
            "-o", "--output", metavar="MOTION", help="Motion to write: .parquet, .csv or .csv.gz.", show_default=False
        ),
    ]
    seconds: Annotated[float, typer.Option("--seconds", min=0.5, max=600.0, help="Length of one period (s).")] = 10.0
    harmonics: Annotated[int, typer.Option("--harmonics", min=2, max=50, help="Harmonics of each joint.")] = 5
    rate: Annotated[
        float, typer.Option("--rate", min=1.0, max=10_000.0, help="Samples per second of the motion file (Hz).")
    ] = 100.0
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
    model: ModelOption = TERM_NAMES
    lock: LockOption = None
    seed: SeedOption = 0
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Design a motion that identifies a robot well and keeps its limits at all times."""
    import numpy as np

    from tauhat.excitation import DesignSettings, criterion_named, design, load_limits, method_named
    from tauhat.recordings.writing import write_recording
    from tauhat.robots.library import load_robot

    robot = load_robot(options.robot, locked=options.lock)
    settings = DesignSettings(
        period=options.seconds,
        harmonics=options.harmonics,
        method=method_named(options.method),
        starts=options.starts,
        margin=options.margin,
        limits=None if options.limits is None else load_limits(options.limits, robot),
        after=None if options.after is None else _knowledge(options.after, robot),
    )
    criterion = criterion_named(options.criterion)
    with searching(f"a motion for {robot.name}", settings.genetic.generations) as progress:
        found = design(
            robot,
            rng=np.random.default_rng(options.seed),
            criterion=criterion,
            settings=settings,
            terms=options.model,
            progress=progress,
        )
    write_recording(found.recording(rate=options.rate, joint_names=robot.joint_names), options.output)
    if options.report is not None:
        _write_page(options.report, settings, robot, found, terms=options.model)
    document = {"motion": str(options.output), "robot": robot.name, "seed": options.seed, **found.to_dict()}
    distances = frozenset[str]() if settings.limits is None else settings.limits.distances
    show(document, lambda: _view(document, found, distances), as_json=options.as_json)


def _knowledge(path: Path, robot: Robot) -> Knowledge:
    from tauhat.estimation.estimate import load_estimate
    from tauhat.excitation import Knowledge

    estimate = load_estimate(path)
    estimate.check_robot(robot)
    return Knowledge(
        columns=estimate.base.independent,
        covariance=estimate.covariance,
        torque_noise=estimate.joint_rms,
        rows_per_second=2.0 * estimate.processing.cutoff,
    )


def _write_page(path: Path, settings: DesignSettings, robot: Robot, found: Design, *, terms: str) -> None:
    from tauhat.report.page import write_motion_report

    limits = None if settings.limits is None else settings.limits.of_joints()
    with working("drawing"):
        write_motion_report(path, robot, found.trajectory, terms=terms, limits=limits, margins=found.margins)


def _view(document: dict[str, Any], found: Design, distances: frozenset[str]) -> Iterator[RenderableType]:
    from tauhat.cli.views.tables import table
    from tauhat.excitation import FAR

    made = table("Limits", ("limit",), ("left unused",))
    for name, margin in found.margins.items():
        beyond = f"{1e3 * FAR * margin:.0f} mm{' or more' if margin >= 1.0 else ''} beyond the clearance"
        made.add_row(name, beyond if name in distances else f"{100 * margin:.1f} %")
    yield (
        f"Condition number {found.condition:.2f} (columns scaled by constants; good: below 10), log det "
        f"{found.log_det:.1f}, found in {found.seconds:.1f} s with {found.evaluations} evaluations."
    )
    yield made
    yield "The motion starts and ends at rest, and may be repeated without a pause."
    yield unbroken(f"Written: {document['motion']}")
