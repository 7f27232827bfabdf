"""Hybrid least squares: the shape of friction is found on rows that are weighted by how well they are explained."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
from rough_logs import SETTINGS, TRUTH, clean, problem_of, run, touched

from sample_arms import WIDTHS
from tauhat.dynamics import Coulomb, TorqueModel, base_parameters
from tauhat.errors import ModelError, TauhatWarning
from tauhat.estimation import CauchyLeastSquares, HuberLeastSquares, HybridLeastSquares, collect_all, identify
from tauhat.estimation.problem import Problem
from tauhat.estimation.solution import joint_residuals
from tauhat.verification import verify


def misshaped(problem: Problem, factor: float) -> Problem:
    """Return the problem with widths of Coulomb friction that are wrong by a factor."""
    widths = tuple(factor * width for width in WIDTHS)
    model = TRUTH.model.with_term(Coulomb(widths=widths))
    base = base_parameters(model)
    evidence = collect_all(model, base, problem.recordings, problem.processing)
    return replace(problem, model=model, base=base, evidence=evidence, kept=())


def residual(problem: Problem, values: np.ndarray) -> float:
    """Return what values leave over on an undisturbed recording of another motion."""
    judge = collect_all(problem.model, problem.base, [run(9)], problem.processing)
    return float(np.linalg.norm(joint_residuals(judge, values)))


def widths_of(model: TorqueModel) -> np.ndarray:
    return np.array(next(term.widths for term in model.terms if isinstance(term, Coulomb)))


@pytest.mark.parametrize("make", [clean, touched])
def test_wrong_widths_are_mended(make):
    problem = misshaped(make(0), 2.5)
    settled = HybridLeastSquares().settled(problem)
    np.testing.assert_allclose(widths_of(settled.model), WIDTHS, rtol=0.5)
    assert settled.evidence.n_t == problem.evidence.n_t
    better = residual(settled, HybridLeastSquares().fit_problem(settled).values)
    assert better < residual(problem, HuberLeastSquares().fit_problem(problem).values)


def test_right_widths_stay_near_and_the_fit_is_that_of_reweighted_least_squares():
    settled = HybridLeastSquares().settled(clean(1))
    np.testing.assert_allclose(widths_of(settled.model), WIDTHS, rtol=0.5)
    hybrid, plain = HybridLeastSquares().fit_problem(settled), CauchyLeastSquares().fit_problem(settled)
    assert np.array_equal(hybrid.values, plain.values)


def test_a_model_without_shapes_is_left_as_it_is():
    problem = clean(0)
    bare = replace(problem, model=TorqueModel(robot=TRUTH.model.robot, terms=TRUTH.model.terms[:3]))
    base = base_parameters(bare.model)
    evidence = collect_all(bare.model, base, problem.recordings, problem.processing)
    bare = replace(bare, base=base, evidence=evidence, kept=())
    assert HybridLeastSquares().settled(bare) is bare


def test_identify_takes_the_shapes_that_were_settled():
    model = TRUTH.model.with_term(Coulomb(widths=tuple(2.5 * width for width in WIDTHS)))
    log, judge = problem_of(run(0)).recordings[0], run(9)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)
        hybrid = identify(model, [log], estimator=HybridLeastSquares(), processing=SETTINGS)
        plain = identify(model, [log], estimator=HuberLeastSquares(), processing=SETTINGS)
    np.testing.assert_allclose(widths_of(hybrid.model), WIDTHS, rtol=0.5)
    assert verify(hybrid, [judge]).logs[0].relative_rms < verify(plain, [judge]).logs[0].relative_rms


def test_at_least_one_round_is_needed():
    with pytest.raises(ModelError, match="at least one round"):
        HybridLeastSquares(rounds=0)
