"""Maximum likelihood finds the noise that joints share, and uses it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rough_logs import BASE, EXPECTED, RATE, SECONDS, SIZE, clean, covered, problem_of, run
from scipy.linalg import block_diag, cho_factor, cho_solve
from scipy.optimize import minimize

from tauhat.errors import ModelError
from tauhat.estimation import MaximumLikelihood, WeightedLeastSquares
from tauhat.estimation.problem import Problem
from tauhat.estimation.repeated_rows import repeated_rows

SHARED = np.array([[1.0, 0.95], [0.95, 1.0]])


def shared(seed: int) -> Problem:
    """Return a problem whose joints' noise has a correlation of 0.95."""
    rng = np.random.default_rng(seed)
    noise = SIZE * rng.multivariate_normal(np.zeros(2), SHARED, size=round(SECONDS * RATE))
    return problem_of(run(seed, noise=noise))


def dense(problem: Problem) -> tuple[np.ndarray, np.ndarray]:
    """Return the regressor (n_t, n_v, n_b) and torque (n_t, n_v) of a problem's rows."""
    rows = repeated_rows(problem)
    piece = rows.kept[0]
    regressor = np.zeros((piece.t.size, 2, BASE.n_b))
    for joint, place in enumerate(rows.places):
        regressor[:, joint, place] = piece.columns[rows.layout.of_joint(joint)].T
    return regressor, piece.tau.T


def test_the_solution_is_generalised_least_squares_with_its_own_covariance():
    problem = shared(0)
    solution = MaximumLikelihood().fit_problem(problem)
    regressor, torque = dense(problem)
    residual = torque - regressor @ solution.values
    noise = residual.T @ residual / len(torque)
    factor = cho_factor(block_diag(*[noise] * len(torque)))
    stacked, right = regressor.reshape(-1, BASE.n_b), torque.ravel()
    gram = stacked.T @ cho_solve(factor, stacked)
    expected = np.linalg.solve(gram, stacked.T @ cho_solve(factor, right))
    np.testing.assert_allclose(solution.values, expected, rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(solution.weights, np.diag(noise) ** -0.5, rtol=1e-4)


def test_no_other_parameters_are_likelier():
    problem = shared(1)
    regressor, torque = dense(problem)

    def lack(values: np.ndarray) -> float:
        residual = torque - regressor @ values
        return float(np.linalg.slogdet(residual.T @ residual)[1])

    found = MaximumLikelihood(tolerance=1e-10).fit_problem(problem).values
    best = minimize(lack, found, method="BFGS")
    assert lack(found) <= best.fun + 1e-7
    assert lack(WeightedLeastSquares(power=1.0).fit(problem.evidence).values) > lack(found) + 1e-4


def test_shared_noise_is_used_without_bias():
    likely, weighted = [], []
    for seed in range(20):
        problem = shared(seed)
        likely.append(MaximumLikelihood().fit_problem(problem).values - EXPECTED)
        weighted.append(WeightedLeastSquares().fit(problem.evidence).values - EXPECTED)
    spread = np.std(likely, axis=0, ddof=1)
    assert np.median(spread / np.std(weighted, axis=0, ddof=1)) < 0.75
    assert np.abs(np.mean(likely, axis=0) / (spread / np.sqrt(20))).max() < 4.0


@pytest.mark.parametrize("make", [shared, clean])
def test_95_percent_intervals_cover_the_truth(make):
    hits = [covered(MaximumLikelihood().fit_problem(make(seed))) for seed in range(20)]
    assert 0.88 <= np.mean(hits) <= 0.99


def test_what_is_shared_is_told():
    assert "j1 and j2, correlation 0.9" in MaximumLikelihood().fit_problem(shared(2)).advice
    solution = MaximumLikelihood().fit_problem(clean(0))
    assert solution.advice == "joints share no noise: wls with power 1 says the same"
    assert solution.cause.startswith("converged")
    assert MaximumLikelihood(passes=1).fit_problem(shared(2)).cause.startswith("stopped after 1 passes")


def test_noise_that_one_joint_copies_from_another_does_not_break_it():
    noise = SIZE * np.random.default_rng(0).normal(size=(round(SECONDS * RATE), 1))
    solution = MaximumLikelihood().fit_problem(problem_of(run(0, noise=np.repeat(noise, 2, axis=1))))
    assert np.isfinite(solution.covariance).all()
    assert np.abs(solution.values - EXPECTED).max() < 0.05


def test_a_log_that_is_read_again_gives_the_same(monkeypatch):
    problem = problem_of([run(1), run(2)])
    kept = MaximumLikelihood().fit_problem(problem)
    monkeypatch.setattr("tauhat.estimation.repeated_rows.MOST_BYTES", 0)
    again = MaximumLikelihood().fit_problem(problem)
    np.testing.assert_allclose(again.values, kept.values, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(again.covariance, kept.covariance, rtol=1e-5, atol=1e-10)


def test_evidence_alone_gives_weighted_least_squares():
    evidence = clean(0).evidence
    assert np.array_equal(
        MaximumLikelihood().fit(evidence).values, WeightedLeastSquares(power=1.0).fit(evidence).values
    )


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"passes": 0}, "at least one pass"),
        ({"tolerance": 1.0}, "tolerance out of range"),
        ({"least": 0.0}, "least out of range"),
        ({"ridge": 0.1}, "takes no ridge"),
    ],
)
def test_settings_out_of_range_are_refused(settings, message):
    with pytest.raises(ModelError, match=message):
        MaximumLikelihood(**settings)


def test_too_few_rows_are_refused():
    problem = problem_of(run(0))
    block = replace(problem.evidence.total, n_t=BASE.n_b // 2)
    with pytest.raises(ModelError, match="cannot determine"):
        MaximumLikelihood().fit_problem(replace(problem, evidence=replace(problem.evidence, blocks=(block,))))
