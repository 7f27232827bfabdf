"""Closed-loop output and input error: recovery, sensitivities, and what they refuse."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_logs import driven, errors_of, problem, relative_bias

from tauhat.errors import ModelError
from tauhat.estimation.closed_loop import ClosedLoop
from tauhat.estimation.output_error import ClosedLoopInputError, ClosedLoopOutputError
from tauhat.estimation.simulated_runs import simulated_runs
from tauhat.estimation.simulating import tried_in

METHODS = (ClosedLoopOutputError, ClosedLoopInputError)


@pytest.mark.parametrize("method", METHODS)
def test_noise_of_position_and_torque_leaves_no_bias(method):
    errors, inside = errors_of(method(loop=driven().loop, threads=1), seeds=6)
    assert np.abs(relative_bias(errors)).max() < 0.025
    assert inside.mean() > 0.85


@pytest.mark.parametrize("method", METHODS)
def test_from_far_away_it_comes_back_to_the_truth(method):
    arm = driven()
    loop = arm.loop
    given = problem(arm.recording(np.random.default_rng(0), torque=1e-3))
    estimator = method(loop=loop, threads=1)
    runs = simulated_runs(given, loop)
    tried = tried_in(runs, 1.3 * arm.values)
    for _ in range(4):
        tried = tried_in(runs, estimator.improved(runs, tried).values)
    assert np.abs(tried.values - arm.values).max() < 0.01 * np.abs(arm.values).max()


@pytest.mark.parametrize("method", METHODS)
def test_sensitivities_are_the_change_of_the_output(method):
    arm = driven()
    given = problem(arm.recording(np.random.default_rng(0)))
    runs = simulated_runs(given, arm.loop)
    tried = tried_in(runs, arm.values)
    run = runs.runs[0]
    estimator = method(loop=arm.loop, threads=1)
    evidence = estimator.improved(runs, tried).evidence
    change = 0.02 * arm.values
    after = runs.moved(run, arm.values + change)
    expected = estimator._filtered(runs, run, estimator.simulated(after) - estimator.simulated(tried.motions[0]))[1]
    for joint, factor in enumerate(evidence.total.factors):
        linear = np.linalg.norm(factor[:, :-1] @ change)
        assert linear == pytest.approx(np.linalg.norm(expected[joint]), rel=0.05)


def test_threads_change_nothing():
    arm = driven()
    given = problem(arm.recording(np.random.default_rng(0), position=1e-4))
    one, two = (ClosedLoopOutputError(loop=arm.loop, threads=n).fit_problem(given) for n in (1, 2))
    np.testing.assert_array_equal(one.values, two.values)


@pytest.mark.parametrize(
    "loop", [ClosedLoop(), ClosedLoop(law=driven().loop.law), ClosedLoop(references=driven().loop.references)]
)
def test_output_error_without_the_robots_own_law_and_reference_is_refused(loop):
    given = problem(driven().recording(np.random.default_rng(0)))
    with pytest.raises(ModelError, match=r"says nothing without the robot's own law and reference; give both"):
        ClosedLoopOutputError(loop=loop).fit_problem(given)


@pytest.mark.parametrize("settings", [{"difference": 0.0}, {"threads": -1}])
def test_impossible_settings_are_refused(settings):
    with pytest.raises(ModelError, match=r"cloe: (difference|threads)"):
        ClosedLoopOutputError(**settings)
