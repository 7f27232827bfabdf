"""A pull is as strong as left-out time says it should be: none where the log is rich, much where it says little."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rough_logs import BASE, EXPECTED, TRUTH, clean, covered, problem_of, torque_error, white

from tauhat.dynamics.nominal import nominal_standard_parameters
from tauhat.errors import ModelError
from tauhat.estimation import PriorLeastSquares, RidgeLeastSquares, WeightedLeastSquares
from tauhat.estimation.prior import Pull, chosen_deviation
from tauhat.estimation.problem import Problem
from tauhat.recordings import Recording

METHODS = [RidgeLeastSquares(), PriorLeastSquares()]


def weak(seed: int) -> Problem:
    """Return a slow short motion under heavy noise: the log hardly shows the inertial parameters."""
    t = np.arange(0.0, 6.0, 0.005)
    rng = np.random.default_rng(seed)
    rate, size = 2.0 * np.pi * rng.uniform(0.3, 0.4, 2), rng.uniform(0.2, 0.3, 2)
    q, dq, ddq = size * np.sin(t[:, None] * rate), size * rate * np.cos(t[:, None] * rate), 0.0
    ddq = -size * rate**2 * np.sin(t[:, None] * rate)
    tau = TRUTH.torque(q, dq, ddq) + white(seed, size=1.5, seconds=6.0)
    return problem_of(Recording(t=t, q=q, dq=dq, tau=tau))


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.key)
def test_a_fixed_strength_is_least_squares_with_rows_of_the_prior(method):
    problem = clean(0)
    evidence = problem.evidence
    solution = replace(method, deviation=0.05).fit_problem(problem)
    weights = WeightedLeastSquares().fit(evidence).weights
    rows = np.vstack([w * f for w, f in zip(weights, _spread(problem), strict=True)])
    pull = method.pull(evidence, weights, problem)
    free = np.linalg.lstsq(rows[:, :-1], rows[:, -1], rcond=None)
    variance = np.sum((rows[:, :-1] @ free[0] - rows[:, -1]) ** 2) / (2 * evidence.n_t - BASE.n_b)
    pulling = np.sqrt(variance) / 0.05 * np.linalg.inv(pull.root)
    both = np.vstack([rows[:, :-1], pulling])
    right = np.concatenate([rows[:, -1], pulling @ pull.centre])
    np.testing.assert_allclose(solution.values, np.linalg.lstsq(both, right, rcond=None)[0], rtol=1e-6, atol=1e-8)
    assert solution.cause == "solved with the deviation that was given"


def _spread(problem: Problem) -> list[np.ndarray]:
    parts = []
    for place, factor in zip(problem.evidence.supports, problem.evidence.total.factors, strict=True):
        part = np.zeros((len(factor), BASE.n_b + 1))
        part[:, [*place, BASE.n_b]] = factor
        parts.append(part)
    return parts


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.key)
def test_a_weak_pull_is_weighted_least_squares_and_a_strong_one_its_centre(method):
    problem = clean(1)
    free = WeightedLeastSquares().fit(problem.evidence)
    np.testing.assert_allclose(replace(method, deviation=1e6).fit_problem(problem).values, free.values, rtol=1e-4)
    centre = method.pull(problem.evidence, free.weights, problem).centre
    pulled = replace(method, deviation=1e-9).fit_problem(problem).values
    np.testing.assert_allclose(pulled, centre, atol=1e-5 * np.abs(EXPECTED).max())


def test_the_nominal_robot_is_what_the_prior_pulls_to():
    robot = TRUTH.model.robot
    standard = nominal_standard_parameters(TRUTH.model)
    np.testing.assert_array_equal(standard[: robot.inertia.size], robot.inertia.ravel())
    assert not standard[robot.inertia.size :].any()
    problem = clean(0)
    pull = PriorLeastSquares().pull(problem.evidence, np.ones(2), problem)
    np.testing.assert_allclose(pull.centre, BASE.projection @ standard)
    covariance = pull.root @ pull.root.T
    assert np.linalg.eigvalsh(covariance / np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))).min() > 0.0


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.key)
def test_a_pull_helps_where_the_log_says_little(method):
    pulled, free = [], []
    for seed in range(12):
        problem, judge = weak(seed), clean(seed)
        pulled.append(torque_error(method.fit_problem(problem).values, judge))
        free.append(torque_error(WeightedLeastSquares().fit(problem.evidence).values, judge))
    assert np.median(pulled) < 0.7 * np.median(free)


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.key)
def test_on_a_rich_log_it_is_no_worse_and_intervals_cover_the_truth(method):
    hits, ratios = [], []
    for seed in range(16):
        problem = clean(seed)
        solution = method.fit_problem(problem)
        hits.append(covered(solution))
        free = torque_error(WeightedLeastSquares().fit(problem.evidence).values, problem)
        ratios.append(torque_error(solution.values, problem) / free)
    assert np.median(ratios) < 1.05
    assert 0.90 <= np.mean(hits) <= 0.997


def test_a_wrong_prior_is_let_go():
    problem = clean(3)
    weights = WeightedLeastSquares().fit(problem.evidence).weights
    wrong = Pull(EXPECTED + 3.0 * np.abs(EXPECTED) + 1.0, 0.3 * np.diag(np.abs(EXPECTED) + 0.1))
    right = Pull(EXPECTED, wrong.root)
    assert chosen_deviation(problem.evidence, weights, wrong).deviation > 1.0
    trusted = chosen_deviation(problem.evidence, weights, right)
    assert trusted.deviation < 0.1
    assert trusted.error < 1.0


def test_what_was_chosen_is_told():
    assert "left-out blocks of time" in RidgeLeastSquares().fit_problem(weak(0)).cause
    whole = replace(clean(0).evidence, blocks=(clean(0).evidence.total,))
    solution = RidgeLeastSquares().fit(whole)
    assert solution.cause == "solved without pull: too little data to leave any of it out"
    np.testing.assert_allclose(solution.values, WeightedLeastSquares().fit(whole).values, rtol=1e-8)
    assert RidgeLeastSquares().solve(whole).values == pytest.approx(solution.values)


def test_without_a_robot_the_prior_is_the_ridge():
    evidence = weak(1).evidence
    np.testing.assert_array_equal(PriorLeastSquares().fit(evidence).values, RidgeLeastSquares().fit(evidence).values)


@pytest.mark.parametrize(
    ("settings", "message"),
    [({"deviation": 0.0}, "deviation of a prior must be positive"), ({"ridge": 1.0}, "takes the place of the ridge")],
)
def test_settings_out_of_range_are_refused(settings, message):
    with pytest.raises(ModelError, match=message):
        PriorLeastSquares(**settings)
