"""Identification recovers what is known, and says when it cannot."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import t as student

from sample_arms import chain, planar_arm, planar_truth, smooth_motion
from tauhat.dynamics import inverse_dynamics, torque_model
from tauhat.errors import ModelError, RecordingError, TauhatWarning
from tauhat.estimation import OrdinaryLeastSquares, WeightedLeastSquares, estimator_named, identify
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording, Source

SETTINGS = Processing(cutoff=10.0, motion_cutoff=30.0)
TRUTH = planar_truth()
METHODS = (OrdinaryLeastSquares(), WeightedLeastSquares(), WeightedLeastSquares(power=1.0, passes=5))


@pytest.mark.parametrize("method", METHODS, ids=str)
def test_known_parameters_come_back_from_a_clean_recording(method):
    estimate = identify(TRUTH.model, [TRUTH.recording()], estimator=method, processing=SETTINGS)
    expected = estimate.base.projection @ TRUTH.standard
    assert np.allclose(estimate.values, expected, rtol=0, atol=2e-3 * np.abs(expected).max())
    assert estimate.relative_rms < 2e-3


@pytest.mark.parametrize("method", METHODS, ids=str)
def test_all_known_parameters_are_within_their_joint_99_percent_interval(method):
    noise = np.random.default_rng(1).normal(size=(4000, 2)) * [0.8, 0.2]
    estimate = identify(TRUTH.model, [TRUTH.recording(noise=noise)], estimator=method, processing=SETTINGS)
    error = estimate.values - estimate.base.projection @ TRUTH.standard
    each = 1.0 - 0.005 / error.size  # Bonferroni: all of them at once
    assert (np.abs(error) < student.ppf(each, estimate.degrees) * estimate.standard_errors).all()
    assert (estimate.standard_errors < 0.1).all()


def test_weighting_helps_when_one_joint_is_noisy():
    errors = {"ols": [], "wls": []}
    for seed in range(8):
        noise = np.random.default_rng(seed).normal(size=(4000, 2)) * [5.0, 0.05]
        for method in (OrdinaryLeastSquares(), WeightedLeastSquares(power=1.0)):
            estimate = identify(TRUTH.model, [TRUTH.recording(noise=noise)], estimator=method, processing=SETTINGS)
            error = estimate.values - estimate.base.projection @ TRUTH.standard
            errors[method.key].append(error[estimate.base.formulas().index("Izz_2")])
    assert np.std(errors["wls"]) < 0.5 * np.std(errors["ols"])


def test_spatial_arm_with_a_slide_is_recovered():
    robot = chain(np.random.default_rng(2), "RPR")
    t = np.arange(0, 20, 0.005)
    q, dq, ddq = smooth_motion(3, t)
    recording = Recording(t=t, q=q, tau=inverse_dynamics(robot, q, dq, ddq))
    estimate = identify(torque_model(robot, "inertia"), [recording], processing=SETTINGS)
    expected = estimate.base.projection @ robot.inertia.ravel()
    assert np.allclose(estimate.values, expected, rtol=0, atol=5e-3 * np.abs(expected).max())


def test_two_recordings_know_more_than_one():
    def errors(count):
        noises = [np.random.default_rng(seed).normal(size=(4000, 2)) for seed in range(count)]
        runs = [TRUTH.recording(seed=seed, noise=noise) for seed, noise in enumerate(noises)]
        return identify(TRUTH.model, runs, processing=SETTINGS).standard_errors

    assert np.median(errors(4) / errors(1)) < 0.75


def test_estimate_tells_what_it_was_made_of():
    source = Source(path="run.csv", sha256="abc", rows=(10, 4010))
    recording = replace(TRUTH.recording(), source=source)
    estimate = identify(TRUTH.model, [recording], processing=SETTINGS)
    log = estimate.inputs[0]
    assert (log.name, log.sha256, log.rows, log.samples) == ("run 0", "abc", (10, 4010), 4000)
    assert log.seconds == pytest.approx(19.995)
    assert estimate.processing == SETTINGS
    assert estimate.estimator == {"name": "wls", "power": 0.5, "passes": 3, "ridge": 0.0}
    assert estimate.rank == estimate.base.n_b


def test_torque_of_the_fit_is_predicted_at_its_samples():
    estimate = identify(TRUTH.model, [TRUTH.recording()], processing=SETTINGS)
    t = np.arange(0, 5, 0.005)
    motion = smooth_motion(2, t, seed=9)
    expected = TRUTH.torque(*motion)
    assert np.abs(estimate.predict(*motion) - expected).max() < 5e-3 * np.abs(expected).max()


def weak_recording(noise_seed: int = 0) -> Recording:
    t = np.arange(0, 10, 0.005)
    q = np.column_stack([0.02 * np.sin(2 * np.pi * 0.5 * t), 0.02 * np.sin(2 * np.pi * 0.5 * t)])
    rng = np.random.default_rng(noise_seed)
    return Recording(t=t, q=q, tau=rng.normal(size=q.shape))


def test_a_weak_motion_warns_with_its_condition_number_and_least_certain_parameters():
    with pytest.warns(
        TauhatWarning, match=r"(badly conditioned: scaled condition number \d|determines only \d+ of 13)"
    ):
        identify(TRUTH.model, [weak_recording()], processing=SETTINGS)


def test_a_reversed_torque_warns_that_friction_is_negative():
    recording = TRUTH.recording()
    with pytest.warns(TauhatWarning, match=r"friction is negative on 2 of 2 joints \(j1, j2\).*sign = -1"):
        identify(TRUTH.model, [replace(recording, tau=-recording.tau)], processing=SETTINGS)


def test_one_reversed_torque_warns_of_its_joint():
    recording = TRUTH.recording()
    with pytest.warns(TauhatWarning, match=r"friction is negative on 1 of 2 joints \(j2\).*one value a joint"):
        identify(TRUTH.model, [replace(recording, tau=recording.tau * [1.0, -1.0])], processing=SETTINGS)


def test_torque_without_friction_as_behind_a_gear_has_no_wrong_sign_by_chance():
    drives = ("Fv", "Fc")
    symbols = [parameter.symbol for parameter in TRUTH.model.parameters]
    smooth = replace(TRUTH, standard=np.where(np.isin(symbols, drives), 0.0, TRUTH.standard))
    chance = 0
    for seed in range(12):
        noise = 0.1 * np.random.default_rng(seed).standard_normal((4000, 2))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            estimate = identify(TRUTH.model, [smooth.recording(noise=noise)], processing=SETTINGS)
        levels = [estimate.friction(part * estimate.top_speeds).torque for part in (0.2, 0.6)]
        chance += bool(np.all(np.array(levels) < 0.0))
    assert chance > 0  # it was negative on all joints, within its error bars


def test_a_rich_motion_with_the_right_sign_does_not_warn():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        estimate = identify(TRUTH.model, [TRUTH.recording()], processing=SETTINGS)
    assert estimate.condition < 100


def test_no_recording_is_refused():
    with pytest.raises(ModelError, match="no recording to identify from"):
        identify(TRUTH.model, [])


def test_a_recording_without_torque_is_refused():
    with pytest.raises(RecordingError, match="no torque in the log"):
        identify(TRUTH.model, [replace(TRUTH.recording(), tau=None)], processing=SETTINGS)


def test_a_recording_of_another_robot_is_refused():
    with pytest.raises(RecordingError, match="does not fit the robot"):
        identify(torque_model(chain(np.random.default_rng(0), "RRR")), [TRUTH.recording()], processing=SETTINGS)


def test_a_joint_that_never_moves_is_told():
    t = np.arange(0, 10, 0.005)
    q = np.column_stack([np.sin(3 * t), 0 * t])
    still = Recording(t=t, q=q, tau=np.ones_like(q), name="still")
    with pytest.raises(ModelError, match=r"\d of 4 base parameters never load a joint .* moves every joint"):
        identify(torque_model(planar_arm(), "viscous,coulomb"), [still], processing=SETTINGS)


def still_second_joint(flicker: float) -> Recording:
    """Return a log in which only the first joint moves; the second flickers by encoder counts of this size [rad]."""
    rng = np.random.default_rng(0)
    t = np.arange(0, 20, 0.005)
    q, dq, ddq = smooth_motion(2, t)
    q[:, 1], dq[:, 1], ddq[:, 1] = 0.3, 0.0, 0.0
    tau = TRUTH.torque(q, dq, ddq) + rng.normal(size=q.shape)
    q[:, 1] += flicker * rng.integers(-1, 2, t.size)
    return Recording(t=t, q=q, tau=tau, joint_names=("j1", "j2"))


def test_a_joint_that_only_flickers_is_told():
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        identify(TRUTH.model, [still_second_joint(1e-5)], processing=SETTINGS)
    messages = [str(warning.message) for warning in warned]
    assert any(message.startswith("no motion of j2 in any recording") for message in messages)
    assert not any("determines only" in message for message in messages)


def test_rounding_errors_of_a_constant_position_determine_nothing():
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        estimate = identify(TRUTH.model, [still_second_joint(0.0)], processing=SETTINGS)
    assert any("determines only" in str(warning.message) for warning in warned)
    assert np.abs(estimate.values).max() < 100


def test_estimators_go_by_their_names():
    assert estimator_named("ols") == OrdinaryLeastSquares()
    assert estimator_named("wls") == WeightedLeastSquares()
    with pytest.raises(ModelError, match=r"unknown estimator; expected ols, wls, .*irls.*, got lasso"):
        estimator_named("lasso")


@pytest.mark.parametrize(
    ("method", "settings", "message"),
    [
        (OrdinaryLeastSquares, {"ridge": -1.0}, "ridge cannot be negative"),
        (WeightedLeastSquares, {"ridge": np.nan}, "ridge cannot be negative"),
        (WeightedLeastSquares, {"power": 3.0}, "expected 0 to 2, got 3.0"),
        (WeightedLeastSquares, {"passes": 0}, "at least one pass"),
    ],
)
def test_settings_of_estimators_out_of_range_are_refused(method, settings, message):
    with pytest.raises(ModelError, match=message):
        method(**settings)


def test_torque_that_is_zero_everywhere_is_refused():
    recording = TRUTH.recording()
    with pytest.raises(ModelError, match="the torque is zero throughout; name the right torque columns"):
        identify(TRUTH.model, [replace(recording, tau=np.zeros_like(recording.q))], processing=SETTINGS)


def test_a_recording_too_short_for_its_filter_is_refused_with_its_rows():
    with pytest.raises(
        ModelError, match=r"^6 filtered rows cannot determine 13 base parameters; give a longer recording"
    ):
        identify(TRUTH.model, [TRUTH.recording(seconds=1.0)], processing=Processing(cutoff=1.0, motion_cutoff=30.0))


def test_error_bars_of_what_the_motion_does_not_determine_are_wide_open():
    with pytest.warns(TauhatWarning, match="determines only"):
        estimate = identify(torque_model(planar_arm()), [stiff_recording()], processing=SETTINGS)
    errors = dict(zip(estimate.base.formulas(), estimate.standard_errors, strict=True))
    assert errors["Izz_2"] > 1e3
    assert errors["Fc_2"] < 1.0


def stiff_recording() -> Recording:
    """Return a motion of one tone on both joints: acceleration is position, and nothing tells inertia from gravity."""
    t = np.arange(0, 10, 0.005)
    q = np.column_stack([1e-4 * np.sin(3 * t), 1e-4 * np.sin(3 * t)])
    return Recording(t=t, q=q, tau=np.random.default_rng(0).normal(size=q.shape))
