"""Recursive least squares is weighted least squares with a memory that fades: the same batch, and it follows change."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rough_logs import BASE, EXPECTED, TRUTH, clean, covered, problem_of, run, white

from tauhat.errors import ModelError
from tauhat.estimation import RecursiveLeastSquares, WeightedLeastSquares
from tauhat.estimation.problem import Problem
from tauhat.estimation.repeated_rows import repeated_rows
from tauhat.recordings import Recording

NEVER = RecursiveLeastSquares(half_life=None)
FADING = RecursiveLeastSquares(half_life=4.0)
COULOMB = [TRUTH.model.parameters[index].symbol for index in BASE.independent].index("Fc")


def warming(seed: int) -> Problem:
    """Return a log of 40 s over which Coulomb friction of the first joint falls from 1.4 to 0.7 Nm."""
    still = TRUTH.recording(seed=seed, seconds=40.0)
    falling = 0.7 * (still.t / 40.0)[:, None] * [1.0, 0.0] * np.tanh(still.dq / 0.05)
    noise = white(seed, seconds=40.0, size=0.1)
    return problem_of(Recording(t=still.t, q=still.q, dq=still.dq, tau=still.tau - falling + noise))


def test_without_forgetting_it_is_weighted_least_squares():
    problem = clean(0)
    expected = WeightedLeastSquares().fit(problem.evidence)
    solution = NEVER.fit_problem(problem)
    np.testing.assert_allclose(solution.values, expected.values, rtol=1e-9)
    np.testing.assert_allclose(solution.covariance, expected.covariance, rtol=1e-6)
    np.testing.assert_allclose(NEVER.track(problem, every=3.0).values[-1], expected.values, rtol=1e-9)
    faded = NEVER.faded(repeated_rows(problem))
    np.testing.assert_allclose(WeightedLeastSquares().solve(faded).values, expected.values, rtol=1e-9)


@pytest.mark.parametrize("every", [0.3, 2.0, 50.0])
def test_the_end_does_not_depend_on_how_the_stream_is_cut(every):
    problem = problem_of([run(1), run(2)])
    track = FADING.track(problem, every=every)
    np.testing.assert_allclose(track.values[-1], FADING.fit_problem(problem).values, rtol=1e-8, atol=1e-9)
    assert (np.diff(track.t) > 0.0).all()
    assert track.t[-1] == pytest.approx(40.0, abs=1.0)


def test_each_row_weighs_by_its_age():
    problem = clean(3)
    rows = repeated_rows(problem)
    piece = rows.kept[0]
    left = np.sqrt(0.5 ** ((piece.t[-1] - piece.t) / 4.0))
    whole = np.zeros((2 * piece.t.size, BASE.n_b + 1))
    for joint, place in enumerate(rows.places):
        part = slice(joint * piece.t.size, (joint + 1) * piece.t.size)
        whole[part, place] = (left * piece.columns[rows.layout.of_joint(joint)]).T
        whole[part, -1] = left * piece.tau[joint]
    expected = np.linalg.lstsq(whole[:, :-1], whole[:, -1], rcond=None)[0]
    plain = RecursiveLeastSquares(half_life=4.0, power=0.0).fit_problem(problem)
    np.testing.assert_allclose(plain.values, expected, rtol=1e-8)


def test_steps_are_pure_and_count_what_is_left():
    problem = clean(4)
    rows = repeated_rows(problem)
    start = FADING.start(problem)
    once = FADING.step(start, rows.kept[0], rows.layout.bounds)
    assert start.seen == 0
    assert once.seen == problem.evidence.n_t
    expected = np.sum(0.5 ** ((rows.kept[0].t[-1] - rows.kept[0].t) / 4.0))
    assert once.rows == pytest.approx(expected, rel=1e-12)
    again = FADING.step(start, rows.kept[0], rows.layout.bounds)
    assert all(np.array_equal(a, b) for a, b in zip(once.block.factors, again.block.factors, strict=True))


def test_a_slowly_changing_friction_is_followed():
    late, never = [], []
    for seed in range(8):
        problem = warming(seed)
        truth = 1.4 - 0.7 * np.arange(0.0, 41.0, 1.0) / 40.0
        track = FADING.track(problem, every=1.0)
        after = track.t > 12.0
        late.append(track.values[after, COULOMB] - np.interp(track.t[after], np.arange(0.0, 41.0, 1.0), truth))
        never.append(NEVER.fit_problem(problem).values[COULOMB] - 0.7)
    lag = 0.7 / 40.0 * 4.0 / np.log(2.0)  # of a steady change: the mean age of what is remembered
    assert np.mean(late) == pytest.approx(lag, abs=0.05)
    assert np.sqrt(np.mean(np.concatenate(late) ** 2)) < 0.2
    assert np.mean(never) > 0.25


def test_intervals_at_the_end_cover_a_truth_that_stays():
    hits = [covered(FADING.fit_problem(clean(seed))) for seed in range(16)]
    assert 0.88 <= np.mean(hits) <= 0.997


@pytest.mark.parametrize("half_life", [1e6, 60.0, 4.0, 1.0])
def test_a_memory_of_a_few_groups_of_time_is_no_surer_than_these(half_life):
    problem = clean(0)
    span = problem.evidence.n_t / 40.0 * np.log(2.0) / half_life
    # Rows of weights exp(-a t) over a time T are worth 2 tanh(aT / 2) / aT of themselves.
    expected = 16.0 * 2.0 * np.tanh(0.5 * span) / span - 1.0
    assert RecursiveLeastSquares(half_life=half_life).fit_problem(problem).degrees == pytest.approx(
        max(1.0, expected), abs=0.6
    )


@pytest.mark.parametrize("half_life", [4.0, 1.0, 0.3])
def test_error_bars_are_at_least_those_of_white_noise_on_rows_of_these_weights(half_life):
    problem = clean(3)
    rows = repeated_rows(problem)
    piece = rows.kept[0]
    left = np.tile(0.5 ** ((piece.t[-1] - piece.t) / half_life), 2)
    whole = np.zeros((2 * piece.t.size, BASE.n_b + 1))
    for joint, place in enumerate(rows.places):
        part = slice(joint * piece.t.size, (joint + 1) * piece.t.size)
        whole[part, place] = piece.columns[rows.layout.of_joint(joint)].T
        whole[part, -1] = piece.tau[joint]
    solution = RecursiveLeastSquares(half_life=half_life, power=0.0).fit_problem(problem)
    errors = whole[:, -1] - whole[:, :-1] @ solution.values
    noise = left @ errors**2 / left.sum()
    inverse = np.linalg.inv(whole[:, :-1].T @ (left[:, None] * whole[:, :-1]))
    white = noise * np.sum(left**2) / left.sum() * np.diag(inverse)
    assert (np.diag(solution.covariance) > white).all()


def test_a_short_memory_covers_the_truth():
    hits = [covered(RecursiveLeastSquares(half_life=0.7).fit_problem(clean(seed))) for seed in range(16)]
    assert np.mean(hits) > 0.95


def test_what_is_left_of_the_beginning_is_told():
    assert FADING.fit_problem(clean(0)).cause == "solved at the end; of the first row 3.1 % is left"


def test_nothing_is_said_before_there_are_enough_rows():
    track = NEVER.track(clean(0), every=0.05)
    assert 2 * 4 * 10.0 * track.t[0] > BASE.n_b - 2
    assert track.values.shape == (track.t.size, BASE.n_b)
    assert np.isfinite(track.values).all()
    np.testing.assert_allclose(track.values[-1], EXPECTED, atol=0.3)


def test_a_very_short_memory_of_a_long_log_stays_finite():
    solution = RecursiveLeastSquares(half_life=0.2).fit_problem(clean(5))
    assert np.isfinite(solution.values).all()
    assert np.isfinite(solution.covariance).all()


def test_settings_and_too_few_rows_are_refused():
    with pytest.raises(ModelError, match=r"half-life must be positive; got 0\.0 s"):
        RecursiveLeastSquares(half_life=0.0)
    problem = problem_of(run(0))
    block = replace(problem.evidence.total, n_t=BASE.n_b // 2)
    with pytest.raises(ModelError, match="cannot determine"):
        FADING.fit_problem(replace(problem, evidence=replace(problem.evidence, blocks=(block,))))
