"""Closed-loop logs with a known truth: simulated by Runge-Kutta in fine steps, other than what the estimators use."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from sample_arms import Truth, motion_from_rest, planar_truth
from tauhat.arrays import FloatArray
from tauhat.blas import single_threaded
from tauhat.control import PDGravity
from tauhat.dynamics import BaseParameters, base_parameters, gravity_torque
from tauhat.dynamics.simulated_arm import Followed, Gains, Moved, Stepping, follow, simulated_arm
from tauhat.estimation import Estimator, collect
from tauhat.estimation.closed_loop import ClosedLoop, SampledReference
from tauhat.estimation.problem import Problem
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording

SEEDS = 20
RATE = 250.0
SECONDS = 8.0
LAW = PDGravity(kp=np.array([500.0, 200.0]), kd=np.array([40.0, 15.0]))
# A motion cut-off of 90 Hz at 250 Hz lets nearly all noise of a differentiated position through.
LATE = Processing(cutoff=40.0, motion_cutoff=90.0)


@dataclass(frozen=True)
class Driven:
    """A planar arm under its law, without noise."""

    truth: Truth
    t: FloatArray
    moved: Moved
    loop: ClosedLoop

    @property
    def values(self) -> FloatArray:
        """True base parameters."""
        return planar_base().projection @ self.truth.standard

    def recording(self, rng: np.random.Generator, *, position: float = 0.0, torque: float = 0.05) -> Recording:
        """Return the log with white noise of these deviations on every joint."""
        q, tau = self.moved.q.T, self.moved.tau.T
        noisy = (q + position * rng.normal(size=q.shape), tau + torque * rng.normal(size=tau.shape))
        return Recording(t=self.t, q=noisy[0], tau=noisy[1], name="driven")


@cache
def driven(seconds: float = SECONDS) -> Driven:
    """Return the arm following a motion that only the controller knows."""
    truth = planar_truth()
    t = np.arange(0.0, seconds, 1.0 / RATE)
    q, dq, ddq = motion_from_rest(2, t, seed=3)
    robot = truth.model.robot
    gains = Gains(LAW.kp, LAW.kd, LAW.integral_gain, LAW.torque_limit)
    asked = Followed(q, dq, gravity_torque(robot, q))
    stepping = Stepping(1.0 / RATE, 8, 0, "runge-kutta")
    start = np.array([q[0], dq[0]])
    moved = follow(simulated_arm(truth.model), truth.standard, asked, gains=gains, start=start, stepping=stepping)
    reference = SampledReference(t=t, q=q, dq=dq, ddq=ddq)
    return Driven(truth, t, moved, ClosedLoop(law=LAW, references=(reference,)))


@cache
def planar_base() -> BaseParameters:
    return base_parameters(planar_truth().model)


def problem(recording: Recording, *, processing: Processing = LATE) -> Problem:
    """Return the problem of identifying the planar arm, shapes known."""
    model, base = driven().truth.model, planar_base()
    evidence = collect(model, base, recording, processing)
    return Problem(model=model, base=base, recordings=(recording,), processing=processing, evidence=evidence)


@single_threaded
def errors_of(
    method: Estimator,
    *,
    position: float = 1e-4,
    torque: float = 0.05,
    processing: Processing = LATE,
    seeds: int = SEEDS,
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return errors (n_seeds, n_b) and whether the truth is inside the 95 % intervals."""
    arm = driven()
    errors, inside = [], []
    for seed in range(seeds):
        log = arm.recording(np.random.default_rng(seed), position=position, torque=torque)
        solution = method.fit_problem(problem(log, processing=processing))
        errors.append(solution.values - arm.values)
        half = stdtrit(solution.degrees, 0.975) * np.sqrt(np.diag(solution.covariance))
        inside.append(np.abs(errors[-1]) <= half)
    return np.array(errors), np.array(inside)


def relative_bias(errors: FloatArray) -> FloatArray:
    """Return the mean errors in parts of the parameters, (n_b,); those near zero in parts of 0.05."""
    return errors.mean(axis=0) / np.maximum(np.abs(driven().values), 0.05)
