"""A controller in a file: the loop it stands for is the one that Python makes, and what is wrong in it is named."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from simulated_logs import LATE, LAW, driven

from tauhat.control import PD, PID, PDFeedforward, PDGravity
from tauhat.errors import ModelError
from tauhat.estimation import ClosedLoop, SampledReference, estimator_named, identify, load_estimate
from tauhat.excitation import random_fourier
from tauhat.recordings import LogSource, Recording, read_recording, write_columns, write_recording
from tauhat.robots import load_robot
from tauhat.simulation.controller_file import load_closed_loop

GAINS = 'kind = "pd"\nkp = [3000, 1000]\nkd = [300, 100]\n'
MEASURED = 'reference = "measured"\n'
COLUMNS = '[reference]\nposition = { columns = "asked_{1..2}", unit = "deg" }\n'
MAP = """
[time]
column = "t"
[position]
columns = "q_{1..2}"
[torque]
columns = "tau_{1..2}"
"""


class Logged(NamedTuple):
    """A log of a two-link arm with its reference [deg] and the speed of that [deg/s] in columns of their own."""

    folder: Path
    source: LogSource
    recording: Recording

    def loop(self, text: str, *, logs: int = 1, robot: str = "two_link") -> ClosedLoop:
        path = self.folder / "controller.toml"
        path.write_text(text, encoding="utf-8")
        return load_closed_loop(path, load_robot(robot), [self.source] * logs)


@pytest.fixture
def logged(tmp_path: Path) -> Logged:
    arm = driven()
    recording = arm.recording(np.random.default_rng(0), position=1e-4)
    reference = arm.loop.references[0].sample(arm.t)
    log, mapped = tmp_path / "run.csv", tmp_path / "run.map.toml"
    mapped.write_text(MAP, encoding="utf-8")
    columns = {"t": recording.t}
    for joint in range(2):
        columns |= {f"q_{joint + 1}": recording.q[:, joint], f"tau_{joint + 1}": recording.tau[:, joint]}
        columns |= {
            f"asked_{joint + 1}": np.degrees(reference.q[:, joint]),
            f"speed_{joint + 1}": np.degrees(reference.dq[:, joint]),
        }
    write_columns(columns, log)
    return Logged(tmp_path, LogSource(path=log), read_recording(log))


def test_every_law_of_a_file_is_that_of_the_control_room(logged):
    of_kind = {"pd": PD, "pd-gravity": PDGravity, "pd-feedforward": PDFeedforward, "pid": PID}
    for kind, law in of_kind.items():
        more = "ki = 5\n" if kind == "pid" else ""
        found = logged.loop(f'kind = "{kind}"\nkp = [3000, 1000]\nkd = 90\ntorque_limit = 60\n{more}{MEASURED}').law
        assert type(found) is law
        assert (found.kp.tolist(), found.kd.tolist()) == ([3000.0, 1000.0], [90.0, 90.0])
        assert found.torque_limit.tolist() == [60.0, 60.0]
        assert found.integral_gain.tolist() == ([5.0, 5.0] if kind == "pid" else [0.0, 0.0])
    tuned = logged.loop(f'kind = "tuned"\nbandwidth = 12\n{MEASURED}')
    assert (tuned.law, tuned.bandwidth, tuned.references) == (None, 12.0, ())


def test_without_a_limit_the_robots_own_counts(logged):
    limit = load_robot("two_link").effort_limit
    assert np.isfinite(limit).all()
    np.testing.assert_array_equal(logged.loop(GAINS + MEASURED).law.torque_limit, limit)


def test_rate_and_delay_are_those_of_the_controller(logged):
    loop = logged.loop(f"{GAINS}rate = 2000\ndelay = 0.0015\n{MEASURED}")
    assert (loop.control_rate, loop.delay) == (2000.0, 3)
    stepping = loop.stepping(4e-3)
    assert stepping.delay * stepping.hold * 4e-3 / stepping.substeps == pytest.approx(1.5e-3)
    assert logged.loop(GAINS + MEASURED).control_rate is None


def test_columns_of_the_log_are_its_reference_in_their_own_unit(logged):
    whole = driven().loop.references[0].sample(driven().t)
    (slope,) = logged.loop(GAINS + COLUMNS).references
    (given,) = logged.loop(f'{GAINS}{COLUMNS}velocity = {{ columns = "speed_{{1..2}}", unit = "deg/s" }}').references
    (none,) = logged.loop(f'{GAINS}{COLUMNS}velocity = "none"').references
    for reference in (slope, given, none):
        np.testing.assert_allclose(reference.q, whole.q, atol=1e-9)
    np.testing.assert_allclose(given.dq, whole.dq, atol=1e-9)
    error = np.abs(slope.dq - whole.dq).max()
    assert 0.0 < error < 1e-3 * np.abs(whole.dq).max()
    np.testing.assert_allclose(given.ddq, whole.ddq, atol=2e-3 * np.abs(whole.ddq).max())
    assert not none.dq.any()
    assert not none.ddq.any()


def test_a_window_of_the_log_has_the_reference_of_its_own_rows(logged):
    part = logged._replace(source=LogSource(path=logged.source.path, rows=(500, 900)))
    (reference,) = part.loop(GAINS + COLUMNS).references
    assert reference.t[0] == logged.recording.t[500]
    whole = driven().loop.references[0].sample(driven().t[500:900])
    np.testing.assert_allclose(reference.q, whole.q, atol=1e-9)


def test_a_motion_file_is_the_reference_from_its_start_on(logged):
    robot = load_robot("two_link")
    motion = random_fourier(robot, period=4.0, harmonics=3, rng=np.random.default_rng(0))
    t = np.arange(0.0, 4.0, 0.01)
    samples = motion.sample(t)
    written = Recording(t=t, q=samples.q, dq=samples.dq, ddq=samples.ddq, joint_names=robot.joint_names)
    write_recording(written, logged.folder / "motion.parquet")
    asked = np.linspace(0.3, 3.7, 7)
    expected = motion.sample(asked)
    for text, later in (("", 0.0), ("start = 2.5", 2.5)):
        loop = logged.loop(f'{GAINS}[reference]\nfile = "motion.parquet"\n{text}', logs=2)
        assert len(loop.references) == 2
        for reference in loop.references:
            found = reference.sample(asked + later)
            np.testing.assert_allclose(found.q, expected.q, atol=1e-8)
            np.testing.assert_allclose(found.dq, expected.dq, atol=1e-6)
    names = 'file = ["motion.parquet", "motion.parquet"]'
    assert len(logged.loop(f"{GAINS}[reference]\n{names}", logs=2).references) == 2


@pytest.mark.parametrize("method", ["didim", "idim-iv", "clie", "cloe"])
def test_an_estimate_with_the_file_is_the_one_with_the_loop_that_python_makes_and_holds_the_truth(method, logged):
    arm = driven()
    gains = f'kind = "pd-gravity"\nkp = {LAW.kp.tolist()}\nkd = {LAW.kd.tolist()}\ntorque_limit = 1e6\n'
    speed = 'velocity = { columns = "speed_{1..2}", unit = "deg/s" }'
    path = logged.folder / "controller.toml"
    path.write_text(gains + COLUMNS + speed, encoding="utf-8")
    loop = load_closed_loop(path, arm.truth.model.robot, [logged.source])
    given = loop.references[0]
    law = PDGravity(kp=LAW.kp, kd=LAW.kd, torque_limit=[1e6, 1e6])
    same = ClosedLoop(law=law, references=(SampledReference(t=given.t, q=given.q, dq=given.dq, ddq=given.ddq),))
    found, expected = (
        identify(arm.truth.model, [logged.recording], estimator=estimator_named(method, loop=own), processing=LATE)
        for own in (loop, same)
    )
    np.testing.assert_array_equal(found.values, expected.values)
    assert np.abs(found.values - arm.values).max() < 0.01 * np.abs(arm.values).max()


def test_the_estimate_file_names_the_controller_it_was_found_with(logged):
    arm = driven()
    path = logged.folder / "controller.toml"
    gains = f'kind = "pd-gravity"\nkp = {LAW.kp.tolist()}\nkd = {LAW.kd.tolist()}\ntorque_limit = 1e6\n'
    path.write_text(f"{gains}rate = 10000\ndelay = 0.0001\n{COLUMNS}", encoding="utf-8")
    loop = load_closed_loop(path, arm.truth.model.robot, [logged.source])
    estimator = estimator_named("idim-iv", loop=loop)
    estimate = identify(arm.truth.model, [logged.recording], estimator=estimator, processing=LATE)
    estimate.save(logged.folder / "estimate.json")
    told = load_estimate(logged.folder / "estimate.json").estimator["loop"]
    assert told["file"]["name"] == "controller.toml"
    assert len(told["file"]["sha256"]) == 64
    assert told["law"]["kp"] == LAW.kp.tolist()
    assert told["law"]["torque_limit"] == [1e6, 1e6]
    assert (told["control_rate"], told["delay"]) == (10000.0, 1)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('kind = "lqr"', r"unknown kind; expected tuned \| pd \| pd-gravity \| pd-feedforward \| pid, got lqr"),
        ("kp = 1", "a key is missing; expected kind"),
        ('kind = "computed-torque"', "computed-torque needs a model of its own, which this file cannot hold; exp"),
        ('kind = "pd"\nkp = [1, 2, 3]\nkd = 1', r"wrong number of kp; expected 1, or 2 \(joint_1, joint_2\), got 3"),
        ('kind = "pd"\nkp = 1', "a key is missing; expected kd"),
        ('kind = "pd"\nkp = 1\nkd = -1', "a gain is negative"),
        ('kind = "pd"\nkp = 1\nkd = 1\nki = 1', "a pd controller has no ki"),
        (f"{GAINS}bandwidth = 3", "a pd controller has no bandwidth"),
        (f"{GAINS}torque_limits = 3", "unknown key; got torque_limits; did you mean torque_limit"),
        (f"{GAINS}rate = 0", r"rate of the controller; expected > 0, got 0\.0"),
        (f"{GAINS}delay = 0.001", r"a delay needs the rate of the controller; expected rate \[Hz\]"),
        (f"{GAINS}rate = 1000\ndelay = 0.0015", r"control periods in the delay; expected a whole .*, got 1\.5"),
        (f"{GAINS}rate = 1000\ndelay = 2", "control periods in the delay; expected .*, at most 1000, got 2000"),
        (GAINS, r"the reference is missing; expected \[reference\] with position or file, or reference = "),
        (f'{GAINS}reference = "asked"', "unknown reference; expected .*, got 'asked'"),
        (f"{GAINS}[reference]", "not one source of the reference; expected either position or file"),
        (f"{GAINS}{COLUMNS}start = 1", "start does not go with this source"),
        (f"{GAINS}{COLUMNS}velocity = 0", r"velocity is not a table; expected .* or \"none\", got 0"),
        (f'{GAINS}[reference]\nposition = {{ columns = "no_{{1..2}}" }}', r"no column 'no_1' in run\.csv; there are t"),
        (f'{GAINS}[reference]\nposition = {{ column = "q_1" }}', r"\[position\]: unknown key column"),
        (f'{GAINS}[reference]\nposition = {{ columns = "asked_1" }}', "the reference does not fit the robot; expec"),
        (f'{GAINS}[reference]\nfile = "no.parquet"', r"no\.parquet"),
        (f"{GAINS}[reference]\nfile = 3", "file is not a name, or a list of names; got 3"),
        (f'{GAINS}[reference]\nfile = ["a", "b"]', "wrong number of motion files; expected 1 or 1, got 2"),
        ("kind = [", "not valid TOML"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_in_one_line_that_names_the_file(logged, text, message):
    with pytest.raises(ModelError, match=rf"controller\.toml.*{message}") as caught:
        logged.loop(text)
    assert "\n" not in str(caught.value)


def test_a_law_that_adds_a_models_torque_is_refused_where_the_description_has_none(logged, tmp_path):
    arm = tmp_path / "arm.toml"
    joint = '[[joints]]\nname = "joint_{0}"\nkind = "revolute"\n'
    arm.write_text('name = "arm"\nconvention = "modified"\n' + joint.format(1) + joint.format(2), encoding="utf-8")
    with pytest.raises(ModelError, match=r"pd-gravity adds torque of the robot's description, which has no masses"):
        logged.loop(f'kind = "pd-gravity"\nkp = 1\nkd = 1\n{MEASURED}', robot=str(arm))
    assert logged.loop(f'kind = "pd"\nkp = 1\nkd = 1\n{MEASURED}', robot=str(arm)).law.n_v == 2


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(ModelError, match=r"no\.toml"):
        load_closed_loop(tmp_path / "no.toml", load_robot("two_link"), [])


def test_an_estimator_that_does_not_simulate_refuses_a_loop():
    with pytest.raises(ModelError, match=r"simulate the robot; expected idim-iv, didim, cloe, clie, got wls"):
        estimator_named("wls", loop=ClosedLoop())
    assert estimator_named("didim", loop=ClosedLoop(bandwidth=7.0)).loop.bandwidth == 7.0


def test_a_negative_delay_is_refused():
    with pytest.raises(ModelError, match=r"delay is negative; got -1"):
        ClosedLoop(delay=-1)
