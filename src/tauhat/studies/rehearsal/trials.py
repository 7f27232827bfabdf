"""One simulated robot from its motions to verified models: what a worker does for a seed."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.model import PLAIN_TERMS, torque_model
from tauhat.errors import TauhatError, TauhatWarning
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.estimators import estimator_named
from tauhat.estimation.identify import identify
from tauhat.excitation.trajectory import Trajectory
from tauhat.recordings.log import Log
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording
from tauhat.robots.robot import Robot
from tauhat.simulation.experiment import ExperimentSettings, Simulation, Truth, logged, simulate
from tauhat.simulation.parameters import TrueParameters
from tauhat.simulation.planned_experiment import PlannedExperiment
from tauhat.simulation.sensors import SensorErrors
from tauhat.verification.checked_log import checked_log
from tauhat.verification.prediction import predict_recording, verify
from tauhat.verification.truth import standard_parameters

CONFIDENCE = 0.95
BAND = 10.0  # [Hz] below which errors against the truth are judged
_MOTION_BAND = 40.0  # [Hz] to which the true speed is differentiated for it
_OF_RATE = 0.2  # of the log's rate, at most
_STREAM = 20261122  # of all random numbers of a rehearsal
_TRUTH, _SENSORS, _FITTED, _UNSEEN = range(4)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NamedSensors:
    """Sensors and what people call them."""

    name: str
    errors: SensorErrors


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trial:
    """A robot to be rehearsed with.

    experiment : what is known of it, and how it is steered
    motions : to identify from, of different lengths
    unseen : motion to verify on
    sensors : each of which every motion is logged by
    terms, estimator : of the model that is identified
    seed : of the true robot, its sensors and their noise
    """

    experiment: PlannedExperiment
    motions: tuple[Trajectory, ...]
    unseen: Trajectory
    sensors: tuple[NamedSensors, ...]
    terms: str
    estimator: str
    seed: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What became of one robot, one motion and one kind of sensors.

    error : norm of the predicted less the true torque over that of the true, below 10 Hz on the unseen motion, all
        joints stacked
    as_sensed : the same against the true torque with the constant errors of the sensors, factors and offsets, which no
        log of that robot can tell
    on_log : as `tauhat verify` shows it, against the unseen motion's log
    joints : error joint by joint
    inside : share of the base parameters whose 95 % intervals hold the truth
    condition : condition number of the fit
    failure : why there is no model; all figures are nan then
    doubts : what the library warned of, and for the first robot what `tauhat check` does
    """

    seed: int
    seconds: float
    sensors: str
    error: float = float("nan")
    as_sensed: float = float("nan")
    on_log: float = float("nan")
    joints: tuple[float, ...] = ()
    inside: float = float("nan")
    condition: float = float("nan")
    failure: str = ""
    doubts: tuple[str, ...] = ()


def rehearsed(trial: Trial) -> tuple[Outcome, ...]:
    """Return the outcomes of one robot for every motion and every kind of sensors."""
    robot, settings = trial.experiment.robot, trial.experiment.settings
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always", TauhatWarning)
        try:
            truth = trial.experiment.truth(_random(trial, _TRUTH))
            unseen = _run(robot, trial.unseen, truth, settings)
        except TauhatError as error:
            pairs = [(motion, sensors) for motion in trial.motions for sensors in trial.sensors]
            return tuple(_failed(trial, motion, sensors, error) for motion, sensors in pairs)
    doubts = _words(heard)
    return tuple(
        outcome for motion in trial.motions for outcome in _of_motion(trial, motion, unseen=unseen, doubts=doubts)
    )


def _of_motion(trial: Trial, motion: Trajectory, *, unseen: Truth, doubts: tuple[str, ...]) -> Iterator[Outcome]:
    """Yield the outcomes of one motion; the run is simulated once for all sensors."""
    experiment = trial.experiment
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always", TauhatWarning)
        try:
            truth = _run(experiment.robot, motion, unseen.parameters, experiment.settings)
        except TauhatError as error:
            yield from (_failed(trial, motion, sensors, error) for sensors in trial.sensors)
            return
    doubts = (*doubts, *_words(heard))
    for sensors in trial.sensors:
        with warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("always", TauhatWarning)
            try:
                outcome = _outcome(trial, sensors, truth, unseen=unseen)
            except TauhatError as error:
                outcome = _failed(trial, motion, sensors, error)
        found = dict.fromkeys((*doubts, *outcome.doubts, *_words(heard)))
        yield replace(outcome, seconds=motion.duration, doubts=tuple(found))


def _outcome(trial: Trial, sensors: NamedSensors, fitted: Truth, *, unseen: Truth) -> Outcome:
    """Return what the model, identified from the log that these sensors make of a run, is worth."""
    robot = trial.experiment.robot
    errors = sensors.errors.drawn(robot.n_v, _random(trial, _SENSORS))  # the same sensors for every motion
    settings = replace(trial.experiment.settings, sensors=errors)
    log = logged(robot, fitted, settings=settings, rng=_random(trial, _FITTED)).recording
    seen = logged(robot, unseen, settings=settings, rng=_random(trial, _UNSEEN))
    model = torque_model(robot, trial.terms)
    estimate = identify(model, [log], estimator=estimator_named(trial.estimator))
    clean = _clean(robot, unseen, settings)
    processing = _judge(settings.sample_rate)
    against_truth = predict_recording(estimate, clean, processing=processing)
    constant = np.asarray(errors.torque_factor) * _torque(unseen, settings) + np.asarray(errors.torque_offset)
    doubts = _checked(robot, log) if trial.seed == 0 else ()
    return Outcome(
        seed=trial.seed,
        seconds=0.0,
        sensors=sensors.name,
        error=against_truth.relative_rms,
        as_sensed=predict_recording(estimate, replace(clean, tau=constant), processing=processing).relative_rms,
        on_log=verify(estimate, [seen.recording]).logs[0].relative_rms,
        joints=tuple(joint.relative_rms for joint in against_truth.joints),
        inside=_share_inside(estimate, unseen.parameters, errors),
        condition=estimate.condition,
        doubts=doubts,
    )


def _judge(rate: float) -> Processing:
    """Return the filters of all errors against the truth: the same band for good and bad logs, speeds as they are."""
    return Processing(
        cutoff=min(BAND, _OF_RATE * rate),
        motion_cutoff=min(_MOTION_BAND, 2.0 * _OF_RATE * rate),
        velocity="velocity",
    )


def _checked(robot: Robot, recording: Recording) -> tuple[str, ...]:
    """Return what `tauhat check` would warn of."""
    log = Log(
        t=recording.t,
        q=recording.q,
        dq=recording.dq,
        tau=recording.tau,
        joint_names=robot.joint_names,
        units=tuple(joint.unit for joint in robot.joints),
        path="log",
    )
    findings = checked_log(log, robot=robot, terms=PLAIN_TERMS).findings
    return tuple(f"check: {found.message}" for found in findings if found.severity in {"error", "warning"})


def _run(robot: Robot, motion: Trajectory, truth: TrueParameters, settings: ExperimentSettings) -> Truth:
    """Return the truth of a run; its sensors are nobody's."""
    perfect = replace(settings, sensors=SensorErrors())
    done: Simulation = simulate(robot, motion, rng=np.random.default_rng(0), parameters=truth, settings=perfect)
    return done.truth


def _clean(robot: Robot, truth: Truth, settings: ExperimentSettings) -> Recording:
    """Return the log that perfect sensors on the same sides would have made."""
    on_motor = settings.encoder.side == "motor"
    return Recording(
        t=truth.reference.t,
        q=truth.motor_q if on_motor else truth.q,
        dq=truth.motor_dq if on_motor else truth.dq,
        tau=_torque(truth, settings),
        joint_names=robot.joint_names,
        name="truth",
    )


def _torque(truth: Truth, settings: ExperimentSettings) -> FloatArray:
    return truth.gear_torque if settings.sensors.torque_side == "link" else truth.tau


def _share_inside(estimate: Estimate, truth: TrueParameters, errors: SensorErrors) -> float:
    """Return the share of the base parameters whose interval holds the truth of the side where torque is sensed."""
    sensed = truth.behind_gear() if errors.torque_side == "link" else truth
    values = estimate.base.projection @ standard_parameters(estimate.model, sensed)
    inside = np.abs(estimate.values - values) <= estimate.half_intervals(confidence=CONFIDENCE)
    return float(inside.mean())


def _random(trial: Trial, purpose: int) -> np.random.Generator:
    return np.random.default_rng([_STREAM, trial.experiment.robot_seed, trial.seed, purpose])


def _failed(trial: Trial, motion: Trajectory, sensors: NamedSensors, error: TauhatError) -> Outcome:
    return Outcome(seed=trial.seed, seconds=motion.duration, sensors=sensors.name, failure=str(error))


def _words(heard: list[warnings.WarningMessage]) -> tuple[str, ...]:
    return tuple(str(warning.message) for warning in heard)
