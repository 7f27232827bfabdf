"""Essential parameters: what the data cannot see is dropped, what it sees stays, prediction gains."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from scipy.stats import f as fisher

from sample_arms import Truth, autocorrelated_noise, motion_from_rest, planar_truth
from tauhat.arrays import FloatArray
from tauhat.dynamics import BaseParameters, Motion, base_parameters
from tauhat.errors import ModelError
from tauhat.estimation import Evidence, OrdinaryLeastSquares, WeightedLeastSquares, collect
from tauhat.estimation.block import Block
from tauhat.estimation.essential import EssentialParameters, essential_parameters
from tauhat.recordings.processing import Processing

SETTINGS = Processing(cutoff=10.0, motion_cutoff=30.0)
SEEDS = range(24)
RATE, SECONDS, SIZE = 200.0, 30.0, 0.3
INVISIBLE = {"my_1", "my_2", "To_1", "To_2"}  # zero in truth
PLAIN = {"mx_1", "Izz_1", "mx_2", "Izz_2", "Fv_1", "Fv_2", "Fc_1", "Fc_2"}  # far above their errors


@lru_cache
def truth() -> Truth:
    """Return the planar arm without offsets: its y moments are zero, too."""
    whole = planar_truth()
    standard = whole.standard.copy()
    standard[-2:] = 0.0
    return Truth(whole.model, standard)


@lru_cache
def base() -> BaseParameters:
    return base_parameters(truth().model)


def names() -> list[str]:
    return [base().names[index] for index in base().independent]


@lru_cache
def evidence(seed: int) -> Evidence:
    shape = (round(SECONDS * RATE), 2)
    noise = SIZE * autocorrelated_noise(np.random.default_rng(seed), shape, time_constant=0.2, rate=RATE)
    recording = truth().recording(seed=seed, seconds=SECONDS, noise=noise)
    return collect(truth().model, base(), recording, SETTINGS)


@lru_cache
def found(seed: int) -> EssentialParameters:
    return essential_parameters(evidence(seed))


def test_parameters_that_are_zero_are_dropped_at_the_stated_rate():
    kept = [names()[index] for seed in SEEDS for index in found(seed).kept]
    wrongly = sum(name in INVISIBLE for name in kept)
    assert wrongly <= 0.12 * len(INVISIBLE) * len(SEEDS)  # 0.05 stated; 0.12 leaves room for chance over 96 trials


def test_parameters_far_above_their_errors_are_always_kept():
    for seed in SEEDS:
        assert set(names()) >= PLAIN
        assert {names()[index] for index in found(seed).kept} >= PLAIN


def predicted(values: FloatArray, motion: Motion) -> FloatArray:
    layout = truth().model.layout(base().independent)
    columns, _ = truth().model.columns(motion, layout)
    place = np.zeros(len(base().names))
    place[base().independent] = values
    weights = place[layout.parameters]
    return np.array([weights[layout.of_joint(j)] @ columns[layout.of_joint(j)] for j in range(2)])


def test_prediction_of_unseen_motion_is_not_worse_than_with_all_parameters():
    true_values, errors = base().projection @ truth().standard, []
    for seed in SEEDS:
        states = motion_from_rest(2, np.arange(0.0, 20.0, 0.02), seed=500 + seed)
        motion = Motion(**dict(zip(("q", "dq", "ddq"), (part.T.copy() for part in states), strict=True)))
        fits = found(seed).solution.values, WeightedLeastSquares().fit(evidence(seed)).values
        errors.append([np.linalg.norm(predicted(values - true_values, motion)) for values in fits])
    short, full = np.sqrt(np.mean(np.square(errors), axis=0))
    assert short < full


def white_steps(seed: int) -> int:
    """Return how many of the zero parameters a test on white residuals would keep in the full model."""
    single = replace(evidence(seed), blocks=(evidence(seed).total,))
    solution = OrdinaryLeastSquares().fit(single)
    ratios = solution.values**2 / np.diag(solution.covariance)
    limit = fisher.ppf(0.95, 1, solution.degrees)
    return sum(ratio > limit for name, ratio in zip(names(), ratios, strict=True) if name in INVISIBLE)


def test_an_f_test_on_white_residuals_would_keep_far_more_of_what_is_zero():
    assert sum(white_steps(seed) for seed in SEEDS) > 0.25 * len(INVISIBLE) * len(SEEDS)


def test_every_parameter_is_kept_or_dropped_and_the_steps_tell_why():
    result = found(0)
    assert np.array_equal(np.sort([*result.kept, *result.dropped]), np.arange(base().n_b))
    assert [step.parameter for step in result.steps if step.dropped] == result.dropped.tolist()
    for step in result.steps:
        assert step.alone == pytest.approx(1.0 / step.relative**2)
        assert step.dropped == (step.alone <= step.alone_limit and step.together <= step.together_limit)
    assert [step.dropped for step in result.steps[:-1]] == [True] * (len(result.steps) - 1)
    assert not result.steps[-1].dropped
    assert result.steps[0].together == pytest.approx(result.steps[0].alone)


def test_limits_are_fishers_quantiles_at_the_degrees_of_the_time_groups():
    result = found(1)
    degrees = len(evidence(1).merged_blocks(8)) - 1
    assert 3 <= degrees <= 7
    for count, step in enumerate(result.steps, start=1):
        assert step.alone_limit == pytest.approx(fisher.ppf(0.95, 1, degrees))
        assert step.together_limit == pytest.approx(fisher.ppf(0.95, count, degrees))


def test_the_residual_grows_with_each_step_and_hardly():
    result = found(0)
    rms = [step.relative_rms for step in result.steps if step.dropped]
    ordinary = essential_parameters(evidence(0), estimator=OrdinaryLeastSquares())
    grown = [step.relative_rms for step in ordinary.steps]
    assert grown == sorted(grown)
    assert rms[-1] < 1.02 * rms[0]


def test_the_solution_covers_all_parameters_and_is_zero_where_dropped():
    result = found(0)
    alone = WeightedLeastSquares().fit(evidence(0).keeping(result.kept))
    assert np.allclose(result.solution.values[result.kept], alone.values, rtol=1e-12)
    covariance = result.solution.covariance
    assert np.array_equal(covariance[np.ix_(result.kept, result.kept)], alone.covariance)
    assert not result.solution.values[result.dropped].any()
    assert not covariance[result.dropped].any()
    assert not covariance[:, result.dropped].any()
    assert (result.solution.rank, result.solution.degrees) == (result.kept.size, alone.degrees)


def test_evidence_without_a_column_is_that_of_a_fit_with_the_value_held_at_zero():
    kept = np.array([0, 2, 3, 5, 6, 8])
    total = evidence(0).total
    rows = np.zeros((sum(len(factor) for factor in total.factors), base().n_b + 1))
    start = 0
    for support, factor in zip(evidence(0).supports, total.factors, strict=True):
        rows[start : start + len(factor), [*support, base().n_b]] = factor
        start += len(factor)
    expected = np.linalg.lstsq(rows[:, kept], rows[:, -1], rcond=None)[0]
    solution = OrdinaryLeastSquares().fit(evidence(0).keeping(kept))
    assert np.allclose(solution.values, expected, rtol=1e-9)


def muted(source: Evidence, parameter: int) -> Evidence:
    """Return evidence in which a parameter's column is zero: a joint that stood still."""
    blocks = []
    for block in source.blocks:
        factors = []
        for support, factor in zip(source.supports, block.factors, strict=True):
            silenced = factor.copy()
            silenced[:, :-1][:, support == parameter] = 0.0
            factors.append(silenced)
        blocks.append(Block(factors=tuple(factors), n_t=block.n_t))
    return replace(source, blocks=tuple(blocks))


def test_a_column_that_is_zero_is_dropped_first_and_untested():
    index = names().index("Fc_2")
    with pytest.raises(ModelError, match="never load a joint"):
        WeightedLeastSquares().fit(muted(evidence(0), index))
    result = essential_parameters(muted(evidence(0), index))
    assert result.dropped[0] == index
    assert result.steps[0].relative == np.inf
    assert result.solution.values[index] == 0.0


def twinned(source: Evidence) -> Evidence:
    """Return evidence with one more parameter whose column is that of the last one: no motion tells them apart."""
    last = source.n_b - 1
    supports, blocks = [], []
    places = [np.flatnonzero(support == last) for support in source.supports]
    for support, place in zip(source.supports, places, strict=True):
        supports.append(np.append(support, np.full(place.size, source.n_b)))
    for block in source.blocks:
        factors = [
            np.concatenate([factor[:, :-1], factor[:, place], factor[:, -1:]], axis=1)
            for factor, place in zip(block.factors, places, strict=True)
        ]
        blocks.append(Block(factors=tuple(factors), n_t=block.n_t))
    return replace(source, supports=tuple(supports), n_b=source.n_b + 1, blocks=tuple(blocks))


def test_one_of_two_parameters_that_cannot_be_told_apart_is_dropped():
    kept = np.flatnonzero([name in PLAIN for name in names()])
    doubled = twinned(evidence(0).keeping(kept))
    result = essential_parameters(doubled)
    assert result.dropped[0] in {doubled.n_b - 2, doubled.n_b - 1}
    assert result.solution.rank == result.kept.size


def test_a_smaller_significance_keeps_less():
    counts = [essential_parameters(evidence(2), significance=level).kept.size for level in (1e-6, 0.05, 0.5)]
    assert counts == sorted(counts)
    assert counts[0] < counts[2]


@pytest.mark.parametrize("significance", [0.0, 1.0, -0.1, np.nan])
def test_a_significance_that_is_no_chance_is_refused(significance):
    with pytest.raises(ModelError, match="significance of the test is out of range; expected 0 to 1"):
        essential_parameters(evidence(0), significance=significance)


def test_results_cannot_be_written_to():
    result = found(0)
    arrays = (result.kept, result.dropped, result.solution.values, result.solution.covariance)
    assert not any(array.flags.writeable for array in arrays)
