"""The parallel model: its regressor is the right one, its Lyapunov function falls, and it finds the parameters."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from filter_problems import exact_problem, noisy_problem, true_values, truth

from sample_arms import motion_from_rest
from tauhat.blas import single_threaded
from tauhat.errors import ModelError, TauhatWarning
from tauhat.estimation.filters import AdaptiveInputError, Given, Nominal, ParallelModel, ParallelState
from tauhat.estimation.filters.adaptive import DrivenSample, parallel_model
from tauhat.estimation.solution import joint_residuals
from tauhat.recordings.processing import Stretch

SETTINGS = AdaptiveInputError(time=2.0)


def exact_motion(step: float, seconds: float = 8.0) -> Stretch:
    t = np.arange(0.0, seconds, step)
    q, dq, ddq = motion_from_rest(2, t, seed=0)
    return Stretch(t, q.T.copy(), dq.T.copy(), ddq.T.copy(), truth().torque(q, dq, ddq).T.copy())


def beside(motion: Stretch, values: np.ndarray) -> ParallelModel:
    return parallel_model(exact_problem(), motion, values, settings=SETTINGS)


def wrong_values() -> np.ndarray:
    return true_values() * (1.0 + 0.2 * np.random.default_rng(1).normal(size=true_values().size))


@lru_cache
@single_threaded
def lyapunov(step: float) -> tuple[np.ndarray, np.ndarray]:
    """Return V at every sample, and what the proof says it loses by the next, s'K s h."""
    motion = exact_motion(step)
    parallel = beside(motion, wrong_values())
    state = ParallelState(motion.q[:, 0], motion.dq[:, 0], wrong_values())
    levels, losses = [], []
    for k, t in enumerate(motion.t):
        s, error = motion.dq[:, k] - state.v, state.values - true_values()
        level = 0.5 * s @ parallel.mass(motion.q[:, k], true_values()) @ s
        levels.append(level + 0.5 * error @ np.linalg.solve(parallel.learning, error))
        losses.append(step * s @ (parallel.gain * s))
        sample = DrivenSample(float(t), motion.q[:, k], motion.dq[:, k], motion.tau[:, k])
        state, _ = parallel.stepped(state, sample)
    return np.array(levels), np.array(losses)


def test_the_lyapunov_function_never_rises_without_noise():
    levels, losses = lyapunov(2e-3)
    assert np.diff(levels).max() < 1e-5 * levels[0]
    assert levels[-1] < 0.1 * levels[0]
    assert abs(levels[-1] + losses.sum() - levels[0]) < 0.01 * levels[0]


def test_what_little_it_rises_is_of_the_integrators_order():
    coarse, fine = (np.diff(lyapunov(step)[0]).max() for step in (4e-3, 2e-3))
    assert max(fine, 0.0) < 0.4 * coarse


def test_at_the_robots_own_motion_the_regressor_is_the_models():
    motion = exact_motion(2e-3)
    parallel = beside(motion, true_values())
    state = ParallelState(motion.q[:, 700], motion.dq[:, 700], true_values())
    sample = DrivenSample(0.0, motion.q[:, 700], motion.dq[:, 700], motion.tau[:, 700])
    after, seen = parallel.stepped(state, sample)
    assert np.allclose(seen.torque, 0.0)
    assert np.allclose((after.v - state.v) / parallel.step, motion.ddq[:, 700])
    assert np.allclose(seen.columns @ true_values(), motion.tau[:, 700])


def test_the_coriolis_matrix_is_the_one_that_makes_the_proof_work():
    motion = exact_motion(2e-3)
    parallel = beside(motion, true_values())
    rigid = np.where(parallel.braking, 0.0, true_values())
    q, dq, s = np.array([0.4, -1.1]), np.array([0.7, -1.3]), np.array([0.9, 0.5])

    def coriolis(v):
        at = ParallelModel._regressors(parallel, q, dq, v)[0] @ rigid
        rest = ParallelModel._regressors(parallel, q, dq, np.zeros(2))[0] @ rigid
        return at - rest

    h = 1e-6
    change = (parallel.mass(q + h * dq, rigid) - parallel.mass(q - h * dq, rigid)) / (2.0 * h)
    assert np.isclose(0.5 * s @ change @ s, s @ coriolis(s), atol=1e-7)
    assert np.allclose(coriolis(2.0 * s), 2.0 * coriolis(s))


@pytest.mark.parametrize("seed", range(2))
def test_parameters_are_found_online_inside_their_errors(seed):
    solution = AdaptiveInputError(time=2.0).fit_problem(noisy_problem(seed))
    assert (np.abs(solution.values - true_values()) < 4.5 * np.sqrt(np.diag(solution.covariance))).all()
    assert solution.cause == "3 passes done"


def test_from_the_description_without_friction_the_parameters_come_near():
    solution = AdaptiveInputError(beginning=Nominal(), time=2.0, passes=4).fit_problem(noisy_problem(0))
    assert np.linalg.norm(solution.values - true_values()) < 0.05 * np.linalg.norm(true_values())


def test_a_model_that_runs_away_is_stopped():
    huge = Given(values=tuple(true_values() * 1e-3), deviations=(1.0,) * true_values().size)
    with pytest.warns(TauhatWarning, match="stopped at"):
        solution = AdaptiveInputError(beginning=huge, time=1e-4).fit_problem(exact_problem())
    problem = exact_problem()
    first, last = (
        np.linalg.norm(joint_residuals(problem.evidence, x)) for x in (np.array(huge.values), solution.values)
    )
    assert last <= first


def test_a_beginning_without_inertia_is_refused():
    nothing = Given(values=(0.0,) * true_values().size, deviations=(1.0,) * true_values().size)
    with pytest.raises(ModelError, match="no inertia"):
        AdaptiveInputError(beginning=nothing).fit_problem(exact_problem())


def test_too_slow_a_clock_and_bad_settings_are_refused():
    with pytest.raises(ModelError, match="too slow for the bandwidth"):
        replace(SETTINGS, bandwidth=100.0).fit_problem(exact_problem())
    with pytest.raises(ModelError, match="time"):
        AdaptiveInputError(time=0.0)
    with pytest.raises(ModelError, match="pass"):
        AdaptiveInputError(passes=0)
