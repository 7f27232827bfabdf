"""`tauhat rehearse`: the whole identification on simulated robots, before a real one is touched."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from tauhat.cli.options import (
    ClusterOption,
    ExperimentSeedOption,
    JsonOption,
    LockOption,
    RobotOrExperimentArgument,
    StudyPageOption,
    WorkersOption,
)
from tauhat.cli.reporting import say, working
from tauhat.cli.studies import experiment_of, show_result

if TYPE_CHECKING:
    from tauhat.robots.robot import Robot
    from tauhat.simulation.planned_experiment import PlannedExperiment
    from tauhat.studies.rehearsal import RehearsalStudy

_LENGTHS = (5.0, 10.0, 20.0, 40.0)  # [s] that are tried for a target
_SCALES = (4.0, 2.0, 1.0, 0.5)  # of an experiment's own sensors, likewise
_SEEDS, _SEEDS_OF_A_SEARCH = 20, 8
_USUAL = "industrial-arm"
_RATE = 500.0  # [Hz] of the log


class Numbers(tuple[float, ...]):
    """Positive numbers with commas between."""


def numbers(text: str) -> Numbers:
    """Return the numbers that a list names."""
    try:
        values = Numbers(float(part) for part in text.split(","))
    except ValueError as error:
        raise typer.BadParameter(f"not numbers with commas between: {text!r}") from error
    if not all(0.0 < value < math.inf for value in values):
        raise typer.BadParameter(f"not positive numbers: {text}")
    return values


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What `tauhat rehearse` takes."""

    robot: RobotOrExperimentArgument
    target: Annotated[
        float | None,
        typer.Option(
            "--target",
            metavar="PERCENT",
            min=0.01,
            max=99.0,
            help="Error of the torque that is wanted (%): look for the cheapest motion and sensors.",
            show_default=False,
        ),
    ] = None
    seconds: Annotated[
        Numbers | None,
        typer.Option(
            "--seconds",
            metavar="S[,S...]",
            parser=numbers,
            help="Lengths of the motion (s).",
            show_default="20; with --target 5,10,20,40",
        ),
    ] = None
    sensors: Annotated[
        str | None,
        typer.Option(
            "--sensors",
            metavar="NAME[,NAME...]",
            help="low-cost, industrial-arm, cobot.",
            show_default="industrial-arm; with --target all; those of EXPERIMENT.toml",
        ),
    ] = None
    scale: Annotated[
        Numbers | None,
        typer.Option(
            "--scale",
            metavar="X[,X...]",
            parser=numbers,
            help="How many times as bad the sensors are.",
            show_default="1; with --target 4,2,1,0.5 for those of EXPERIMENT.toml",
        ),
    ] = None
    model: Annotated[
        str, typer.Option("--model", metavar="TERMS", help="robust, plain, or terms with commas between.")
    ] = "robust"
    estimator: Annotated[str, typer.Option("--estimator", metavar="NAME", help="Method of the fits.")] = "wls"
    seeds: Annotated[
        int | None,
        typer.Option("--seeds", metavar="N", min=1, help="True robots.", show_default="20; with --target 8"),
    ] = None
    seed: ExperimentSeedOption = None
    workers: WorkersOption = None
    cluster: ClusterOption = None
    lock: LockOption = None
    output: StudyPageOption = None
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Rehearse an identification: excite, simulate, identify and verify on simulated robots near the description.

    With --target it answers how long a motion and how good sensors must be for an error of so many percent.
    """
    from tauhat.cluster import workers_of
    from tauhat.files import check_output

    if options.output is not None:
        check_output(options.output, inputs=[options.robot])
    started = time.perf_counter()
    study, workers = _study(options), workers_of(options.cluster, options.workers)
    with working(study.title):
        result = study.run(workers, tell=lambda text: say(study.key, text))
    beside = {"seconds": time.perf_counter() - started}
    show_result(result, beside, page=options.output, as_json=options.as_json)


def _study(options: Options) -> RehearsalStudy:
    from tauhat.studies.rehearsal import RehearsalStudy, sensors_named

    experiment = experiment_of(options.robot, _usual_experiment, lock=options.lock, seed=options.seed)
    searching, own_sensors = options.target is not None, experiment.sensors != _USUAL
    names = _names(options, everything=searching and not own_sensors, own=own_sensors)
    usual_scales = _SCALES if searching and not names else (1.0,)
    lengths = _LENGTHS if searching and experiment.motion.given is None else ()
    return RehearsalStudy(
        experiment=experiment,
        lengths=tuple(options.seconds or lengths),
        sensors=sensors_named(names, tuple(options.scale or usual_scales), experiment),
        seeds=options.seeds or (_SEEDS_OF_A_SEARCH if searching else _SEEDS),
        target=None if options.target is None else 0.01 * options.target,
        terms=options.model,
        estimator=options.estimator,
    )


def _names(options: Options, *, everything: bool, own: bool) -> tuple[str, ...]:
    """Return the names of the sensors; none for those of the experiment."""
    from tauhat.simulation.sensors import PRESETS

    if options.sensors is not None:
        return tuple(name.strip() for name in options.sensors.split(","))
    if everything:
        return tuple(PRESETS)
    return () if own else (_USUAL,)


def _usual_experiment(robot: Robot) -> PlannedExperiment:
    from tauhat.simulation.experiment import ExperimentSettings
    from tauhat.simulation.planned_experiment import PlannedExperiment
    from tauhat.simulation.sensors import sensor_preset

    settings = ExperimentSettings(sample_rate=_RATE, sensors=sensor_preset(_USUAL, robot))
    return PlannedExperiment(robot=robot, settings=settings, sensors=_USUAL)
