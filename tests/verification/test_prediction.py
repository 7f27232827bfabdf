"""Prediction of unseen recordings: every figure by hand, a perfect model, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from sample_arms import planar_arm, planar_truth
from tauhat.dynamics import torque_model
from tauhat.errors import ModelError, RecordingError
from tauhat.estimation import Estimate, identify
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording
from tauhat.verification import LogPrediction, verify

RAW = Processing(cutoff=1e3, motion_cutoff=1e3)  # nothing is filtered
SETTINGS = Processing(cutoff=10.0, motion_cutoff=30.0)
TRUTH = planar_truth()
PREDICTED = np.array([1.0, -2.0])  # what the constant model says


@lru_cache
def constant_model() -> Estimate:
    """Return a model whose torque is a constant on either joint."""
    t = np.arange(200) * 0.01
    q = np.column_stack([np.sin(3 * t), np.cos(2 * t)])
    recording = Recording(t=t, q=q, tau=np.tile(PREDICTED, (200, 1)))
    return identify(torque_model(planar_arm(), "offset"), [recording], processing=RAW)


def tiny_log() -> Recording:
    """Return twenty samples: joint 1 moves on steadily, joint 2 speeds up; errors 0, 1, 2, ... and a lone 3."""
    t = 5.0 + 0.1 * np.arange(20)
    error = np.zeros((20, 2))
    error[:, 0] = np.arange(20.0)
    error[13, 1] = -3.0
    q = np.column_stack([0.5 * t, 0.5 * (t - 5.0) ** 2])
    return Recording(t=t, q=q, tau=PREDICTED + error, name="tiny")


def prediction() -> LogPrediction:
    return verify(constant_model(), [tiny_log()]).logs[0]


def test_overall_figures_are_those_of_all_joints_stacked():
    log, tau = prediction(), tiny_log().tau
    error = tau - PREDICTED
    assert log.log == "tiny"
    assert log.rms == pytest.approx(np.sqrt((error**2).sum() / 40))
    assert log.relative_rms == pytest.approx(np.linalg.norm(error) / np.linalg.norm(tau))
    assert log.r2 == pytest.approx(1 - (error**2).sum() / ((tau - tau.mean(axis=0)) ** 2).sum())


def test_figures_of_each_joint_are_its_own():
    first, second = prediction().joints
    tau = tiny_log().tau
    assert (first.name, first.unit, second.name) == ("j1", "Nm", "j2")
    assert first.rms == pytest.approx(np.sqrt(np.mean(np.arange(20.0) ** 2)))
    assert second.rms == pytest.approx(3.0 / np.sqrt(20))
    assert second.relative_rms == pytest.approx(3.0 / np.linalg.norm(tau[:, 1]))
    assert first.r2 == pytest.approx(1 - (np.arange(20.0) ** 2).sum() / ((tau[:, 0] - tau[:, 0].mean()) ** 2).sum())


def test_the_worst_error_is_told_with_its_time():
    first, second = prediction().joints
    assert (first.worst, first.worst_at) == (pytest.approx(19.0), pytest.approx(6.9))
    assert (second.worst, second.worst_at) == (pytest.approx(3.0), pytest.approx(6.3))


def test_error_over_time_is_told_for_ten_equal_stretches():
    first, second = prediction().joints
    pairs = np.arange(20.0).reshape(10, 2)
    assert first.by_time == pytest.approx(np.sqrt((pairs**2).mean(axis=1)))
    assert second.by_time == pytest.approx([0, 0, 0, 0, 0, 0, 3 / np.sqrt(2), 0, 0, 0])


def test_error_over_speed_is_told_for_ten_bins_up_to_the_top_speed():
    log = prediction()
    for joint, speed, error in zip(log.joints, np.abs(log.dq).T, (log.tau - log.predicted).T, strict=True):
        assert joint.top_speed == speed.max()
        edges = np.linspace(0.0, joint.top_speed, 11)
        edges[-1] = np.inf
        for k, value in enumerate(joint.by_speed):
            inside = error[(speed >= edges[k] - 1e-12) & (speed < edges[k + 1] - 1e-12)]
            expected = np.sqrt(np.mean(inside**2)) if inside.size else np.nan
            assert value == pytest.approx(expected, nan_ok=True)
    second = log.joints[1]
    assert second.top_speed == pytest.approx(1.9, rel=0.06)
    filled = [value for value in second.by_speed if np.isfinite(value) and value > 1e-6]
    assert len(filled) == 1
    assert 5 <= second.by_speed.index(filled[0]) <= 7


def test_a_perfect_model_predicts_everything():
    estimate = identify(TRUTH.model, [TRUTH.recording(seed=0)], processing=SETTINGS)
    log = verify(estimate, [TRUTH.recording(seed=1)]).logs[0]
    assert log.r2 > 1 - 1e-5
    assert log.relative_rms < 2e-3
    assert all(joint.r2 > 1 - 1e-4 for joint in log.joints)


def test_a_model_that_knows_nothing_beyond_the_mean_has_no_r2():
    t = np.arange(400) * 0.01
    tau = PREDICTED + np.column_stack([np.sin(5 * t), np.cos(5 * t)])
    q = np.column_stack([np.sin(3 * t), np.cos(2 * t)])
    log = verify(constant_model(), [Recording(t=t, q=q, tau=tau)]).logs[0]
    assert log.r2 < 0.05


def test_noise_is_what_is_left_of_a_good_model():
    noise = np.random.default_rng(3).normal(size=(4000, 2)) * [0.4, 0.2]
    estimate = identify(TRUTH.model, [TRUTH.recording(seed=0)], processing=SETTINGS)
    unfiltered = Processing(cutoff=1e3, motion_cutoff=30.0)
    log = verify(estimate, [TRUTH.recording(seed=1, noise=noise)], processing=unfiltered).logs[0]
    assert [joint.rms for joint in log.joints] == pytest.approx([0.4, 0.2], rel=0.05)


def test_logs_are_told_one_by_one_in_order():
    logs = verify(constant_model(), [tiny_log(), replace(tiny_log(), name="again")]).logs
    assert [log.log for log in logs] == ["tiny", "again"]
    assert logs[0].rms == logs[1].rms


def test_filters_are_the_estimates_own_unless_others_are_given():
    assert verify(constant_model(), [tiny_log()]).processing == RAW
    assert verify(constant_model(), [tiny_log()], processing=SETTINGS).processing == SETTINGS


def test_plain_data_keeps_the_contract_and_has_no_nan():
    log = verify(constant_model(), [tiny_log()]).to_dict()["logs"][0]
    assert {"log", "relative_rms", "rms", "r2", "joints"} <= log.keys()
    assert {"name", "relative_rms", "rms"} <= log["joints"][0].keys()
    assert None in log["joints"][0]["by_speed"]
    assert all(value is None or np.isfinite(value) for value in log["joints"][0]["by_speed"])


def test_standstill_at_both_ends_is_left_out():
    recording = TRUTH.recording(seconds=10.0)
    hold = 400
    pad = [(hold, hold), (0, 0)]
    longer = Recording(
        t=np.arange(recording.n_t + 2 * hold) / 200.0,
        q=np.pad(recording.q, pad, mode="edge"),
        tau=np.pad(recording.tau, pad, constant_values=99.0),
    )
    log = verify(identify(TRUTH.model, [recording], processing=SETTINGS), [longer], processing=SETTINGS).logs[0]
    assert log.t[0] > 2.0
    assert log.t[-1] < 12.0


def test_series_are_read_only():
    log = prediction()
    for series in (log.t, log.tau, log.predicted, log.dq):
        with pytest.raises(ValueError, match="read-only"):
            series[0] = 0.0


def test_a_log_of_another_number_of_joints_is_refused():
    t = np.arange(100) * 0.01
    three = Recording(t=t, q=np.ones((100, 3)), tau=np.ones((100, 3)), name="three")
    with pytest.raises(RecordingError, match="three: the log does not fit the robot; expected 2 joints"):
        verify(constant_model(), [three])


def test_a_log_without_torque_is_refused():
    with pytest.raises(RecordingError, match="no torque in the log"):
        verify(constant_model(), [replace(tiny_log(), tau=None)])


def test_no_log_is_refused():
    with pytest.raises(ModelError, match="no recording to verify on"):
        verify(constant_model(), [])
