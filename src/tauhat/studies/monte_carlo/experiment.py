"""One simulated experiment of the study: a robot that is not the described one, a motion, a law that is known, a log.

The plant is MuJoCo's at 0.1 ms; nothing of it is shared with the estimators. Robot, motions and law depend on robot and
seed alone, so that all levels of noise and all rates see the same experiment.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.base import base_parameters
from tauhat.dynamics.model import TorqueModel, torque_model
from tauhat.dynamics.terms import Coulomb
from tauhat.errors import ModelError, TauhatWarning
from tauhat.estimation.closed_loop import ClosedLoop
from tauhat.estimation.evidence import collect_all
from tauhat.estimation.problem import Problem
from tauhat.estimation.repeated_rows import remembered
from tauhat.estimation.solution import MOST_GROUPS
from tauhat.estimation.tuning import tuned
from tauhat.excitation.fourier import random_fourier
from tauhat.excitation.trajectory import MotionSamples
from tauhat.recordings.recording import Recording
from tauhat.robots.library import load_robot
from tauhat.robots.robot import Robot
from tauhat.simulation.experiment import ExperimentSettings, simulate
from tauhat.simulation.gains import tracking_gains
from tauhat.simulation.laws import SmoothCoulomb
from tauhat.simulation.parameters import TrueParameters, perturbed
from tauhat.simulation.typical import top_speeds
from tauhat.verification.truth import standard_parameters

CONTROL_RATE = 2000.0  # [Hz] of the law; the log is made at that rate and thinned
_TIMESTEP = 1e-4  # [s] of the plant
_BANDWIDTH = 15.0  # [Hz] of the law
_HARMONICS = 5
_WIDTH = 0.02  # of the smooth sign of friction, in parts of the speed limit
_LONGEST_STEP = 1e-3  # [s] of the estimators' own integrator
_UNSEEN_RATE = 100.0  # [Hz] at which the unseen motion is looked at
_STREAM = 20261121  # of all random numbers of this study


@dataclass(frozen=True, slots=True, kw_only=True)
class Disturbance:
    """What stands between the robot and its log.

    position : standard deviation of white noise of the position [rad or m]
    torque : the same of the torque, in parts of each joint's root mean square
    rate : of the log [Hz]; the control rate is a multiple of it
    """

    position: float
    torque: float
    rate: float

    def __post_init__(self) -> None:
        if not (0.0 <= self.position < np.inf and 0.0 <= self.torque < np.inf):
            raise ModelError("noise cannot be negative", got=f"{self.position} and {self.torque}")
        check_rate(self.rate)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Experiment:
    """What was run, and the truth behind it.

    model : with the true widths of friction, so that it can be exactly right
    standard : (n_p,) true standard parameters
    clean : recording without noise, at the control rate
    loop : law, gains, reference and control rate of the robot
    unseen : another motion
    """

    model: TorqueModel
    standard: FloatArray
    clean: Recording
    loop: ClosedLoop
    unseen: MotionSamples


def check_rate(rate: float) -> None:
    """Refuse a rate that the control rate is no multiple of.

    Raises
    ------
    ModelError
        when it is none.
    """
    stride = CONTROL_RATE / rate if 0.0 < rate < np.inf else 0.0
    if round(stride) < 1 or abs(stride - round(stride)) > 1e-9 * stride:
        raise ModelError("rate of a log", expected=f"a whole part of {CONTROL_RATE:g} Hz", got=f"{rate:g} Hz")


@lru_cache(maxsize=2)
def experiment_of(name: str, *, seed: int, seconds: float) -> Experiment:
    """Return the experiment of a robot and a seed; the last two are remembered.

    Parameters
    ----------
    name : what `load_robot` takes
    seconds : duration of the motion [s]

    Raises
    ------
    RobotError
        when there is no such robot.
    SimulationError
        when it cannot be simulated.
    """
    robot, rng = load_robot(name), np.random.default_rng([_STREAM, seed])
    truth, model = _truth(robot, rng)
    motion = random_fourier(robot, period=seconds, harmonics=_HARMONICS, rng=rng)
    unseen = random_fourier(robot, period=seconds, harmonics=_HARMONICS, rng=rng)
    poses = motion.sample(np.arange(0.0, seconds, 0.05)).q
    law = tracking_gains(robot, poses, bandwidth=_BANDWIDTH, control_rate=CONTROL_RATE)
    settings = ExperimentSettings(
        timestep=_TIMESTEP, control_rate=CONTROL_RATE, sample_rate=CONTROL_RATE, controller=law
    )  # fmt: skip
    with warnings.catch_warnings():
        # A torque limit that is met is part of the law, which the estimators know.
        warnings.simplefilter("ignore", TauhatWarning)
        recording = simulate(robot, motion, rng=rng, parameters=truth, settings=settings).recording
    return Experiment(
        model=model,
        standard=standard_parameters(model, truth),
        clean=recording,
        loop=ClosedLoop(law=law, references=(motion,), control_rate=CONTROL_RATE, longest_step=_LONGEST_STEP),
        unseen=unseen.sample(np.arange(0.0, seconds, 1.0 / _UNSEEN_RATE)),
    )


def logged(experiment: Experiment, disturbance: Disturbance, *, seed: int) -> Recording:
    """Return the log at a rate with noise; levels of noise differ in nothing but their size."""
    stride = round(CONTROL_RATE / disturbance.rate)
    rng, clean = np.random.default_rng([_STREAM, seed, 1]), experiment.clean
    if clean.tau is None:
        raise ModelError("a simulated log without torque", where=clean.name)
    t, q, tau = clean.t[::stride], clean.q[::stride], clean.tau[::stride]
    level = disturbance.torque * np.sqrt(np.mean(tau**2, axis=0))
    return Recording(
        t=t,
        q=q + disturbance.position * rng.standard_normal(q.shape),
        tau=tau + level * rng.standard_normal(q.shape),
        joint_names=clean.joint_names,
        name=clean.name,
    )


def problem_of(model: TorqueModel, recording: Recording) -> Problem:
    """Return what every estimator is given: filters chosen as `identify` chooses them, evidence and rows shared.

    Raises
    ------
    TauhatError
        when the recording cannot be processed.
    """
    recordings = (recording,)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)
        settled, processing = tuned(model, recordings)
    base = base_parameters(settled)
    evidence = collect_all(settled, base, recordings, processing)
    # As many blocks of time as the error bars need: every estimator would merge them again.
    evidence = evidence.of_blocks(evidence.merged_blocks(MOST_GROUPS))
    problem = Problem(model=settled, base=base, recordings=recordings, processing=processing, evidence=evidence)
    return remembered(problem)


def _truth(robot: Robot, rng: np.random.Generator) -> tuple[TrueParameters, TorqueModel]:
    """Return a robot near the described one with a smooth sign of friction, and the model that has the same sign."""
    width = _WIDTH * top_speeds(robot)
    plain = perturbed(robot, rng)
    friction = SmoothCoulomb(torque=plain.coulomb, width=width)
    truth = replace(plain, coulomb=np.zeros(robot.n_v), laws=(friction,))
    return truth, torque_model(robot).with_term(Coulomb(widths=tuple(width.tolist())))
