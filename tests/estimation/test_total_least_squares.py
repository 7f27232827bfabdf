"""Total least squares removes the pull to zero that noise in the columns makes, where there is a solution at all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rough_logs import EXPECTED, clean, problem_of, run, torque_error
from scipy.linalg import eigh

from tauhat.errors import ModelError
from tauhat.estimation import Evidence, OrdinaryLeastSquares, TotalLeastSquares, WeightedLeastSquares
from tauhat.estimation.block import Block
from tauhat.estimation.total_least_squares import Scales, total_covariance, total_fit

TRUE = np.array([1.0, -2.0, 0.5, 3.0])
ONE_JOINT = TotalLeastSquares(power=0.0)


def noisy(
    seed: int, *, part: float = 0.2, n_t: int = 800, blocks: int = 16, exact: tuple[int, ...] = ()
) -> tuple[Evidence, np.ndarray]:
    """Return evidence of one joint whose columns and torque all have errors of `part` of their norm, and its rows."""
    rng = np.random.default_rng(seed)
    columns = rng.normal(size=(n_t, 4)) * [1.0, 0.3, 5.0, 0.8] + [0.0, 0.0, 0.0, 2.0]
    torque = columns @ TRUE
    rows = np.column_stack([columns, torque])
    sizes = part * np.sqrt(np.mean(rows**2, axis=0))
    sizes[list(exact)] = 0.0
    rows = rows + sizes * rng.normal(size=rows.shape)
    parts = tuple(Block(factors=(piece,), n_t=len(piece)).reduced() for piece in np.array_split(rows, blocks))
    return Evidence(supports=(np.arange(4),), n_b=4, blocks=parts), rows


def test_it_is_the_smallest_singular_vector_of_scaled_columns_and_torque():
    evidence, rows = noisy(0)
    norms = np.linalg.norm(rows, axis=0)
    last = np.linalg.svd(rows / norms)[2][-1]
    expected = -last[:-1] / last[-1] * norms[-1] / norms[:-1]
    np.testing.assert_allclose(ONE_JOINT.fit(evidence).values, expected, rtol=1e-9)


def test_with_exact_columns_it_is_the_generalised_eigenvector():
    evidence, rows = noisy(1, exact=(3,))
    sizes = np.linalg.norm(rows, axis=0)
    sizes[3] = 0.0
    found = total_fit(evidence, np.ones(1), Scales(sizes[:-1], float(sizes[-1])))
    # min |[A b] v|^2 over v' D v is the largest eigenvalue of D against the Gram matrix, which is regular.
    _, vectors = eigh(np.diag(sizes**2), rows.T @ rows)
    np.testing.assert_allclose(found.values, -vectors[:-1, -1] / vectors[-1, -1], rtol=1e-7)


def test_noise_in_the_columns_biases_least_squares_and_not_this():
    total, ordinary = [], []
    for seed in range(40):
        evidence, _ = noisy(seed)
        total.append(ONE_JOINT.fit(evidence).values)
        ordinary.append(OrdinaryLeastSquares().fit(evidence).values)
    spread = np.std(total, axis=0, ddof=1) / np.sqrt(len(total))
    assert np.abs((np.mean(total, axis=0) - TRUE) / spread).max() < 3.5
    off = np.abs(np.mean(ordinary, axis=0) - TRUE)
    assert (off > 5.0 * np.std(ordinary, axis=0, ddof=1) / np.sqrt(len(total))).sum() >= 2


def test_95_percent_intervals_cover_the_truth():
    from scipy.stats import t as student

    hits = []
    for seed in range(60):
        solution = ONE_JOINT.fit(noisy(seed)[0])
        half = student.ppf(0.975, solution.degrees) * np.sqrt(np.diag(solution.covariance))
        hits.append(np.abs(solution.values - TRUE) <= half)
    assert 0.90 <= np.mean(hits) <= 0.99


def test_error_bars_are_those_of_solving_without_each_block():
    evidence, rows = noisy(2, part=0.1, blocks=8)
    sizes = np.linalg.norm(rows, axis=0)
    scales = Scales(sizes[:-1], float(sizes[-1]))
    values = total_fit(evidence, np.ones(1), scales).values
    left = [evidence.of_blocks(evidence.blocks[:k] + evidence.blocks[k + 1 :]) for k in range(8)]
    moves = np.array([total_fit(part, np.ones(1), scales).values for part in left]) - values
    spread = np.sqrt(7 / 8 * np.sum(moves**2, axis=0))
    honest = np.sqrt(np.diag(total_covariance(evidence, np.ones(1), scales, values)))
    assert (honest >= 0.97 * spread).all()
    assert (honest[spread > 0.8 * honest] < 1.1 * spread[spread > 0.8 * honest]).all()
    assert (spread > 0.8 * honest).any()


def test_a_large_error_of_the_torque_alone_is_weighted_least_squares():
    problem = clean(0)
    solution = TotalLeastSquares(torque_error=1e6).fit_problem(problem)
    np.testing.assert_allclose(solution.values, WeightedLeastSquares().fit(problem.evidence).values, rtol=1e-6)


def test_on_a_good_log_it_is_as_good_as_weighted_least_squares():
    problem = clean(1)
    solution = TotalLeastSquares().fit_problem(problem)
    assert torque_error(solution.values, problem) < 1.5 * torque_error(
        WeightedLeastSquares().fit(problem.evidence).values, problem
    )
    assert "stands" in solution.cause
    assert solution.advice == ""


def test_offsets_are_exact():
    problem = clean(2)
    assert not np.array_equal(
        TotalLeastSquares().fit_problem(problem).values, TotalLeastSquares(exact=()).fit_problem(problem).values
    )
    assert np.array_equal(
        TotalLeastSquares(exact=()).fit_problem(problem).values, TotalLeastSquares().fit(problem.evidence).values
    )


def test_where_no_solution_exists_that_is_said_and_weighted_least_squares_given():
    rows = np.zeros((64, 3))
    rows[:, 0] = np.repeat([1.0, -1.0], 32)
    rows[:, 1] = np.tile([1e-3, -1e-3], 32)
    rows[:, 2] = np.tile([2.0, 2.0, -2.0, -2.0], 16)  # at right angles to both columns: nothing explains it
    evidence = Evidence(supports=(np.arange(2),), n_b=2, blocks=(Block(factors=(rows,), n_t=64).reduced(),))
    assert total_fit(evidence, np.ones(1), Scales(np.ones(2), 1.0)) is None
    scales = ONE_JOINT.scales(evidence, np.ones(1))
    assert total_fit(evidence, np.ones(1), scales) is None
    solution = ONE_JOINT.fit(evidence)
    assert solution.cause.startswith("total least squares has no solution here (nongeneric)")
    assert "keep wls" in solution.advice
    np.testing.assert_allclose(solution.values, WeightedLeastSquares(power=0.0).fit(evidence).values, atol=1e-12)


def test_errors_as_large_as_the_weakest_parameter_are_warned_of():
    evidence, _ = noisy(0, part=1.0)
    assert "errors are magnified" in ONE_JOINT.fit(evidence).advice


def test_too_few_rows_are_refused():
    problem = problem_of(run(0))
    block = replace(problem.evidence.total, n_t=EXPECTED.size // 2)
    with pytest.raises(ModelError, match="cannot determine"):
        TotalLeastSquares().fit(replace(problem.evidence, blocks=(block,)))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"torque_error": 0.0}, "error of the torque must be positive"),
        ({"ridge": 0.1}, "takes no ridge"),
        ({"power": -1.0}, "expected 0 to 2, got -1.0"),
    ],
)
def test_settings_out_of_range_are_refused(settings, message):
    with pytest.raises(ModelError, match=message):
        TotalLeastSquares(**settings)
