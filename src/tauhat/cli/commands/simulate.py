"""`tauhat simulate`: a log of a simulated robot with its truth."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tauhat.cli.options import JsonOption, LockOption, MotionOption, RobotArgument, SeedOption
from tauhat.cli.output import show, unbroken
from tauhat.cli.reporting import working

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import RenderableType

    from tauhat.cli.experiment import Plan
    from tauhat.excitation.trajectory import Trajectory
    from tauhat.recordings.recording import Recording


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What `tauhat simulate` takes."""

    robot: RobotArgument
    output: Annotated[
        Path,
        typer.Option(
            "-o", "--output", metavar="LOG", help="Log to write: .parquet, .csv or .csv.gz.", show_default=False
        ),
    ]
    motion: MotionOption = None
    seconds: Annotated[
        float | None,
        typer.Option("--seconds", min=1.0, max=3600.0, help="Length of the random motion (s).", show_default="20"),
    ] = None
    rate: Annotated[
        float, typer.Option("--rate", min=10.0, max=10_000.0, help="Samples per second of the log (Hz).")
    ] = 500.0
    harmonics: Annotated[
        int | None,
        typer.Option("--harmonics", min=2, max=50, help="Harmonics of the random motion.", show_default="5"),
    ] = None
    noise: Annotated[
        float, typer.Option("--noise", min=0.0, max=10.0, help="Torque noise over each joint's RMS torque.")
    ] = 0.02
    quantisation: Annotated[
        float, typer.Option("--quantisation", min=0.0, max=1.0, help="Step of the encoders (rad or m).")
    ] = 2e-5
    spread: Annotated[
        float,
        typer.Option(
            "--spread", min=0.0, max=0.5, help="How far the true parameters are from the description's, relative."
        ),
    ] = 0.1
    lock: LockOption = None
    seed: SeedOption = 0
    robot_seed: Annotated[
        int,
        typer.Option("--robot-seed", min=0, help="Seed of the true parameters: the same robot on several motions."),
    ] = 0
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Simulate a robot on a designed or a random motion; write its log, and its true parameters beside it."""
    import numpy as np

    from tauhat.cli.experiment import run_experiment, write_experiment
    from tauhat.cli.motions import motion_for
    from tauhat.files import check_output
    from tauhat.recordings.writing import log_ending
    from tauhat.robots.library import load_robot
    from tauhat.simulation.parameters import perturbed

    robot = load_robot(options.robot, locked=options.lock)
    log_ending(options.output)
    check_output(options.output, inputs=[options.robot, *([options.motion] if options.motion else ())])
    motion = None if options.motion is None else motion_for(robot, options.motion)
    plan = _plan(options, motion)
    with working(f"simulating {plan.seconds:g} s of {robot.name}"):
        truth = perturbed(robot, np.random.default_rng(options.robot_seed), spread=options.spread)
        rng = np.random.default_rng(options.seed)
        simulation = run_experiment(robot, plan, truth=truth, rng=rng, motion=motion)
        beside = write_experiment(robot, simulation, options.output, plan=plan, seed=options.seed)
    document = _document(simulation.recording, options, beside)
    show(document, lambda: _view(document, options), as_json=options.as_json)


def _plan(options: Options, motion: Trajectory | None) -> Plan:
    from tauhat.cli.experiment import Plan

    if motion is not None and (options.seconds, options.harmonics) != (None, None):
        raise typer.BadParameter("has its own length: leave out --seconds and --harmonics", param_hint="'--motion'")
    whole = Plan()
    return Plan(
        seconds=motion.duration if motion is not None else options.seconds or whole.seconds,
        rate=options.rate,
        harmonics=options.harmonics or whole.harmonics,
        noise=options.noise,
        quantisation=options.quantisation,
    )


def _document(recording: Recording, options: Options, truth: Path) -> dict[str, Any]:
    return {
        "log": str(options.output),
        "truth": str(truth),
        "motion": None if options.motion is None else str(options.motion),
        "robot": recording.name.removesuffix(" simulated"),
        "joints": list(recording.joint_names),
        "samples": recording.n_t,
        "seconds": recording.duration,
        "seed": options.seed,
        "robot_seed": options.robot_seed,
    }


def _view(document: dict[str, Any], options: Options) -> Iterator[RenderableType]:
    yield unbroken(
        f"{document['samples']} samples of {len(document['joints'])} joints written: {options.output}\n"
        f"The truth behind them: {document['truth']}\n"
        f"Next: tauhat identify {options.robot} {options.output} -o estimate.json"
    )
