"""A log of a fifth of a second: every estimator ends with finite numbers or one line that says what is missing."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from rough_logs import BASE, TRUTH, problem_of, run

from tauhat.errors import ModelError, TauhatError, TauhatWarning
from tauhat.estimation import Estimate, RecursiveLeastSquares, identify
from tauhat.estimation.estimators import ESTIMATORS, estimator_named
from tauhat.estimation.filters import Adaline, AdaptiveInputError, HopfieldTank, ParameterKalman, StateKalman
from tauhat.estimation.filters.beginning import Nominal
from tauhat.estimation.residual_learning import learn_residual
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording


def cut(seconds: float) -> Recording:
    """Return a piece from the middle of a log, in full motion, with noise on its torque."""
    return run(1).rows(800, 800 + round(200.0 * seconds))


@pytest.mark.parametrize("seconds", [0.1, 0.2, 0.5])
@pytest.mark.parametrize("key", sorted(ESTIMATORS))
def test_it_ends_with_finite_numbers_or_in_one_line(key, seconds):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", TauhatWarning)
        try:
            estimate = identify(TRUTH.model, [cut(seconds)], estimator=estimator_named(key))
        except TauhatError as refusal:
            words = str(refusal)
        else:
            words = estimate.cause
            _require_finite(estimate)
    assert words
    assert "\n" not in words


def _require_finite(estimate: Estimate) -> None:
    assert np.isfinite(estimate.values).all()
    assert np.isfinite(estimate.covariance).all()


@pytest.mark.parametrize(
    "method",
    [
        ParameterKalman(),
        Adaline(),
        HopfieldTank(),
        StateKalman(beginning=Nominal()),
        AdaptiveInputError(beginning=Nominal()),
    ],
    ids=lambda method: method.key,
)
def test_a_recursion_of_fewer_rows_than_parameters_is_refused(method):
    short = problem_of(cut(0.1))
    assert short.evidence.n_v * short.evidence.n_t <= BASE.n_b
    with pytest.raises(ModelError, match=r"filtered rows cannot determine 13 base parameters; give a longer recording"):
        method.fit_problem(short)


@pytest.mark.parametrize(
    ("seconds", "message"), [(0.2, "no row|too few"), (0.4, "too few rows"), (0.9, "cannot determine 13 base")]
)
def test_a_network_is_not_judged_on_no_rows(seconds, message):
    pytest.importorskip("sklearn", reason="the extra `learning` is not installed")
    estimate = identify(TRUTH.model, [run(0)], processing=Processing(cutoff=2.0, motion_cutoff=20.0))
    with pytest.raises(TauhatError, match=message):
        learn_residual(estimate, [cut(seconds)])


def test_a_memory_too_short_for_the_parameters_is_refused():
    with pytest.raises(ModelError, match=r"a half-life of 0.01 s leaves .* which cannot determine 13 base parameters"):
        RecursiveLeastSquares(half_life=0.01).fit_problem(problem_of(run(0)))
