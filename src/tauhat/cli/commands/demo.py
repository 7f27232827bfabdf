"""`tauhat demo`: the whole way on a simulated robot whose truth is known."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tauhat.cli.options import JsonOption, SeedOption
from tauhat.cli.output import show
from tauhat.cli.reporting import say, working

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.text import Text

    from tauhat.cli.demo import Demo

_OWN_ROBOT = (
    ("a motion for it", "tauhat excite my_robot.urdf -o motion.parquet"),
    ("is my log sound?", "tauhat check my_log.csv --map my_map.toml --robot my_robot.urdf"),
    ("identify", "tauhat identify my_robot.urdf my_log.csv --map my_map.toml -o mine.json"),
    ("verify on another log", "tauhat verify mine.json other_log.csv --map my_map.toml"),
    ("show it to others", "tauhat report mine.json other_log.csv --map my_map.toml -o mine.html"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What `tauhat demo` takes."""

    folder: Annotated[
        Path, typer.Option("-o", "--output", metavar="FOLDER", help="Folder for what the demo makes.")
    ] = Path("tauhat-demo")
    robot: Annotated[str, typer.Option("--robot", metavar="ROBOT", help="Robot to simulate.")] = "ur5e"
    seconds: Annotated[float, typer.Option("--seconds", min=2.0, max=3600.0, help="Length of each motion (s).")] = 20.0
    seed: SeedOption = 0
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Excite, simulate, identify, verify and report, on a simulated arm whose true parameters are known."""
    from tauhat.cli.demo import DemoSettings, run_demo
    from tauhat.cli.experiment import Plan

    settings = DemoSettings(robot=options.robot, plan=Plan(seconds=options.seconds), seed=options.seed)
    with working("less than a minute in all"):
        demo = run_demo(options.folder, settings, tell=lambda step: say("demo", step))
    show(demo.to_dict(), lambda: _view(demo), as_json=options.as_json)


def _view(demo: Demo) -> Iterator[RenderableType]:
    from tauhat.cli.views.estimate import estimate_view
    from tauhat.cli.views.verification import verification_view

    yield _motion(demo)
    yield from estimate_view(demo.estimate)
    yield from verification_view(demo.verification)
    yield _against_truth(demo)
    yield _next_steps(demo)


def _motion(demo: Demo) -> Text:
    from rich.text import Text

    from tauhat.cli.views.motion import condition_alone

    found = demo.designed
    return Text.assemble(
        ("The motion", "bold"),
        f" was designed in {found.seconds:.1f} s: {condition_alone(found.condition)}; the random one that the model is "
        f"verified on has {demo.random_condition:.1f}. Inside the joint limits at all times, from rest to rest.\n",
    )


def _against_truth(demo: Demo) -> Text:
    from rich.text import Text

    from tauhat.report.formatting import percent

    compared = demo.comparison
    return Text.assemble(
        ("Against the truth", "bold"),
        f", which only a simulation knows: on the random motion the model misses {percent(compared.relative_rms)} of "
        f"the noise-free torque; the 95 % intervals of {int(compared.inside.sum())} of {compared.inside.size} base "
        f"parameters ({percent(compared.share_inside)}) hold the true value.\n",
    )


def _next_steps(demo: Demo) -> Text:
    from rich.text import Text

    text = Text.assemble(
        (f"Done in {demo.seconds:.0f} s. Open the report: ", ""), (str(demo.files["report"]), "bold cyan"), "\n"
    )
    text.append(
        f"Motion (tauhat view shows it), logs, truth and estimate are beside it in {demo.folder}.\n\n"
        "With your own robot:\n"
    )
    for purpose, command in _OWN_ROBOT:
        text.append(f"  # {purpose}\n", style="dim").append(f"  {command}\n", style="cyan")
    return text
