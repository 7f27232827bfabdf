from __future__ import annotations

import numpy as np
import pytest
from sample_logs import codes, log_of, motion

from tauhat.recordings.checks import check_limits, check_log, sound_rows
from tauhat.recordings.findings import Finding, worst
from tauhat.recordings.mapfile import parse_map
from tauhat.recordings.reading import read_log
from tauhat.recordings.recording import Recording
from tauhat.recordings.unit_checks import fit_speed
from tauhat.recordings.value_checks import flat_top, quantisation_step
from tauhat.recordings.writing import write_recording
from tauhat.robots.joint import Joint, Limits
from tauhat.robots.robot import Robot


def found(log, code: str) -> Finding:
    matching = [finding for finding in check_log(log) if finding.code == code]
    assert len(matching) == 1, [finding.code for finding in check_log(log)]
    return matching[0]


def with_rows(*order: int | slice):
    """The sample motion with its rows taken in another order."""
    rows = np.concatenate([np.atleast_1d(np.arange(400)[part]) for part in order])
    return log_of(**{name: values[rows] for name, values in motion().items()})


def test_a_sound_log_has_nothing_against_it_and_says_what_was_looked_at() -> None:
    findings = check_log(log_of())
    assert codes(findings) == []
    assert worst(findings) == "ok"
    assert {finding.code for finding in findings} == {"clock", "quantisation", "velocity"}


def test_the_gravest_finding_comes_first() -> None:
    tau = motion()["tau"]
    tau[:, 1] = 0.0
    findings = check_log(log_of(tau=tau, t=motion()["t"] * 1e3, dq=None))
    assert [finding.severity for finding in findings] == ["error", "warning", "ok"]
    assert worst(findings) == "error"


def test_a_log_that_is_too_short_is_an_error() -> None:
    log = log_of().samples(0, 9)
    assert [(f.code, f.severity, f.number) for f in check_log(log)] == [("too_few_samples", "error", 9.0)]


def test_a_gap_is_found_with_its_length_and_row() -> None:
    finding = found(with_rows(slice(0, 200), slice(230, 400)), "time_gaps")
    assert finding.severity == "warning"
    assert finding.number == pytest.approx(31 / 200)
    assert "row 200" in finding.message


def test_rare_short_gaps_are_only_noted() -> None:
    assert found(with_rows(slice(0, 200), slice(203, 400)), "time_gaps").severity == "note"


def test_an_uneven_clock_is_found_with_its_number() -> None:
    m = motion()
    late = np.random.default_rng(0).uniform(-0.3, 0.3, 400) / 200.0
    finding = found(log_of(t=m["t"] + late), "time_jitter")
    steps = np.diff(m["t"] + late)
    assert finding.number == pytest.approx(steps.std() / steps.mean())


def test_time_going_back_is_an_error_and_the_rows_before_are_still_judged() -> None:
    log = with_rows(slice(0, 300), slice(100, 400))
    finding = found(log, "time_back")
    assert (finding.severity, finding.number) == ("error", 1.0)
    assert "row 300 by" in finding.message
    assert "velocity" in [f.code for f in check_log(log)]
    assert np.count_nonzero(sound_rows(log)) == 400


def test_exact_duplicates_are_a_warning_and_torn_ones_an_error() -> None:
    doubled = with_rows(slice(0, 50), slice(49, 400))
    assert (found(doubled, "duplicate_rows").severity, found(doubled, "duplicate_rows").number) == ("warning", 1.0)
    t = motion()["t"]
    t[1::2] = t[::2]
    assert found(log_of(t=t), "duplicate_time").severity == "error"
    assert "duplicate_rows" not in codes(check_log(log_of(t=t)))


def test_a_clock_that_stands_is_an_error() -> None:
    assert found(log_of(t=np.zeros(400)), "time_stands").severity == "error"


@pytest.mark.parametrize(("factor", "guess"), [(1e3, "ms"), (1e9, "us or ns"), (1e-3, "s?")])
def test_a_clock_in_another_unit_is_doubted(factor: float, guess: str) -> None:
    finding = found(log_of(t=motion()["t"] * factor, dq=None), "time_unit")
    assert guess in finding.message
    assert "[time] unit" in finding.advice


def test_rows_without_numbers_and_with_impossible_ones_are_counted() -> None:
    m = motion()
    m["q"][[7, 90], 1] = np.nan
    m["tau"][200, 0] = 1e154
    m["t"][300] = 1e200
    log = log_of(**m)
    assert (found(log, "corrupt_rows").number, found(log, "impossible_values").number) == (2.0, 2.0)
    assert "first at row 7" in found(log, "corrupt_rows").message


@pytest.mark.parametrize(("name", "height"), [("q", 0.2), ("dq", 3.0), ("tau", 60.0)])
def test_a_single_sample_out_of_line_is_found_where_it_is(name: str, height: float) -> None:
    values = motion()[name]
    values[123, 1] += height
    finding = found(log_of(**{name: values}), "spikes")
    assert (finding.joint, finding.number) == ("b", 1.0)
    assert "row 123" in finding.message


def test_a_step_and_a_knock_of_several_samples_are_no_spikes() -> None:
    tau = motion()["tau"]
    tau[200:, 0] += 40.0
    tau[100:104, 1] += [20.0, 60.0, 50.0, 20.0]
    assert "spikes" not in codes(check_log(log_of(tau=tau)))


def test_a_coarse_encoder_is_noted_where_its_steps_drown_the_speed() -> None:
    step = 2.0 * np.pi / 500.0
    q = np.round(motion()["q"] / step) * step
    finding = [f for f in check_log(log_of(q=q, dq=None)) if f.code == "quantisation" and f.severity == "note"]
    assert finding
    assert finding[0].number == pytest.approx(step, rel=1e-6)


@pytest.mark.parametrize("step", [1e-5, 3e-4])
def test_the_quantisation_step_is_recovered(step: float) -> None:
    walk = np.cumsum(np.random.default_rng(3).normal(size=4000)) * 2e-3
    values = np.round(walk / step) * step
    assert quantisation_step(values) == pytest.approx(step, rel=1e-6)


def test_numbers_without_a_grid_have_no_step() -> None:
    assert quantisation_step(np.random.default_rng(0).normal(size=2000)) == 0.0
    assert quantisation_step(np.zeros(100)) == 0.0


def test_a_joint_that_stands_is_noted_and_one_that_is_not_there_is_a_warning() -> None:
    m = motion()
    m["q"][:, 1] = 0.3
    m["dq"][:, 1] = 0.0
    finding = found(log_of(**m), "standing_joints")
    assert (finding.severity, finding.message) == ("note", "standing still: b")
    m["tau"][:, 1] = 0.0
    assert found(log_of(**m), "missing_joint").joint == "b"


def test_torque_that_is_zero_or_missing_is_said() -> None:
    tau = motion()["tau"]
    tau[:, 0] = 0.0
    assert (found(log_of(tau=tau), "torque_zero").joint, found(log_of(tau=tau), "torque_zero").severity) == (
        "a",
        "error",
    )
    assert found(log_of(tau=None), "torque_missing").severity == "note"


def test_a_flat_top_is_found_with_its_length() -> None:
    tau = motion()["tau"]
    limit = 0.8 * tau[:, 0].max()
    longest = flat_top(np.minimum(tau[:, 0], limit))
    assert longest > 5
    tau[:, 0] = np.minimum(tau[:, 0], limit)
    assert found(log_of(tau=tau), "saturation").number == longest


def test_a_log_that_holds_each_value_for_some_samples_has_no_flat_top() -> None:
    assert flat_top(np.repeat(motion()["tau"][:, 0], 8)) == 0
    assert flat_top(np.ones(50)) == 0


@pytest.mark.parametrize(
    ("factor", "unit", "guess"), [(180.0 / np.pi, "rad", "degrees"), (1e5, "rad", "counts"), (1e3, "m", "mm")]
)
def test_a_position_no_joint_reaches_is_doubted(factor: float, unit: str, guess: str) -> None:
    q = motion()["q"] * factor
    log = log_of(q=np.round(q) if guess == "counts" else q, dq=None, units=(unit, unit))
    doubts = [f for f in check_log(log) if f.code == "position_unit"]
    assert [f.joint for f in doubts] == ["a", "b"]
    assert all(guess in f.message for f in doubts)


def test_a_torque_and_a_temperature_in_another_unit_are_doubted() -> None:
    assert found(log_of(tau=motion()["tau"] * 1e5), "torque_unit").severity == "warning"
    assert found(log_of(temperature=np.full((400, 2), 303.0)), "temperature_unit").severity == "warning"
    assert codes(check_log(log_of(temperature=np.full((400, 2), 30.0)))) == []


@pytest.mark.parametrize(
    ("factor", "code", "advice"),
    [
        (-1.0, "velocity_sign", "sign"),
        (180.0 / np.pi, "velocity_scale", "velocity is in degrees"),
        (np.pi / 180.0, "velocity_scale", "position is in degrees"),
        (100.0, "velocity_scale", "gear ratio"),
    ],
)
def test_a_velocity_of_another_unit_or_sign_is_an_error_that_names_it(factor: float, code: str, advice: str) -> None:
    findings = [f for f in check_log(log_of(dq=motion()["dq"] * factor)) if f.code == code]
    assert [f.joint for f in findings] == ["a", "b"]
    assert all(f.severity == "error" and advice in f.advice for f in findings)
    assert findings[0].number == pytest.approx(1.0 / factor, rel=0.02)


def test_milliseconds_taken_for_seconds_show_in_the_velocity() -> None:
    findings = [f for f in check_log(log_of(t=motion()["t"] * 1e3)) if f.code == "velocity_scale"]
    assert all("[time] unit" in f.advice for f in findings)
    assert findings


def test_velocity_columns_that_are_swapped_are_doubted() -> None:
    log = log_of(dq=motion()["dq"][:, ::-1])
    assert codes(check_log(log), "warning") == ["velocity_mismatch", "velocity_mismatch"]


@pytest.mark.parametrize(("lag", "late"), [(3, "velocity"), (-2, "position")])
def test_a_late_channel_is_found_and_the_map_it_advises_undoes_it(tmp_path, lag: int, late: str) -> None:
    m = motion(n_t=800)
    shifted = {**m, "dq": np.roll(m["dq"], lag, axis=0)}
    inner = {name: values[10:-10] for name, values in shifted.items()}
    finding = found(log_of(**inner), "velocity_lag")
    assert finding.severity == "warning"
    assert finding.number == pytest.approx(lag, abs=0.05)
    assert finding.advice.startswith(f"[{late}] delay_samples = {abs(lag)}.0")
    write_recording(Recording(**inner), tmp_path / "run.parquet")
    sections = {"position": "q", "velocity": "dq"}
    text = '[time]\ncolumn = "t"\n' + "".join(
        f'[{kind}]\ncolumns = "{stem}_{{1..2}}"\n' + (f"delay_samples = {abs(lag)}\n" if kind == late else "")
        for kind, stem in sections.items()
    )
    mended = read_log(tmp_path / "run.parquet", map=parse_map(text))
    assert "velocity_lag" not in codes(check_log(mended))


def test_the_fit_of_two_speeds_recovers_scale_and_lag() -> None:
    m = motion(n_t=800)
    fit = fit_speed(m["t"], 3.0 * m["q"][:, 0], np.roll(m["dq"][:, 0], 2))
    assert fit.slope == pytest.approx(3.0, rel=0.02)
    assert fit.lag == pytest.approx(2.0, abs=0.05)


def robot(**limits: float) -> Robot:
    joints = tuple(
        Joint(
            name=name, kind="revolute", parent=index - 1, rotation=np.eye(3), translation=np.zeros(3),
            axis=np.array([0.0, 0.0, 1.0]), limits=Limits(**limits),
        )
        for index, name in enumerate(("hip", "knee"))
    )  # fmt: skip
    return Robot(name="arm", joints=joints)


def test_a_log_inside_the_limits_says_so() -> None:
    inside = robot(lower=-1.01, upper=1.01, velocity=10.0, effort=100.0)
    assert [(f.code, f.severity) for f in check_limits(log_of(), inside)] == [("limits", "ok")]
    assert [f.code for f in check_limits(log_of(), robot())] == ["limits"]


@pytest.mark.parametrize(
    ("limits", "code", "severity", "number"),
    [
        ({"upper": 0.5}, "position_limit", "warning", 1.0),
        ({"lower": -0.5}, "position_limit", "warning", -1.0),
        ({"velocity": 2.0}, "velocity_limit", "warning", 5.03),
        ({"effort": 5.0}, "effort_limit", "note", None),
    ],
)
def test_a_log_beyond_a_limit_is_found_with_joint_and_value(limits, code: str, severity: str, number) -> None:
    findings = check_limits(log_of(), robot(**limits))
    assert [(f.code, f.severity, f.joint) for f in findings] == [(code, severity, "hip"), (code, severity, "knee")]
    if number is not None:
        assert findings[1].number == pytest.approx(number, abs=0.05)


def test_a_robot_of_another_number_of_joints_is_an_error() -> None:
    log = log_of(**motion(n_v=3), joint_names=("a", "b", "c"), units=("rad",) * 3)
    findings = check_limits(log, robot())
    assert [(f.code, f.severity) for f in findings] == [("joint_count", "error")]
    assert "3 joints, arm has 2: hip, knee" in findings[0].message
