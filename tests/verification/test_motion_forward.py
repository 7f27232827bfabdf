"""Recordings done again by simulated robots, against what MuJoCo did."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from motion_cases import rehearsed

from sample_arms import planar_truth
from tauhat.dynamics import torque_model
from tauhat.errors import ModelError
from tauhat.estimation import ClosedLoop, identify
from tauhat.verification.motion_forward import forward_motion


@cache
def unknown_loop():
    case = rehearsed()
    return forward_motion(case.estimate, case.log.recording)


@cache
def known_loop():
    case = rehearsed()
    loop = ClosedLoop(law=case.law, references=[case.unseen], control_rate=1000.0, longest_step=5e-4)
    return forward_motion(case.exact, case.log.recording, loop=loop)


def test_the_true_model_under_the_robots_own_law_moves_as_mujocos_plant_did():
    result = known_loop()
    tracking = np.sqrt(np.mean((rehearsed().log.truth.q - rehearsed().log.truth.reference.q) ** 2, axis=0))
    assert result.known
    assert (result.run("identified", "followed").rms < 0.03 * tracking).all()
    assert (result.run("nominal", "followed").rms > 0.1 * tracking).any()


def test_the_measured_torque_drives_the_true_model_along_the_measured_motion_and_the_nominal_one_off_it():
    result = known_loop()
    identified, nominal = result.run("identified", "driven"), result.run("nominal", "driven")
    assert (identified.rms < 0.01 * result.span).all()
    assert np.linalg.norm(nominal.rms) > 20.0 * np.linalg.norm(identified.rms)


def test_without_law_and_reference_torque_and_drift_tell_the_models_apart():
    result = unknown_loop()
    assert not result.known
    for way, figure, most in (("followed", "torque_rms", 0.5), ("driven", "torque_rms", 0.2), ("driven", "rms", 0.2)):
        identified, nominal = (getattr(result.run(model, way), figure) for model in ("identified", "nominal"))
        assert np.linalg.norm(identified) < most * np.linalg.norm(nominal)


def test_figures_are_those_of_the_series():
    result = unknown_loop()
    run = result.run("nominal", "driven")
    np.testing.assert_allclose(run.rms, np.sqrt(np.mean((run.q - result.q) ** 2, axis=0)))
    np.testing.assert_allclose(run.worst, np.abs(run.q - result.q).max(axis=0))
    plain = result.to_dict()
    assert [(entry["model"], entry["way"]) for entry in plain["runs"]] == [
        ("identified", "followed"),
        ("nominal", "followed"),
        ("identified", "driven"),
        ("nominal", "driven"),
    ]
    assert plain["runs"][3]["rms"] == run.rms.tolist()
    with pytest.raises(ModelError, match="no such run; got nominal, flown"):
        result.run("nominal", "flown")


def test_a_model_that_moves_no_robot_is_told():
    case = rehearsed()
    broken = replace(case.estimate, values=-case.estimate.values)
    run = forward_motion(broken, case.log.recording).run("identified", "driven")
    assert "mass matrix is not positive definite" in run.failure
    assert run.to_dict()["rms"] == [None] * 6


def test_a_description_without_masses_leaves_the_identified_model_alone():
    truth = planar_truth()
    bare = replace(truth.model.robot, joints=tuple(replace(j, inertia=np.zeros(10)) for j in truth.model.robot.joints))
    estimate = identify(torque_model(bare), [truth.recording(seconds=8.0)])
    result = forward_motion(estimate, truth.recording(seed=4, seconds=5.0))
    assert [run.model for run in result.runs] == ["identified", "identified"]
    assert (result.run("identified", "driven").rms < 0.02 * result.span).all()
