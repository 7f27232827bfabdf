"""Identification of friction that warms up, from arms whose heat is counted in kelvins (`warm_arms`)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tauhat.dynamics import torque_model
from tauhat.errors import ModelError, RecordingError, TauhatWarning
from tauhat.estimation import Estimate, identify, load_estimate, warm_start
from tauhat.estimation.estimators import estimator_named
from tauhat.estimation.rows import filtered_rows
from tauhat.estimation.warming import slopes_of, thermal_term
from tauhat.recordings.processing import Processing, stretches
from tauhat.recordings.recording import Recording
from tauhat.verification.prediction import verify
from tauhat.verification.residual_tests import residual_tests
from warm_arms import two_link, warm_log, warmed_up


def slopes(estimate: Estimate) -> np.ndarray:
    standard = np.zeros(estimate.model.n_p)
    standard[estimate.base.independent] = estimate.values
    return slopes_of(estimate.model, standard)


def errors(estimate: Estimate, recording: Recording) -> np.ndarray:
    return np.array([joint.rms for joint in verify(estimate, [recording]).logs[0].joints])


def test_time_constants_are_recovered_without_a_thermometer():
    found = warmed_up()
    assert found.term.times == pytest.approx(found.arm.times, rel=0.05)


def test_the_change_of_friction_at_a_typical_speed_is_recovered():
    # Dry and viscous slopes are each less sure than what they make together.
    found = warmed_up()
    speeds = np.array(found.term.speeds)
    true, got = found.arm.scaled_slopes(speeds), slopes(found.thermal)
    together = np.column_stack([np.ones(2), speeds])
    assert (got * together).sum(axis=1) == pytest.approx((true * together).sum(axis=1), rel=0.05)


def test_dry_and_viscous_slopes_are_within_their_intervals():
    found = warmed_up()
    rows = {row.name: row for row in found.thermal.summary()}
    true = found.arm.scaled_slopes(np.array(found.term.speeds))
    for joint in range(2):
        for place, symbol in enumerate(("Hd", "Hv")):
            row = rows[f"{symbol}_{joint + 1}"]
            assert abs(row.value - true[joint, place]) < 2.95 * row.standard_error  # 99 % at 15 degrees of freedom


def test_the_rest_of_the_warm_up_is_noise():
    found = warmed_up()
    assert (found.thermal.joint_rms < np.array([0.2, 0.5]) * found.plain.joint_rms).all()


def test_unseen_cold_logs_are_predicted_better():
    found = warmed_up()
    cold = warm_log(found.arm, 2.0, seed=5)
    assert (errors(found.thermal, cold) < 0.4 * errors(found.plain, cold)).all()


def test_unseen_warm_logs_are_predicted_once_their_first_seconds_tell_the_warmth():
    found = warmed_up()
    warm = warm_log(found.arm, 2.0, warmer=found.hot, seed=6)
    start = warm_start(found.thermal, warm, seconds=20.0)
    assert start.warmth == pytest.approx(found.hot / found.kelvins, abs=0.03)
    assert start.rest is not None
    assert start.rest.t[0] >= warm.t[0] + 20.0
    later = errors(start.later, start.rest)
    assert (later < 0.15 * errors(found.thermal, start.rest)).all()
    assert later.sum() < 0.5 * errors(found.plain, start.rest).sum()


def test_the_warmth_of_a_log_that_begins_cold_is_nothing():
    found = warmed_up()
    start = warm_start(found.thermal, warm_log(found.arm, 0.5, seed=7))
    assert start.warmth == pytest.approx(0.0, abs=0.03)
    assert start.rest is None or start.rest.duration < 1.0


def test_seconds_that_a_log_does_not_have_make_its_warmth_no_surer():
    found = warmed_up()
    log = warm_log(found.arm, 0.5, warmer=found.hot, seed=7)
    short, asked = warm_start(found.thermal, log, seconds=30.0), warm_start(found.thermal, log, seconds=600.0)
    assert asked.standard_errors == pytest.approx(short.standard_errors, rel=1e-12)


def test_without_drift_the_slopes_are_zero():
    steady = two_link(changing=0.0)
    estimate = identify(torque_model(steady.robot, "plain,thermal"), [warm_log(steady, 15.0, rate=40.0)])
    place = [estimate.base.names[index][0] == "H" for index in estimate.base.independent]
    values, widths = estimate.values[place], estimate.half_intervals(confidence=0.99)[place]
    assert (np.abs(values) < widths).all()
    assert np.abs(values).max() < 0.05


def test_given_time_constants_are_kept():
    found = warmed_up()
    model = torque_model(found.arm.robot, "plain,thermal")
    term = thermal_term(model)
    assert term is not None
    fixed = model.with_term(replace(term, times=(450.0, 360.0)))
    estimate = identify(fixed, [found.log], processing=found.thermal.processing)
    settled = thermal_term(estimate.model)
    assert settled is not None
    assert settled.times == (450.0, 360.0)
    assert estimate.joint_rms == pytest.approx(found.thermal.joint_rms, rel=0.01)


def test_measured_temperatures_give_slopes_by_the_kelvin():
    found = warmed_up()
    model = torque_model(found.arm.robot, "inertia,rotor,viscous,dahl,offset,thermal-measured")
    estimate = identify(model, [found.log], processing=found.thermal.processing)
    arm, got = found.arm, slopes(estimate)
    assert got[:, 0] == pytest.approx(arm.dry * arm.dry_slope, rel=0.1)
    assert got[:, 1] == pytest.approx(arm.viscous * arm.viscous_slope, rel=0.05)


def test_measured_temperatures_are_missed_where_there_are_none():
    found = warmed_up()
    bare = replace(warm_log(found.arm, 0.5), temperature=None)
    with pytest.raises(RecordingError, match="needs what the log has not; expected temperature"):
        identify(torque_model(found.arm.robot, "plain,thermal-measured"), [bare])


def test_temperatures_follow_the_clock_of_the_motion():
    log = warm_log(two_link(), 0.5, warmer=30.0)
    parts = list(stretches(log, Processing(cutoff=5.0, motion_cutoff=10.0, delay=0.2), chunk=300))
    t = np.concatenate([part.t for part in parts])
    for joint in range(2):
        temperature = np.concatenate([part.temperature[joint] for part in parts])
        assert temperature == pytest.approx(np.interp(t + 0.2, log.t, log.temperature[:, joint]), abs=1e-9)


def test_the_state_is_driven_by_every_sample_whatever_is_kept_of_the_rows():
    found = warmed_up()
    model, base = found.thermal.model, found.thermal.base
    layout = model.layout(base.independent)
    names = [model.parameters[index].name for index in layout.parameters]
    rows = {}
    for cutoff in (1.0, 4.0):
        processing = replace(found.thermal.processing, cutoff=cutoff)
        parts = list(filtered_rows(model, layout, found.log, processing, chunk=1000))
        t, column = (np.concatenate([getattr(part, name) for part in parts], axis=-1) for name in ("t", "columns"))
        # theta |dq| over a period of the motion, which the low-pass leaves alone when it is squared with dq
        viscous, warm = column[names.index("Fv_1")], column[names.index("Hv_1")]
        late = t > t[-1] - 60.0
        rows[cutoff] = float((viscous[late] @ warm[late]) / (viscous[late] @ viscous[late]))
    assert rows[1.0] == pytest.approx(rows[4.0], rel=0.01)


def test_the_rows_do_not_depend_on_the_chunks():
    found = warmed_up()
    model = found.thermal.model
    layout, short = model.layout(found.thermal.base.independent), found.log.rows(0, 4000)
    whole, cut = (
        np.concatenate([part.columns for part in parts], axis=1)
        for parts in (
            list(filtered_rows(model, layout, short, found.thermal.processing, chunk=chunk)) for chunk in (4096, 333)
        )
    )
    assert cut == pytest.approx(whole, rel=1e-9, abs=1e-9)


def test_an_estimate_with_warmth_survives_its_file(tmp_path):
    found = warmed_up()
    found.thermal.save(tmp_path / "warm.json")
    back = load_estimate(tmp_path / "warm.json")
    cold = warm_log(found.arm, 0.5, seed=5)
    assert errors(back, cold) == pytest.approx(errors(found.thermal, cold), rel=1e-9)


def test_the_residual_of_a_model_without_warmth_names_the_term():
    found = warmed_up()
    cold = identify(found.plain.model, [warm_log(found.arm, 1.0, seed=8)], processing=found.plain.processing)
    bare = replace(found.log.rows(0, 12000), temperature=None)
    named = residual_tests(cold, [bare])[0]
    for joint in named.joints:
        assert "thermal" in {effect.term for effect in joint.tried}
    assert "thermal" in {effect.term for _, effect in named.ranked}


def test_short_recordings_are_warned_of():
    arm = two_link()
    with pytest.warns(TauhatWarning, match="too short to show friction that warms up"):
        identify(torque_model(arm.robot, "plain,thermal"), [warm_log(arm, 1.0)])


@pytest.mark.filterwarnings("ignore::tauhat.errors.TauhatWarning")
def test_methods_that_go_through_recordings_settle_the_warmth_or_refuse_the_term_by_name():
    arm = two_link()
    log, model = warm_log(arm, 0.3), torque_model(arm.robot, "plain,thermal")
    settled = thermal_term(identify(model, [log], estimator=estimator_named("sequential")).model)
    assert settled is not None
    assert len(settled.times) == 2
    with pytest.raises(ModelError, match="ekf cannot use term thermal"):
        identify(model, [log], estimator=estimator_named("ekf"))


def test_what_has_no_warmth_has_no_warm_start():
    found = warmed_up()
    with pytest.raises(ModelError, match="no friction that warms up"):
        warm_start(found.plain, found.log)
    with pytest.raises(ModelError, match="above zero"):
        warm_start(found.thermal, found.log, seconds=0.0)
