"""Problems on the planar arm of known truth, with the disturbances that estimators differ by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from sample_arms import planar_truth
from tauhat.dynamics import base_parameters
from tauhat.estimation import Estimator, Solution, collect_all
from tauhat.estimation.problem import Problem
from tauhat.estimation.repeated_rows import remembered
from tauhat.recordings import Recording
from tauhat.recordings.processing import Processing

SETTINGS = Processing(cutoff=10.0, motion_cutoff=30.0)
RATE, SECONDS, SIZE = 200.0, 20.0, 0.3
TRUTH = planar_truth()
BASE = base_parameters(TRUTH.model)
EXPECTED = BASE.projection @ TRUTH.standard


def white(seed: int, *, size: float = SIZE, seconds: float = SECONDS) -> np.ndarray:
    return size * np.random.default_rng(seed).normal(size=(round(seconds * RATE), 2))


def run(seed: int, *, noise: np.ndarray | None = None) -> Recording:
    return TRUTH.recording(seed=seed, noise=white(seed) if noise is None else noise)


def with_spikes(recording: Recording, seed: int, *, share: float = 0.05, size: float = 60.0) -> Recording:
    """Return the recording with single torque samples of either sign far off."""
    rng = np.random.default_rng([seed, 1])
    bad = rng.random(recording.tau.shape) < share
    return replace(recording, tau=recording.tau + bad * size * rng.choice([-1.0, 1.0], bad.shape))


def with_touches(recording: Recording, seed: int, *, share: float = 0.05, size: float = 8.0) -> Recording:
    """Return the recording with pushes of 0.25 s on the arm in `share` of the time."""
    rng = np.random.default_rng([seed, 2])
    length = round(0.25 * RATE)
    tau = np.array(recording.tau)
    for joint in range(tau.shape[1]):
        for start in rng.integers(length, len(tau) - 2 * length, round(share * len(tau) / length)):
            tau[start : start + length, joint] += size * rng.choice([-1.0, 1.0])
    return replace(recording, tau=tau)


def problem_of(recordings: Recording | Sequence[Recording]) -> Problem:
    logs = (recordings,) if isinstance(recordings, Recording) else tuple(recordings)
    evidence = collect_all(TRUTH.model, BASE, logs, SETTINGS)
    return Problem(model=TRUTH.model, base=BASE, recordings=logs, processing=SETTINGS, evidence=evidence)


@cache
def clean(seed: int) -> Problem:
    return remembered(problem_of(run(seed)))


@cache
def spiky(seed: int) -> Problem:
    return problem_of(with_spikes(run(seed), seed))


@cache
def touched(seed: int) -> Problem:
    return remembered(problem_of(with_touches(run(seed), seed)))


def fitted(method: Estimator, recordings: Recording | Sequence[Recording]) -> Solution:
    return method.fit_problem(problem_of(recordings))


def torque_error(values: np.ndarray, problem: Problem) -> float:
    """Return the error of the torque that wrong values make on a problem's motion, over the torque [1]."""
    parts = list(zip(problem.evidence.supports, problem.evidence.total.factors, strict=True))
    off = sum(np.sum((factor[:, :-1] @ (values - EXPECTED)[place]) ** 2) for place, factor in parts)
    return float(np.sqrt(off / sum(np.sum((factor[:, :-1] @ EXPECTED[place]) ** 2) for place, factor in parts)))


def covered(solution: Solution, *, confidence: float = 0.95) -> np.ndarray:
    from scipy.stats import t as student

    half = student.ppf(0.5 + 0.5 * confidence, solution.degrees) * np.sqrt(np.diag(solution.covariance))
    return np.abs(solution.values - EXPECTED) <= half
