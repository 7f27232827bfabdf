"""One rehearsed robot with every cause switched off, and with every cause alone: what a worker does for a seed."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.model import torque_model
from tauhat.errors import TauhatError, TauhatWarning
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.estimators import estimator_named
from tauhat.estimation.identify import identify
from tauhat.estimation.tuning import tuned
from tauhat.excitation.trajectory import Trajectory
from tauhat.recordings.choice import choose_cutoff
from tauhat.recordings.processing import Processing, clock_step
from tauhat.recordings.recording import Recording
from tauhat.simulation.experiment import ExperimentSettings, Truth, logged, simulate
from tauhat.simulation.planned_experiment import PlannedExperiment
from tauhat.simulation.sensors import SensorErrors
from tauhat.verification.error_budget.causes import Case, causes_of, switched_off
from tauhat.verification.prediction import predict_recording, verify

Purpose: TypeAlias = Literal["fitted", "further", "unseen"]
_STREAM = 20261123  # of all random numbers of a budget
_TRUTH, _SENSORS = range(2)
_NOISE: Mapping[Purpose, int] = {"fitted": 2, "further": 3, "unseen": 4}
_UNKNOWN = (float("nan"),) * 3
_WIDEST = 0.4  # of the rate: up to there a true velocity is differentiated to 2e-5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BudgetMotions:
    """The motions of a budget.

    fitted : identified from
    further : identified from as well, where conditioning is switched off
    unseen : judged on
    """

    fitted: Trajectory
    further: Trajectory
    unseen: Trajectory


class Measure(NamedTuple):
    """What a model is worth.

    error : norm of the predicted less the true torque over that of the true, along the true states of the unseen
        motion, over the rows in which the robot moves, for no motion tells what dry friction takes while it stands
    on_log : the same as `tauhat verify` shows it on a log of that motion, over the same rows
    condition : condition number of the fit
    """

    error: float
    on_log: float
    condition: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BudgetTrial:
    """A robot to make the budget of.

    experiment : what is rehearsed, its own motion left aside
    terms, estimator : of the models
    warmer : the joints on the unseen motion [K]
    seed : of the true robot, its sensors and their noise
    """

    experiment: PlannedExperiment
    motions: BudgetMotions
    terms: str
    estimator: str
    warmer: float
    seed: int


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotBudget:
    """The errors of one robot.

    whole, clean : with every cause and with none
    without : by the key of the cause that is switched off
    alone : by the key of the only cause that is there
    cutoff : low-pass that all of them were fitted and judged through [Hz]
    failure : why there are none; the rest is empty then
    doubts : what the library warned of with every cause there
    """

    seed: int
    whole: Measure = field(default_factory=lambda: Measure(*_UNKNOWN))
    clean: Measure = field(default_factory=lambda: Measure(*_UNKNOWN))
    without: Mapping[str, Measure] = field(default_factory=dict)
    alone: Mapping[str, Measure] = field(default_factory=dict)
    cutoff: float = float("nan")
    failure: str = ""
    doubts: tuple[str, ...] = ()


def whole_case(trial: BudgetTrial) -> Case:
    """Return the case with every cause of the experiment; the sensors are drawn once, so that all cases share them."""
    experiment = trial.experiment
    drawn = experiment.settings.sensors.drawn(experiment.robot.n_v, _random(trial, _SENSORS))
    settings = replace(experiment.settings, sensors=drawn)
    return Case(experiment=replace(experiment, settings=settings), warmer=trial.warmer)


def robot_budget(trial: BudgetTrial) -> RobotBudget:
    """Return the errors of one robot in every case: the same truth, sensors and noise, as far as a case has them."""
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always", TauhatWarning)
        try:
            return _of_robot(trial, heard)
        except TauhatError as error:
            return RobotBudget(seed=trial.seed, failure=str(error))


def _of_robot(trial: BudgetTrial, heard: list[warnings.WarningMessage]) -> RobotBudget:
    case = whole_case(trial)
    bench = _Bench(trial=trial, cutoff=float("nan"))
    # One band for all cases: errors of different cut-offs could not be compared.
    bench = replace(bench, cutoff=choose_cutoff(bench.log(case, "fitted")))
    keys = [cause.key for cause in causes_of(case)]
    whole = bench.measured(case)
    doubts = tuple(dict.fromkeys(str(warning.message) for warning in heard))
    return RobotBudget(
        seed=trial.seed,
        whole=whole,
        clean=bench.measured(switched_off(case, keys)),
        without={key: bench.measured(switched_off(case, [key])) for key in keys},
        alone={key: bench.measured(switched_off(case, [other for other in keys if other != key])) for key in keys},
        cutoff=bench.cutoff,
        doubts=doubts,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Bench:
    """Runs and identifies the cases of one robot; cases that differ in their sensors only share their runs.

    runs : truths that are there already
    """

    trial: BudgetTrial
    cutoff: float
    runs: dict[tuple[object, ...], Truth] = field(default_factory=dict)

    def measured(self, case: Case) -> Measure:
        """Return what the model that is identified in a case is worth."""
        estimate = self._identified(case)
        truth, settings = self._run(case, "unseen"), case.experiment.settings
        clean = Recording(
            t=truth.reference.t,
            q=_position(truth, settings),
            dq=_velocity(truth, settings),
            tau=truth.gear_torque if settings.sensors.torque_side == "link" else truth.tau,
            joint_names=case.experiment.robot.joint_names,
            name="truth",
        )
        judged = predict_recording(estimate, clean, processing=self._true_processing(clean))
        return Measure(
            error=judged.moving_relative_rms,
            on_log=verify(estimate, [self._seen(case, "unseen")]).logs[0].moving_relative_rms,
            condition=estimate.condition,
        )

    def log(self, case: Case, purpose: Purpose) -> Recording:
        """Return what the sensors show of a run."""
        truth, settings = self._run(case, purpose), case.experiment.settings
        noise = _random(self.trial, _NOISE[purpose])
        return logged(case.experiment.robot, truth, settings=settings, rng=noise).recording

    def _identified(self, case: Case) -> Estimate:
        purposes: tuple[Purpose, ...] = ("fitted", "further") if case.with_further else ("fitted",)
        model = torque_model(case.experiment.robot, self.trial.terms)
        method = estimator_named(self.trial.estimator)
        if not case.with_true_motion:
            logs = [self.log(case, purpose) for purpose in purposes]
            return identify(model, logs, estimator=method, cutoff=self.cutoff)
        delay = 0.0
        if case.sensors.torque_delay:
            delay = tuned(model, [self.log(case, purpose) for purpose in purposes], cutoff=self.cutoff)[1].delay
        logs = [self._seen(case, purpose) for purpose in purposes]
        processing = replace(self._true_processing(logs[0]), delay=delay)
        return identify(model, logs, estimator=method, processing=processing)

    def _seen(self, case: Case, purpose: Purpose) -> Recording:
        """Return the log, with the true velocity where the case has it."""
        if not case.with_true_motion:
            return self.log(case, purpose)
        truth, settings = self._run(case, purpose), case.experiment.settings
        noise = _random(self.trial, _NOISE[purpose])
        seen = logged(case.experiment.robot, truth, settings=settings, rng=noise)
        return replace(seen.recording, dq=_velocity(truth, settings)[seen.rows])

    def _true_processing(self, recording: Recording) -> Processing:
        """Return the filters of the budget's band that leave true velocities as they are."""
        widest = _WIDEST / clock_step(recording)
        return Processing(cutoff=self.cutoff, motion_cutoff=widest, velocity="velocity")

    def _run(self, case: Case, purpose: Purpose) -> Truth:
        experiment, warmer = case.experiment, case.warmer if purpose == "unseen" else 0.0
        stepped = bool(np.any(experiment.settings.encoder.step))
        parts = (experiment.friction, experiment.heat is None, experiment.elasticity is None, stepped, purpose)
        if parts not in self.runs:
            self.runs[parts] = _simulated(self.trial, experiment, getattr(self.trial.motions, purpose), warmer=warmer)
        return self.runs[parts]


def _simulated(trial: BudgetTrial, experiment: PlannedExperiment, motion: Trajectory, *, warmer: float) -> Truth:
    """Return the truth of a run; its sensors are nobody's."""
    parameters = experiment.truth(_random(trial, _TRUTH))
    if parameters.heat is not None:
        heat = replace(parameters.heat, initial=parameters.heat.initial + warmer)
        parameters = replace(parameters, heat=heat)
    perfect = replace(experiment.settings, sensors=SensorErrors())
    nothing = np.random.default_rng(0)
    return simulate(experiment.robot, motion, rng=nothing, parameters=parameters, settings=perfect).truth


def _position(truth: Truth, settings: ExperimentSettings) -> FloatArray:
    return truth.motor_q if settings.encoder.side == "motor" else truth.q


def _velocity(truth: Truth, settings: ExperimentSettings) -> FloatArray:
    return truth.motor_dq if settings.encoder.side == "motor" else truth.dq


def _random(trial: BudgetTrial, purpose: int) -> np.random.Generator:
    return np.random.default_rng([_STREAM, trial.experiment.robot_seed, trial.seed, purpose])
