"""Bands of a predicted torque: two parts stated apart, and both hold as often as they say."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from sample_arms import planar_truth
from tauhat.dynamics import motion_from_rows
from tauhat.estimation import Estimate, identify
from tauhat.recordings import Processing, Recording
from tauhat.verification import LogPrediction, verify
from tauhat.verification.bands import NORMAL, half_bands, prediction_band

SETTINGS = Processing(cutoff=10.0, motion_cutoff=30.0)
TRUTH = planar_truth()
NOISE = np.array([0.6, 0.3])  # [Nm]


def log(seed: int, *, noise: float = 1.0, seconds: float = 20.0) -> Recording:
    count = round(200 * seconds)
    white = np.random.default_rng(seed).standard_normal((count, 2))
    return TRUTH.recording(seed=seed, seconds=seconds, noise=noise * NOISE * white)


@lru_cache
def estimate() -> Estimate:
    return identify(TRUTH.model, [log(1)], processing=SETTINGS)


@lru_cache
def prediction() -> LogPrediction:
    return verify(estimate(), [log(2)]).logs[0]


def test_the_two_parts_add_up_as_squares():
    assert half_bands(np.array([3.0]), 4.0 / NORMAL) == pytest.approx([5.0])


def test_coverage_is_counted_for_both_parts_apart():
    band = prediction_band(np.array([0.5, -1.5, 2.0, 4.0]), np.full(4, 1.0), level=1.0)
    assert (band.covered_by_parameters, band.covered) == (0.25, 0.75)
    assert band.parameters == 1.0
    assert band.residual == pytest.approx(NORMAL)


def test_both_parts_together_hold_as_often_as_they_say():
    """Twelve joints of six fits, about 400 independent rows each: three standard errors of the mean are 0.012."""
    fits = [(identify(TRUTH.model, [log(seed)], processing=SETTINGS), log(seed + 1)) for seed in range(1, 13, 2)]
    bands = [joint.band for fit, seen in fits for joint in verify(fit, [seen]).logs[0].joints]
    assert np.mean([band.covered for band in bands]) == pytest.approx(0.95, abs=0.012)
    assert np.mean([band.covered_by_parameters for band in bands]) < 0.8  # noise is no error of the parameters


def test_the_parameters_band_holds_the_torque_without_noise():
    quiet = verify(estimate(), [log(3, noise=0.0)]).logs[0]
    inside = np.abs(quiet.tau - quiet.predicted) <= quiet.parameter_band
    assert inside.mean() > 0.8


def test_more_data_narrows_the_parameters_band_and_not_the_other():
    longer = verify(identify(TRUTH.model, [log(1), log(4, seconds=60.0)], processing=SETTINGS), [log(2)]).logs[0]
    for short, long in zip(prediction().joints, longer.joints, strict=True):
        assert long.band.parameters < 0.8 * short.band.parameters
        assert long.band.residual == pytest.approx(short.band.residual, rel=0.15)


def test_a_standard_error_is_that_of_the_regressor_row_and_the_covariance():
    fit, seen = estimate(), prediction()
    layout = fit.model.layout(fit.base.independent)
    slow = Recording(t=np.arange(400) * 0.005, q=np.tile([0.3, -0.7], (400, 1)), tau=np.ones((400, 2)))
    still = verify(fit, [slow]).logs[0]
    columns, _ = fit.model.columns(motion_from_rows(slow.q[:1], 0 * slow.q[:1], 0 * slow.q[:1]), layout)
    for joint in range(2):
        part = layout.of_joint(joint)
        places = np.searchsorted(fit.base.independent, layout.parameters[part])
        row = columns[part, 0]
        expected = np.sqrt(row @ fit.covariance[np.ix_(places, places)] @ row)
        assert still.std[:, joint] == pytest.approx(expected, rel=1e-6)
    assert not seen.std.flags.writeable


def test_series_of_motion_and_load_are_those_of_the_recording():
    seen, given = prediction(), log(2)
    assert seen.q[:, 0] == pytest.approx(np.interp(seen.t, given.t, given.q[:, 0]), abs=0.02)
    assert np.gradient(seen.dq[:, 1], seen.t)[5:-5] == pytest.approx(seen.ddq[5:-5, 1], abs=0.35 * seen.ddq.std())
    friction = estimate().friction(np.array([1.0, 1.0])).torque
    assert np.abs(seen.predicted - seen.load).mean(axis=0) == pytest.approx(friction, rel=0.5)
    assert seen.temperature is None


def test_temperature_is_carried_along_where_it_was_logged():
    given = log(2)
    warm = replace(given, temperature=np.column_stack([20.0 + given.t, 30.0 - given.t]))
    seen = verify(estimate(), [warm]).logs[0]
    assert seen.temperature == pytest.approx(np.column_stack([20.0 + seen.t, 30.0 - seen.t]))
