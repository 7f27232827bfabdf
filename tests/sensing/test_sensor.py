"""The force sensor: a known push comes back as a wrench, steps are what a log gives, starts and delays are honest."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pinocchio
import pytest
from scipy.interpolate import interp1d
from scipy.signal import lfilter
from sensed_arms import RATE, frictionless, motion

from tauhat.dynamics import torque_model
from tauhat.errors import RecordingError, SensingError
from tauhat.estimation import identify
from tauhat.recordings import Recording
from tauhat.robots import inertia_at_origin, load_robot
from tauhat.robots.kinematics import pinocchio_model
from tauhat.sensing import (
    OBSERVERS,
    ForceSensor,
    TorqueObserver,
    WrenchSolver,
    directions_named,
    force_sensor,
    load_tool,
    observer_named,
)
from tauhat.sensing.beside_sensor import beside_sensor
from tauhat.sensing.sensed_log import sensed_columns

MODEL = frictionless()
Q, TAU = motion(MODEL.robot)
T = np.arange(len(Q)) / RATE
SENSOR = ForceSensor(model=MODEL, rate=RATE)
READY = np.array([0.0, -0.6, 0.0, -2.2, 0.0, 1.6, 0.8])
PUSH = np.array([12.0, -20.0, 8.0, 0.0, 0.0, 0.0])


def late_by(kept: float, values: np.ndarray) -> np.ndarray:
    """Return values behind a low-pass of first order that keeps this part of itself, by SciPy."""
    return lfilter([1.0 - kept], [1.0, -kept], values, axis=0, zi=kept * values[:1])[0]


def recording(tau: np.ndarray = TAU, **changes: object) -> Recording:
    return Recording(**{"t": T, "q": Q, "tau": tau, **changes})


def pushed(wrench: np.ndarray) -> Recording:
    """Return a slow motion away from singularities in which something pushes with this wrench, (6,) in base axes."""
    swing = 0.5 * T[:, None] + np.arange(7)
    q = READY + 0.1 * np.sin(swing)
    model, solver = pinocchio_model(MODEL.robot), WrenchSolver(robot=MODEL.robot)
    data = model.createData()
    states = zip(q, 0.05 * np.cos(swing), -0.025 * np.sin(swing), strict=True)
    free = np.array([pinocchio.rnea(model, data, *state) for state in states])
    return recording(free - np.array([solver.jacobian(row)[0].T @ wrench for row in q]), q=q)


def test_a_constant_push_comes_back_within_its_error_bars():
    found = SENSOR.along(pushed(PUSH))
    errors = np.abs(found.wrench - PUSH)[found.settled]
    assert errors.max() < 1.0
    assert (errors < 3.0 * found.wrench_std[found.settled]).all()
    assert found.frame == MODEL.robot.frames[-1].name


def test_along_one_known_direction_the_same_push_is_surer():
    along_z = WrenchSolver(robot=MODEL.robot, directions=directions_named("fz"))
    up = np.array([0.0, 0.0, 25.0, 0.0, 0.0, 0.0])
    one = replace(SENSOR, wrench=along_z).along(pushed(up))
    full = SENSOR.along(pushed(up))
    assert one.wrench[one.settled, 2] == pytest.approx(25.0, abs=0.5)
    assert (one.wrench_std[one.settled, 2] < full.wrench_std[full.settled, 2]).all()
    assert (np.delete(one.wrench_std, 2, axis=1) == 0.0).all()
    assert one.solved == (False, False, True, False, False, False)


@pytest.mark.parametrize("name", OBSERVERS)
def test_steps_are_what_a_log_gives_and_leave_the_memory_alone(name):
    sensor = ForceSensor(model=MODEL, rate=RATE, observer=observer_named(name), delay=0.0034)
    found = sensor.along(recording())
    memory = sensor.start()
    for k in range(40):
        before = memory.copy()
        memory, sensed = sensor.advance(memory, Q[k], TAU[k])
        again = sensor.advance(before, Q[k], TAU[k])[1]
        assert (sensed.tau == found.tau[k]).all()
        assert (again.tau == sensed.tau).all()
        assert (sensed.wrench == found.wrench[k]).all()
        assert np.sqrt(np.diag(sensed.covariance)) == pytest.approx(found.wrench_std[k], rel=1e-12)
        assert np.sqrt(sensed.variance) == pytest.approx(found.tau_std[k], rel=1e-12)


def test_without_gaps_torque_is_that_of_the_observer_and_wrench_that_of_the_solver():
    log = pushed(PUSH)
    found = SENSOR.along(log)
    observed = TorqueObserver(model=MODEL, step=1.0 / RATE).along(log.q, log.tau)
    assert found.tau == pytest.approx(observed.tau, abs=1e-12)
    assert found.raw == pytest.approx(observed.raw, abs=1e-12)
    assert (found.tau_std**2 >= observed.variance).all()
    late = found.settled & (T > 1.0)
    assert found.tau_std[late] ** 2 == pytest.approx(observed.variance[late], rel=0.1)
    kept = np.exp(-SENSOR.observer.gain / RATE)
    position, torque = (late_by(kept, values) for values in (observed.q, observed.tau))
    assert found.q == pytest.approx(position, abs=1e-12)
    assert found.lag == pytest.approx(observed.tau - torque, abs=1e-12)
    variance = found.tau_std[late] ** 2 + found.lag[late] ** 2
    solved = WrenchSolver(robot=MODEL.robot).along(found.q[late], observed.tau[late], variance)
    assert found.wrench[late] == pytest.approx(solved.wrench, abs=1e-6)
    assert found.wrench_std[late] == pytest.approx(solved.standard_errors, rel=1e-6)


def test_causal_a_log_cut_off_gives_the_same_up_to_the_cut():
    whole, cut = SENSOR.along(recording()), SENSOR.along(recording().rows(0, 1500))
    assert (cut.tau == whole.tau[:1500]).all()
    assert (cut.wrench == whole.wrench[:1500]).all()


@pytest.mark.parametrize("name", [name for name in OBSERVERS if name != "sliding-mode"])
def test_behind_a_start_in_motion_the_truth_is_inside_the_error_bars(name):
    found = ForceSensor(model=MODEL, rate=RATE, observer=observer_named(name)).along(recording())
    assert (np.abs(found.tau) < 2.0 * found.tau_std).all()
    assert found.tau_std[0] == pytest.approx(MODEL.strength, rel=1e-3)
    assert (found.tau_std[-1] < 2.0 * MODEL.rms).all()


@pytest.mark.parametrize("delay", [0.0034, 0.002, -0.0027])
def test_the_delay_of_the_estimate_is_taken_out(delay):
    earlier = interp1d(T, Q, axis=0, kind="cubic", fill_value="extrapolate")(T - delay)
    late_position = recording(q=earlier)  # logged later by the delay
    late = ForceSensor(model=MODEL, rate=RATE, delay=delay).along(late_position)
    ignored = SENSOR.along(late_position)
    inner = late.settled & (T > 1.0) & (T < 2.9)
    assert np.abs(late.tau[inner]).max() < 0.25 * np.abs(ignored.tau[inner]).max()


def test_the_cut_off_is_ten_hertz_or_what_the_rate_allows():
    assert SENSOR.cutoff == 10.0
    slow = ForceSensor(model=MODEL, rate=20.0)
    assert slow.cutoff == pytest.approx(9.0)
    with pytest.raises(SensingError, match="cut-off of the filter"):
        ForceSensor(model=MODEL, rate=20.0, cutoff=10.0)


def test_a_tool_that_the_model_carries_is_no_force_and_taken_off_again_it_is_none():
    body = inertia_at_origin(mass=1.5, com=np.array([0.02, -0.01, 0.1]), inertia_at_com=0.01 * np.eye(3))
    inertia = MODEL.robot.inertia.copy()
    inertia[-1] += body
    loaded = replace(MODEL, inertia=inertia)
    same = MODEL.carrying(body)
    assert same.inertia == pytest.approx(loaded.inertia)
    assert same.carrying(-body, MODEL.robot.joint_names[-1]).inertia == pytest.approx(MODEL.inertia)
    bare, carrying = ForceSensor(model=MODEL, rate=RATE), ForceSensor(model=same, rate=RATE)
    truth = TorqueObserver(model=loaded, step=1.0 / RATE).along(Q, TAU)
    assert carrying.along(recording()).tau == pytest.approx(truth.tau, abs=1e-9)
    weight = np.abs(carrying.along(recording()).wrench[-1000:, 2] - bare.along(recording()).wrench[-1000:, 2])
    assert weight.mean() == pytest.approx(1.5 * 9.81, rel=0.2)
    with pytest.raises(SensingError, match="no such link for a tool"):
        MODEL.carrying(body, "hand")


def test_a_tool_file_is_what_payload_prints(tmp_path):
    path = tmp_path / "tool.json"
    values = inertia_at_origin(mass=2.0, com=np.zeros(3), inertia_at_com=np.eye(3)).tolist()
    path.write_text(json.dumps({"estimate": None, "link": "panda_joint7", "mass": 2.0, "values": values}))
    tool = load_tool(path)
    assert tool.link == "panda_joint7"
    assert tool.body.tolist() == values
    for text, message in (
        ("{", "not a readable tool"),
        ('{"schema": "tauhat/estimate"}', "an estimate, not a tool"),
        ('{"mass": 1.0}', "not a tool"),
        ('{"link": "a", "values": [1, 2]}', "not a tool"),
    ):
        path.write_text(text)
        with pytest.raises(SensingError, match=message):
            load_tool(path)


def test_an_estimate_makes_a_sensor_with_its_delay():
    robot = load_robot("two_link")
    q, tau = motion(robot, seconds=4.0, rate=250.0)
    log = Recording(t=np.arange(len(q)) / 250.0, q=q, tau=tau)
    estimate = identify(torque_model(robot, "inertia,viscous,coulomb"), [log], cutoff=20.0)
    sensor = force_sensor(estimate, rate=250.0)
    assert sensor.delay == estimate.processing.delay
    found = sensor.along(log)
    assert np.abs(found.tau[found.settled]).max() < 0.02 * np.abs(tau).max()


def test_files_have_the_columns_of_the_contract_and_several_logs_are_counted():
    found = SENSOR.along(recording())
    columns = sensed_columns([found])
    joints = range(1, 8)
    wrench = ["fx", "fy", "fz", "mx", "my", "mz"]
    assert list(columns) == [
        "t", *(f"tau_ext_{j}" for j in joints), *(f"tau_ext_std_{j}" for j in joints), *wrench,
        *(f"{name}_std" for name in wrench),
    ]  # fmt: skip
    both = sensed_columns([found, found])
    assert both["log"].tolist() == [0.0] * found.n_t + [1.0] * found.n_t
    assert both["fz"].size == 2 * found.n_t


def test_a_force_sensor_beside_it_is_compared_by_size_at_the_best_lag():
    rng = np.random.default_rng(3)
    force = np.cumsum(rng.normal(size=(4000, 3)), axis=0)
    force -= force.mean(axis=0)
    turned = force @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
    found = beside_sensor(np.roll(force, 12, axis=0)[100:], 1.3 * turned[100:], step=0.01)
    assert found.lag == pytest.approx(0.12)
    assert found.correlation == pytest.approx(1.0, abs=1e-6)
    assert found.scale == pytest.approx(1.3, rel=1e-6)
    assert beside_sensor(force, np.zeros_like(force), step=0.01) is None
    assert beside_sensor(force, np.full_like(force, np.nan), step=0.01) is None


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"rate": 0.0}, "rate of the samples"),
        ({"delay": 2.0}, "delay of a channel"),
        ({"wrench": WrenchSolver(robot=load_robot("ur5e"))}, "wrench is of another robot"),
    ],
)
def test_settings_that_mean_nothing_are_refused(changes, message):
    with pytest.raises(SensingError, match=message):
        replace(SENSOR, **changes)


def test_logs_of_another_robot_or_rate_are_refused():
    names = tuple(MODEL.robot.joint_names)
    with pytest.raises(SensingError, match="no torque in the log"):
        SENSOR.along(recording(None))
    with pytest.raises(SensingError, match="expected 7 joints"):
        SENSOR.along(recording(TAU[:, :6], q=Q[:, :6]))
    with pytest.raises(SensingError, match="the log is of another robot"):
        SENSOR.along(recording(joint_names=("other", *names[1:])))
    with pytest.raises(RecordingError, match="another order"):
        SENSOR.along(recording(joint_names=(*names[1:], names[0])))
    with pytest.raises(SensingError, match="samples of another rate"):
        SENSOR.along(recording(t=1.1 * T))
    assert SENSOR.along(recording(t=1.02 * T)).counts.restarts == 0
    with pytest.raises(SensingError, match="another robot"):
        SENSOR.advance(SENSOR.start(), Q[0, :5], TAU[0, :5])
    with pytest.raises(SensingError, match="no sample"):
        SENSOR.advance(SENSOR.start(), np.full(7, np.nan), TAU[0])


def test_a_mass_matrix_of_no_body_is_refused_by_the_observer_that_needs_one():
    wrong = replace(MODEL, inertia=-np.array(MODEL.inertia), rotor=np.full(7, 1e-3))
    sensor = ForceSensor(model=wrong, rate=RATE, observer=observer_named("disturbance"))
    with pytest.raises(SensingError, match="that of no body"):
        sensor.along(recording())
    with pytest.raises(SensingError, match="that of no body"):
        sensor.advance(sensor.start(), Q[0], TAU[0])


@pytest.mark.parametrize("rate", [13.0, 15.828348684464723])
def test_the_usual_cutoff_of_a_slow_sensor_is_one_that_its_filter_takes(rate):
    assert ForceSensor(model=frictionless(), rate=rate).cutoff == pytest.approx(0.45 * rate)
