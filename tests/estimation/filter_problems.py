"""Problems on the two-link arm whose every parameter is known, for estimators that go through the recordings."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from sample_arms import Truth, planar_truth
from tauhat.arrays import FloatArray
from tauhat.dynamics import base_parameters
from tauhat.estimation.evidence import collect_all
from tauhat.estimation.problem import Problem
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording

SETTINGS = Processing(cutoff=10.0, motion_cutoff=30.0)
TORQUE_NOISE, POSITION_NOISE = 0.1, 1e-4


@lru_cache
def truth() -> Truth:
    return planar_truth()


@lru_cache
def true_values() -> FloatArray:
    return base_parameters(truth().model).projection @ truth().standard


def names() -> list[str]:
    base = base_parameters(truth().model)
    return [base.names[index] for index in base.independent]


def noisy(recording: Recording, seed: int) -> Recording:
    rng = np.random.default_rng(seed)
    return Recording(
        t=recording.t,
        q=recording.q + POSITION_NOISE * rng.normal(size=recording.q.shape),
        tau=recording.tau + TORQUE_NOISE * rng.normal(size=recording.q.shape),
        name=recording.name,
    )


def problem_of(*recordings: Recording) -> Problem:
    model = truth().model
    base = base_parameters(model)
    evidence = collect_all(model, base, recordings, SETTINGS)
    return Problem(model=model, base=base, recordings=recordings, processing=SETTINGS, evidence=evidence)


@lru_cache
def exact_problem() -> Problem:
    return problem_of(truth().recording(seconds=8.0, rate=500.0))


@lru_cache
def noisy_problem(seed: int, seconds: float = 8.0) -> Problem:
    return problem_of(noisy(truth().recording(seed=seed, seconds=seconds, rate=500.0), seed))
