"""`tauhat simulate`: a log of a simulated robot with its truth."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tauhat.cli.options import JsonOption, LockOption, MotionOption, RobotOrExperimentArgument
from tauhat.cli.output import show, unbroken
from tauhat.cli.reporting import working

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import RenderableType

    from tauhat.cli.experiment import Plan
    from tauhat.excitation.trajectory import Trajectory
    from tauhat.simulation.experiment import Simulation

_RATE, _NOISE, _QUANTISATION, _SPREAD = 500.0, 0.02, 2e-5, 0.1
_OF_A_FILE = ("robot", "output", "as_json")  # what may stand beside an experiment's file


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What `tauhat simulate` takes."""

    robot: RobotOrExperimentArgument
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="LOG", help="Log to write: .parquet, .csv or .csv.gz.", show_default=False
        ),
    ] = None
    motion: MotionOption = None
    seconds: Annotated[
        float | None,
        typer.Option("--seconds", min=1.0, max=3600.0, help="Length of the random motion (s).", show_default="20"),
    ] = None
    rate: Annotated[
        float | None,
        typer.Option("--rate", min=10.0, max=10_000.0, help="Samples per second of the log (Hz).", show_default="500"),
    ] = None
    harmonics: Annotated[
        int | None,
        typer.Option("--harmonics", min=2, max=50, help="Harmonics of the random motion.", show_default="5"),
    ] = None
    noise: Annotated[
        float | None,
        typer.Option(
            "--noise", min=0.0, max=10.0, help="Torque noise over each joint's RMS torque.", show_default="0.02"
        ),
    ] = None
    quantisation: Annotated[
        float | None,
        typer.Option("--quantisation", min=0.0, max=1.0, help="Step of the encoders (rad or m).", show_default="2e-5"),
    ] = None
    spread: Annotated[
        float | None,
        typer.Option(
            "--spread",
            min=0.0,
            max=0.5,
            help="How far the true parameters are from the description's, relative.",
            show_default="0.1",
        ),
    ] = None
    lock: LockOption = None
    seed: Annotated[int | None, typer.Option("--seed", min=0, help="Seed of everything random.", show_default="0")] = (
        None
    )
    robot_seed: Annotated[
        int | None,
        typer.Option(
            "--robot-seed",
            min=0,
            help="Seed of the true parameters: the same robot on several motions.",
            show_default="0",
        ),
    ] = None
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Simulate a robot on a designed or a random motion; write its log, and its true parameters beside it."""
    from tauhat.simulation.experiment_file import is_experiment

    if is_experiment(options.robot):
        _run_experiment(options)
    else:
        _run_robot(options)


def _run_robot(options: Options) -> None:
    """Simulate a robot that the options describe."""
    import numpy as np

    from tauhat.cli.experiment import run_experiment, write_experiment
    from tauhat.cli.motions import motion_for
    from tauhat.robots.library import load_robot
    from tauhat.simulation.parameters import perturbed

    robot = load_robot(options.robot, locked=options.lock)
    log = _log_of(options, options.output)
    motion = None if options.motion is None else motion_for(robot, options.motion)
    plan, seed, robot_seed = _plan(options, motion), options.seed or 0, options.robot_seed or 0
    with working(f"simulating {plan.seconds:g} s of {robot.name}"):
        spread = _SPREAD if options.spread is None else options.spread
        truth = perturbed(robot, np.random.default_rng(robot_seed), spread=spread)
        rng = np.random.default_rng(seed)
        simulation = run_experiment(robot, plan, truth=truth, rng=rng, motion=motion)
        beside = write_experiment(robot, simulation, log, plan=plan, seed=seed)
    document = _document(simulation, log, beside, seeds=(seed, robot_seed))
    document["motion"] = None if options.motion is None else str(options.motion)
    show(document, lambda: _view(document, options.robot), as_json=options.as_json)


def _run_experiment(options: Options) -> None:
    """Simulate what an experiment's file plans."""
    from tauhat.cli.experiment import write_log
    from tauhat.simulation.experiment_file import load_experiment

    beside_it = [item.name for item in fields(options) if getattr(options, item.name) is not None]
    refused = [name for name in beside_it if name not in _OF_A_FILE]
    if refused:
        message = f"the experiment's file says that: leave out --{refused[0].replace('_', '-')}"
        raise typer.BadParameter(message, param_hint="'ROBOT'")
    experiment = load_experiment(options.robot)
    log = _log_of(options, options.output or experiment.log)
    with working(f"simulating {experiment.motion.duration:g} s of {experiment.robot.name}"):
        simulation = experiment.run()
        notes = {"experiment": Path(options.robot).read_text(encoding="utf-8")}
        beside = write_log(experiment.robot, simulation, log, notes=notes)
    document = _document(simulation, log, beside, seeds=(experiment.seed, experiment.robot_seed))
    document["experiment"] = options.robot
    show(document, lambda: _view(document, experiment.described_by), as_json=options.as_json)


def _log_of(options: Options, log: Path | None) -> Path:
    """Return where the log goes, checked before long work begins."""
    from tauhat.files import check_output
    from tauhat.recordings.writing import log_ending

    if log is None:
        raise typer.BadParameter("no log to write: give one with -o LOG", param_hint="'-o'")
    log_ending(log)
    check_output(log, inputs=[options.robot, *([options.motion] if options.motion else ())])
    return log


def _plan(options: Options, motion: Trajectory | None) -> Plan:
    from tauhat.cli.experiment import Plan

    if motion is not None and (options.seconds, options.harmonics) != (None, None):
        raise typer.BadParameter("has its own length: leave out --seconds and --harmonics", param_hint="'--motion'")
    whole = Plan()
    return Plan(
        seconds=motion.duration if motion is not None else options.seconds or whole.seconds,
        rate=options.rate or _RATE,
        harmonics=options.harmonics or whole.harmonics,
        noise=_NOISE if options.noise is None else options.noise,
        quantisation=_QUANTISATION if options.quantisation is None else options.quantisation,
    )


def _document(simulation: Simulation, log: Path, truth: Path, *, seeds: tuple[int, int]) -> dict[str, Any]:
    recording = simulation.recording
    return {
        "log": str(log),
        "truth": str(truth),
        "robot": recording.name.removesuffix(" simulated"),
        "joints": list(recording.joint_names),
        "samples": recording.n_t,
        "lost": len(simulation.truth.tau) - recording.n_t,
        "seconds": recording.duration,
        "seed": seeds[0],
        "robot_seed": seeds[1],
    }


def _view(document: dict[str, Any], robot: str) -> Iterator[RenderableType]:
    lost = f" ({document['lost']} lost)" if document["lost"] else ""
    yield unbroken(
        f"{document['samples']} samples{lost} of {len(document['joints'])} joints written: {document['log']}\n"
        f"The truth behind them: {document['truth']}\n"
        f"Next: tauhat identify {robot} {document['log']} -o estimate.json"
    )
