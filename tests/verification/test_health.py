"""What a nominal model says about a log: the joint whose torque has the sign reversed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sample_arms import planar_truth
from tauhat.dynamics import torque_model
from tauhat.errors import ModelError
from tauhat.recordings.recording import Recording
from tauhat.verification import check_axes, check_recording

TRUTH = planar_truth()
RECORDING = TRUTH.recording(noise=0.01 * np.random.default_rng(0).normal(size=(4000, 2)))


def signs(recording: Recording) -> list[tuple[str, str | None]]:
    findings = check_recording(TRUTH.model, recording)
    return [(finding.severity, finding.joint) for finding in findings if "sign" in finding.code]


def test_consistent_signs_are_well():
    assert signs(RECORDING) == [("ok", None)]


@pytest.mark.parametrize("joint", [0, 1])
def test_the_one_joint_with_reversed_torque_is_named(joint):
    reversed_torque = RECORDING.tau * np.where(np.arange(2) == joint, -1.0, 1.0)
    assert signs(replace(RECORDING, tau=reversed_torque)) == [("warning", f"j{joint + 1}")]


def test_torque_reversed_on_all_joints_is_an_error():
    assert signs(replace(RECORDING, tau=-RECORDING.tau)) == [("error", None)]


def test_a_joint_that_gravity_rules_is_told_by_its_nominal_torque():
    # without friction the power balance is silent
    gravity_only = TRUTH.standard * np.array([1.0] * 20 + [0.0] * 8)
    tau = replace(TRUTH, standard=gravity_only).recording().tau
    findings = check_recording(TRUTH.model, replace(RECORDING, tau=tau * np.array([-1.0, 1.0])))
    told = [finding for finding in findings if "sign" in finding.code]
    assert [finding.joint for finding in told] == ["j1"]
    assert "against the nominal model's (correlation -1.00)" in told[0].message


def test_axes_without_a_robot_know_no_nominal_torque():
    assert [finding.severity for finding in check_axes(RECORDING) if "sign" in finding.code] == ["ok"]


@pytest.mark.parametrize("check", [check_axes, lambda log: check_recording(torque_model(TRUTH.model.robot), log)])
def test_a_log_that_moves_only_where_filters_cannot_be_trusted_is_refused_in_words(check):
    rng = np.random.default_rng(0)
    t = np.arange(5000) * 0.002
    q = np.where(t > t[-1] - 0.01, 1.0, 0.0)[:, None] + 1e-5 * rng.integers(-1, 2, (t.size, 2))
    with pytest.raises(ModelError, match="no row of the recording is left"):
        check(Recording(t=t, q=q, tau=rng.normal(size=q.shape), joint_names=("j1", "j2")))
