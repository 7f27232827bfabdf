"""`tauhat excite`: the best motion for identifying a robot, inside its limits at all times."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tauhat.cli.options import TERM_NAMES, JsonOption, LockOption, ModelOption, RobotArgument, SeedOption
from tauhat.cli.output import show, unbroken
from tauhat.cli.reporting import searching

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tauhat.excitation import Design


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
    model: ModelOption = TERM_NAMES
    lock: LockOption = None
    seed: SeedOption = 0
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Design a motion that identifies a robot well and keeps its joint limits at all times."""
    import numpy as np

    from tauhat.excitation import DesignSettings, criterion_named, design, method_named
    from tauhat.recordings.writing import write_recording
    from tauhat.robots.library import load_robot

    robot = load_robot(options.robot, locked=options.lock)
    settings = DesignSettings(
        period=options.seconds,
        harmonics=options.harmonics,
        method=method_named(options.method),
        starts=options.starts,
        margin=options.margin,
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
    document = {"motion": str(options.output), "robot": robot.name, "seed": options.seed, **found.to_dict()}
    show(document, lambda: _view(document, found), as_json=options.as_json)


def _view(document: dict[str, Any], found: Design) -> Iterator[RenderableType]:
    from tauhat.cli.views.tables import table

    made = table("Limits", ("limit",), ("left unused",))
    for name, margin in found.margins.items():
        made.add_row(name, f"{100 * margin:.1f} %")
    yield (
        f"Condition number {found.condition:.2f} (columns scaled by constants; good: below 10), log det "
        f"{found.log_det:.1f}, found in {found.seconds:.1f} s with {found.evaluations} evaluations."
    )
    yield made
    yield "The motion starts and ends at rest, and may be repeated without a pause."
    yield unbroken(f"Written: {document['motion']}")
