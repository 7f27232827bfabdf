"""Error bars are honest: intervals cover the truth as often as they say, also where residuals are autocorrelated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import t as student

from sample_arms import autocorrelated_noise, planar_truth
from tauhat.dynamics import base_parameters
from tauhat.estimation import OrdinaryLeastSquares, collect, identify
from tauhat.estimation.solution import Solution, time_groups
from tauhat.recordings.processing import Processing

SETTINGS = Processing(cutoff=10.0, motion_cutoff=30.0)
SEEDS = range(60)
RATE, SECONDS, SIZE = 200.0, 20.0, 0.3
TRUTH = planar_truth()


def white_noise(seed: int) -> np.ndarray:
    return SIZE * np.random.default_rng(seed).normal(size=(round(SECONDS * RATE), 2))


def coloured_noise(seed: int) -> np.ndarray:
    shape = (round(SECONDS * RATE), 2)
    return SIZE * autocorrelated_noise(np.random.default_rng(seed), shape, time_constant=0.2, rate=RATE)


@pytest.mark.parametrize("noise", [white_noise, coloured_noise])
def test_95_percent_intervals_of_identify_cover_the_truth(noise):
    hits = []
    for seed in SEEDS:
        estimate = identify(TRUTH.model, [TRUTH.recording(noise=noise(seed))], processing=SETTINGS)
        half_width = student.ppf(0.975, estimate.degrees) * estimate.standard_errors
        error = estimate.values - estimate.base.projection @ TRUTH.standard
        hits.append(np.abs(error) < half_width)
    coverage = np.mean(hits, axis=0)
    assert 0.90 <= coverage.mean() <= 0.99
    assert coverage.min() >= 0.75


def white_noise_errors(matrix: np.ndarray, torque: np.ndarray, rows: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the ordinary solution and its textbook standard errors, `s^2 (A'A)^-1`."""
    values, squares, _, _ = np.linalg.lstsq(matrix, torque, rcond=None)
    variance = squares[0] / (rows - values.size)
    return values, np.sqrt(variance * np.diag(np.linalg.inv(matrix.T @ matrix)))


def test_the_white_noise_formula_does_not_cover_when_residuals_are_autocorrelated():
    base = base_parameters(TRUTH.model)
    expected = base.projection @ TRUTH.standard
    hits = []
    for seed in SEEDS:
        evidence = collect(TRUTH.model, base, TRUTH.recording(noise=coloured_noise(seed)), SETTINGS)
        total = evidence.total
        stacked = np.zeros((sum(len(factor) for factor in total.factors), base.n_b + 1))
        start = 0
        for support, factor in zip(evidence.supports, total.factors, strict=True):
            stacked[start : start + len(factor), [*support, base.n_b]] = factor
            start += len(factor)
        values, errors = white_noise_errors(stacked[:, :-1], stacked[:, -1], 2 * evidence.n_t)
        hits.append(np.abs(values - expected) < 1.96 * errors)
    assert np.mean(hits) < 0.8


def fitted(seed: int) -> tuple[Solution, int]:
    base = base_parameters(TRUTH.model)
    evidence = collect(TRUTH.model, base, TRUTH.recording(noise=coloured_noise(seed)), SETTINGS)
    return OrdinaryLeastSquares().fit(evidence), len(time_groups(evidence))


def test_errors_are_those_of_solving_without_each_group_of_blocks():
    base = base_parameters(TRUTH.model)
    evidence = collect(TRUTH.model, base, TRUTH.recording(noise=coloured_noise(0)), SETTINGS)
    solution = OrdinaryLeastSquares().fit(evidence)
    groups = time_groups(evidence)
    count = len(groups)
    assert 8 <= count <= 16
    rest = [replace(evidence, blocks=groups[:k] + groups[k + 1 :]) for k in range(count)]
    moves = [OrdinaryLeastSquares().fit(part).values - solution.values for part in rest]
    spread = np.sqrt((count - 1) / count * np.sum(np.square(moves), axis=0))
    assert np.allclose(np.sqrt(np.diag(solution.covariance)), spread, rtol=1e-6)


def test_covariance_is_symmetric_positive_definite_with_as_many_degrees_as_groups_less_one():
    solution, groups = fitted(1)
    assert np.allclose(solution.covariance, solution.covariance.T)
    assert np.linalg.eigvalsh(solution.covariance).min() > 0
    assert solution.degrees == groups - 1


def test_errors_fall_with_the_square_root_of_the_time():
    base = base_parameters(TRUTH.model)
    sizes = []
    for seconds in (20.0, 80.0):
        noise = SIZE * np.random.default_rng(3).normal(size=(round(seconds * RATE), 2))
        evidence = collect(TRUTH.model, base, TRUTH.recording(noise=noise, seconds=seconds), SETTINGS)
        sizes.append(np.sqrt(np.diag(OrdinaryLeastSquares().fit(evidence).covariance)))
    assert np.median(sizes[0] / sizes[1]) == pytest.approx(2.0, rel=0.25)


def test_one_block_falls_back_to_the_white_noise_formula():
    base = base_parameters(TRUTH.model)
    evidence = collect(TRUTH.model, base, TRUTH.recording(noise=white_noise(0)), SETTINGS)
    single = replace(evidence, blocks=(evidence.total,))
    solution = OrdinaryLeastSquares().fit(single)
    assert solution.degrees == 2 * evidence.n_t - base.n_b
    assert np.array_equal(solution.values, OrdinaryLeastSquares().fit(single).values)
    assert (np.diag(solution.covariance) > 0).all()
