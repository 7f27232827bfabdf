"""Steps `record` and `unseen`: logs of a simulated robot, or what is known of the logs that people bring."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from tauhat.errors import ProjectError
from tauhat.excitation.motion_file import motion_for
from tauhat.project.settings import GivenLogs, SimulatedLogs, UnseenMotion, labelled
from tauhat.project.step import Step, with_named_files
from tauhat.project.steps.workplace import ROBOT, Workplace
from tauhat.simulation.experiment import ExperimentSettings
from tauhat.simulation.experiment_file import load_experiment
from tauhat.simulation.planned_experiment import MotionPlan, PlannedExperiment
from tauhat.simulation.sensors import SensorErrors, sensor_preset
from tauhat.verification.simulated_log import truth_path, write_log

_SLOWEST_CONTROL = 2000.0  # [Hz]
_LIST = "recordings/recordings.json"


def record_step(place: Workplace) -> Step:
    """Return the step that leaves the logs to identify from, or a list of them."""
    record = place.project.record
    if isinstance(record, GivenLogs):
        return Step(
            name="record",
            settings=labelled("record", record),
            files=place.files_of_logs(record),
            awaited=place.awaited(record),
            outputs=(_LIST,),
            make=partial(_list, place),
        )
    return Step(
        name="record",
        settings=labelled("record", record),
        files=_experiment_files(place, record),
        reads=(ROBOT, *place.motions),
        outputs=_with_truth(place.simulated_logs),
        make=partial(_simulate, place, record),
    )


def unseen_step(place: Workplace, record: SimulatedLogs, unseen: UnseenMotion) -> Step:
    """Return the step that leaves a simulated log of a random motion."""
    return Step(
        name="unseen",
        settings=labelled("record", record) | labelled("verify", unseen),
        files=_experiment_files(place, record),
        reads=(ROBOT,),
        outputs=_with_truth(place.unseen_log),
        make=partial(_simulate_unseen, place, record, unseen),
    )


def _simulate(place: Workplace, record: SimulatedLogs) -> None:
    planned = _planned(place, record)
    for number, (motion, log) in enumerate(zip(place.motions, place.simulated_logs, strict=True)):
        given = MotionPlan(given=motion_for(place.robot, place.path(motion)))
        one = replace(planned, motion=given, seed=planned.seed + number)
        _write(one, place.path(log), labelled("record", record) | {"motion": motion})


def _simulate_unseen(place: Workplace, record: SimulatedLogs, unseen: UnseenMotion) -> None:
    motion = MotionPlan(kind="random", seconds=unseen.seconds, harmonics=unseen.harmonics)
    planned = replace(_planned(place, record), motion=motion, seed=unseen.seed)
    (log,) = place.unseen_log
    _write(planned, place.path(log), labelled("record", record) | labelled("verify", unseen))


def _write(planned: PlannedExperiment, log: Path, notes: Mapping[str, Any]) -> None:
    write_log(planned.robot, planned.run(), log, notes={"settings": dict(notes), "seed": planned.seed})


def _planned(place: Workplace, record: SimulatedLogs) -> PlannedExperiment:
    """Return the experiment whose motion is still to be said."""
    if not record.experiment:
        return PlannedExperiment(
            robot=place.robot,
            spread=record.spread,
            friction=record.friction,
            settings=_settings(place, record),
            seed=record.seed,
            robot_seed=record.robot_seed,
        )
    file = place.project.place(record.experiment)
    planned = load_experiment(file)
    if planned.robot.fingerprint != place.robot.fingerprint:
        raise ProjectError(
            "an experiment of another robot", where=file, expected=place.robot.name, got=planned.robot.name,
            remedy="name the same robot, with the same locked joints",
        )  # fmt: skip
    return planned


def _settings(place: Workplace, record: SimulatedLogs) -> ExperimentSettings:
    """Return rates and sensors: control at a multiple of the log's rate, 2 kHz or more."""
    control_rate = record.rate * math.ceil(_SLOWEST_CONTROL / record.rate)
    if record.sensors:
        sensors = sensor_preset(record.sensors, place.robot).scaled(record.scale)
    else:
        sensors = SensorErrors(encoder_step=record.quantisation, relative_torque_noise=record.noise)
    return ExperimentSettings(
        timestep=1.0 / control_rate, control_rate=control_rate, sample_rate=record.rate, sensors=sensors
    )


def _list(place: Workplace) -> None:
    logs = [
        {
            "log": log.name,
            "sha256": log.source.sha256 if log.source else "",
            "samples": log.n_t,
            "joints": list(log.joint_names),
            "signals": list(log.signals()),
        }
        for log in place.fitted_logs()
    ]
    place.write(_LIST, {"logs": logs})


def _with_truth(logs: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(name for log in logs for name in (log, truth_path(Path(log)).as_posix()))


def _experiment_files(place: Workplace, record: SimulatedLogs) -> tuple[Path, ...]:
    return with_named_files(place.project.place(record.experiment)) if record.experiment else ()
