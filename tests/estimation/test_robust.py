"""Reweighted least squares shrug off outliers, cost little without them, and say how sure they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rough_logs import (
    BASE,
    EXPECTED,
    SETTINGS,
    TRUTH,
    clean,
    covered,
    fitted,
    problem_of,
    run,
    spiky,
    torque_error,
    touched,
    with_spikes,
    with_touches,
)
from scipy.integrate import quad
from scipy.optimize import least_squares, minimize

from tauhat.errors import ModelError
from tauhat.estimation import (
    BisquareLeastSquares,
    CauchyLeastSquares,
    EssentialLeastSquares,
    HuberLeastSquares,
    OrdinaryLeastSquares,
    PhysicalConstraints,
    WeightedLeastSquares,
    identify,
)
from tauhat.estimation.losses import Bisquare, Cauchy, Huber
from tauhat.estimation.repeated_rows import remembered, repeated_rows
from tauhat.estimation.robust import joint_scales

LOSSES = [Huber(), Bisquare(), Cauchy(), Huber(threshold=0.7), Bisquare(threshold=2.0), Cauchy(threshold=4.0)]
METHODS = [HuberLeastSquares(), BisquareLeastSquares(), CauchyLeastSquares()]
SCALED = np.concatenate([np.linspace(-9.0, 9.0, 37), [1e-6, 50.0]])


@pytest.mark.parametrize("loss", LOSSES, ids=repr)
def test_weights_and_bends_are_derivatives_of_the_loss(loss):
    away = SCALED[np.abs(np.abs(SCALED) - loss.threshold) > 1e-3]
    step = 1e-5
    slope = (loss.loss(away + step) - loss.loss(away - step)) / (2.0 * step)
    np.testing.assert_allclose(loss.weight(away) * away, slope, atol=1e-8)
    force = [loss.weight(at) * at for at in (away + step, away - step)]
    np.testing.assert_allclose(loss.bend(away), (force[0] - force[1]) / (2.0 * step), atol=1e-8)


@pytest.mark.parametrize(("loss", "name"), [(Huber(), "huber"), (Cauchy(threshold=1.7), "cauchy")])
def test_losses_are_those_of_scipy(loss, name):
    found = least_squares(lambda x: SCALED + 0.0 * x, [0.0], loss=name, f_scale=loss.threshold, max_nfev=1)
    assert np.sum(loss.loss(SCALED)) == pytest.approx(found.cost, rel=1e-12)


def test_tukeys_loss_is_the_integral_of_its_force():
    loss = Bisquare()
    for end in (0.5, 3.0, 4.6):
        area, _ = quad(lambda u: u * (1.0 - (u / 4.685) ** 2) ** 2, 0.0, end)
        assert float(loss.loss(np.array(end))) == pytest.approx(area, rel=1e-9)
    assert float(loss.loss(np.array(40.0))) == pytest.approx(4.685**2 / 6.0)


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.key)
def test_the_solution_minimises_the_sum_of_losses(method):
    problem = problem_of(with_touches(run(3), 3))
    exact = replace(method, tolerance=1e-9, passes=400)
    rows = repeated_rows(problem)
    found = exact.reweighted(rows)

    def objective(values: np.ndarray) -> float:
        parts = [
            np.sum(found.scales**2 / found.scales * method.loss.loss(rows.residuals(piece, values).T / found.scales))
            for piece in rows
        ]
        return float(sum(parts))

    least = objective(found.values)
    better = minimize(objective, found.values, method="BFGS").fun
    assert better >= least * (1.0 - 1e-6)
    assert objective(found.values + 0.02 * np.abs(EXPECTED)) > least * (1.0 + 1e-4)


@pytest.mark.parametrize("disturbed", [spiky, touched])
@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.key)
def test_five_percent_of_gross_outliers_cost_less_than_half_as_much_again(method, disturbed):
    without, rough, plain = [], [], []
    for seed in range(8):
        problem, spoilt = clean(seed), disturbed(seed)
        without.append(torque_error(method.fit_problem(problem).values, problem))
        rough.append(torque_error(method.fit_problem(spoilt).values, problem))
        plain.append(torque_error(OrdinaryLeastSquares().fit_problem(spoilt).values, problem))
    assert np.median(rough) < 1.5 * np.median(without)
    assert np.median(plain) > 4.0 * np.median(without)


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.key)
def test_without_outliers_little_is_lost_and_nothing_is_biased(method):
    errors, best = [], []
    for seed in range(16):
        problem = clean(seed)
        errors.append(method.fit_problem(problem).values - EXPECTED)
        best.append(WeightedLeastSquares().fit(problem.evidence).values - EXPECTED)
    spread = np.std(errors, axis=0, ddof=1)
    assert np.median(spread / np.std(best, axis=0, ddof=1)) < 1.15
    bias = np.mean(errors, axis=0) / (spread / np.sqrt(len(errors)))
    assert np.abs(bias).max() < 4.0


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.key)
@pytest.mark.parametrize("disturbed", [clean, touched])
def test_95_percent_intervals_cover_the_truth(method, disturbed):
    hits = [covered(method.fit_problem(disturbed(seed))) for seed in range(16)]
    assert 0.90 <= np.mean(hits) <= 0.997
    assert np.mean(hits, axis=0).min() >= 0.7


def test_a_log_read_again_at_every_pass_gives_the_same_as_one_that_is_kept(monkeypatch):
    problem = problem_of([with_touches(run(1), 1), run(2)])
    kept = HuberLeastSquares().fit_problem(problem)
    assert len(remembered(problem).kept) == 2
    monkeypatch.setattr("tauhat.estimation.repeated_rows.MOST_BYTES", 0)
    assert repeated_rows(problem).kept == ()
    streamed = HuberLeastSquares().fit_problem(problem)
    np.testing.assert_allclose(streamed.values, kept.values, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(streamed.covariance, kept.covariance, rtol=1e-6, atol=1e-9)


def test_scales_are_the_deviations_of_normal_residuals():
    problem = problem_of(run(0))
    rows = repeated_rows(problem)
    spread = [np.std(row) for row in rows.residuals(rows.kept[0], EXPECTED)]
    np.testing.assert_allclose(joint_scales(rows, EXPECTED), spread, rtol=0.1)


def test_physical_constraints_are_solved_on_the_weighted_rows():
    recording = with_touches(run(4), 4)
    problem = problem_of(recording)
    method = BisquareLeastSquares()
    free = method.fit_problem(problem)
    physical = identify(
        TRUTH.model, [recording], estimator=method, processing=SETTINGS, constraints=PhysicalConstraints()
    )
    plain = identify(TRUTH.model, [recording], processing=SETTINGS, constraints=PhysicalConstraints())
    error = torque_error(physical.values, problem)
    assert error < 1.2 * torque_error(free.values, problem)
    assert torque_error(plain.values, problem) > 4.0 * error
    assert physical.physical is not None
    assert min(physical.physical["margins"]) > 0.0


def test_why_it_ended_is_told():
    problem = problem_of(with_spikes(run(0), 0))
    solution = HuberLeastSquares().fit_problem(problem)
    assert solution.cause.startswith("converged: the last pass moved the torque by")
    assert "5." in solution.advice or "4." in solution.advice
    assert "% of the torque samples were spikes and mended" in solution.advice
    assert HuberLeastSquares().fit_problem(problem_of(run(0))).advice == ""
    hasty = BisquareLeastSquares(passes=1, tolerance=1e-9).fit_problem(problem_of(with_touches(run(0), 0)))
    assert hasty.cause.startswith("stopped after 3 passes")
    assert "allow more passes" in hasty.advice


def test_a_model_that_lacks_a_term_is_told_from_outliers():
    recording = run(0, noise=np.zeros(1))
    square = np.sign(recording.dq[:, :1]) * np.array([[2.0, 0.0]]) * (np.abs(recording.q[:, :1]) > 0.4)
    solution = fitted(BisquareLeastSquares(), replace(recording, tau=recording.tau + square))
    assert "a model that lacks something there" in solution.advice
    assert "j1" in solution.advice


def test_evidence_alone_gives_weighted_least_squares():
    evidence = problem_of(run(0)).evidence
    assert np.array_equal(HuberLeastSquares().fit(evidence).values, WeightedLeastSquares().fit(evidence).values)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"power": 3.0}, "expected 0 to 2, got 3.0"),
        ({"passes": 0}, "at least one pass"),
        ({"tolerance": 0.0}, "tolerance is out of range"),
        ({"spike": 0.0}, "distance of a spike must be positive"),
    ],
)
def test_settings_out_of_range_are_refused(settings, message):
    with pytest.raises(ModelError, match=message):
        HuberLeastSquares(**settings)


def test_a_threshold_must_be_positive():
    with pytest.raises(ModelError, match="threshold of a loss must be positive; got 0"):
        Huber(threshold=0.0)


def test_too_few_rows_are_refused():
    problem = problem_of(run(0))
    block = replace(problem.evidence.total, n_t=BASE.n_b // 2)
    few = replace(problem, evidence=replace(problem.evidence, blocks=(block,)))
    with pytest.raises(ModelError, match="cannot determine"):
        HuberLeastSquares().fit_problem(few)


def test_essential_parameters_are_looked_for_on_the_weighted_rows():
    problem = touched(6)
    rough = EssentialLeastSquares(inner=BisquareLeastSquares()).fit_problem(problem)
    plain = EssentialLeastSquares().fit_problem(problem)
    assert torque_error(rough.values, problem) < 0.3 * torque_error(plain.values, problem)
    assert rough.evidence is not None
