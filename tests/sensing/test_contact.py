"""Contact: alarms as rare as stated, events where they are, the link that is touched, zeros, and each error once."""

from __future__ import annotations

import json
import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from sensed_arms import frictionless, motion

from tauhat.errors import ArrayError, SensingError, TauhatWarning
from tauhat.recordings import Recording
from tauhat.sensing.contact import ContactDetector, Contacts
from tauhat.sensing.contact_rules import ContactRules
from tauhat.sensing.contact_thresholds import ContactThresholds, load_contact_thresholds
from tauhat.sensing.payload_check import check_payload
from tauhat.sensing.sensed_log import SampleCounts, SensedLog
from tauhat.sensing.sensor import ForceSensor
from tauhat.sensing.threshold_learning import learn_contact_thresholds, thresholds_of
from tauhat.sensing.wrench import WrenchSolver
from tauhat.sensing.zero import NO_ZERO, AirPass, StandingZero, air_pass, zeroed

STEP, NAMES = 0.01, ("a", "b", "c")
SLOW = np.full(3, 0.02)
KEPT = np.exp(-20.0 * STEP)  # an observer's noise forgets at its gain
SIZES = np.array([2.0, 1.0, 0.5])


def noise(seconds: float, seed: int) -> np.ndarray:
    white = np.random.default_rng(seed).normal(size=(round(seconds / STEP) + 200, 3))
    return lfilter([np.sqrt(1.0 - KEPT**2)], [1.0, -KEPT], white, axis=0)[200:] * SIZES


def sensed(tau: np.ndarray, dq: np.ndarray | float = 0.5, std: float = 1.0) -> SensedLog:
    n_t = len(tau)
    speed = np.broadcast_to(np.asarray(dq, dtype=float), tau.shape).copy()
    wrench = np.zeros((n_t, 6))
    wrench[:, 0] = tau[:, 0] / 0.5
    return SensedLog(
        name="run", joint_names=NAMES, prismatic=(), frame="tool", axes="base", step=STEP, t=STEP * np.arange(n_t),
        rows=np.arange(n_t), q=np.cumsum(speed, axis=0) * STEP, dq=speed, tau=tau, tau_std=np.full_like(tau, std),
        raw=tau.copy(), wrench=wrench, wrench_std=np.ones((n_t, 6)), settled=np.ones(n_t, dtype=bool),
        counts=SampleCounts(taken=n_t), lag=np.zeros_like(tau), force_shared=np.zeros((n_t, 3)),
    )  # fmt: skip


def quietly(free: list[SensedLog], **settings: object) -> ContactThresholds:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)
        return thresholds_of(free, slow=SLOW, **settings)


def found_in(log: SensedLog, thresholds: ContactThresholds) -> Contacts:
    return ContactDetector(thresholds=thresholds, step=STEP).along(log)


MOVING = quietly([sensed(noise(120.0, 1))])
STANDING = quietly([sensed(noise(20.0, 100 + seed), 0.0) for seed in range(12)])


def test_false_alarms_come_no_oftener_than_stated_and_not_much_rarer():
    # 600 blocks to learn from, 30 alarms an hour allowed: 1/60 of the blocks, a third of that for the one condition.
    rate, seconds = 300.0, 1200.0
    alarms = []
    for seed in range(8):
        thresholds = thresholds_of([sensed(noise(seconds, 10 + seed))], slow=SLOW, rate=rate)
        assert thresholds.keeps_rate
        alarms.append(len(found_in(sensed(noise(seconds, 50 + seed)), thresholds).events))
    hours = 8 * seconds / 3600.0
    assert 0.1 * rate <= sum(alarms) / hours <= rate


def test_a_higher_rate_gives_lower_thresholds():
    log = sensed(noise(1200.0, 3))
    often, seldom = (thresholds_of([log], slow=SLOW, rate=rate) for rate in (600.0, 60.0))
    assert (often.limits < seldom.limits).all()


def test_too_little_free_motion_is_said_and_takes_the_margin_on_the_largest():
    log = sensed(noise(60.0, 4))
    with pytest.warns(TauhatWarning, match=r"60 s of free motion can promise 58 false alarms an hour, asked for: 1;"):
        short = thresholds_of([log], slow=SLOW)
    assert not short.keeps_rate
    # 30 blocks moving and none standing: one block in 31 may alarm, 1800 blocks an hour
    assert short.promised == pytest.approx(1800.0 / 31.0)
    assert found_in(log, short).excess.max() == pytest.approx(1.0 / 1.1)


def test_a_run_unlike_the_others_is_told():
    alike, other = sensed(noise(60.0, 5)), sensed(3.0 * noise(60.0, 6))
    with pytest.warns(TauhatWarning, match="x the residual of all others"):
        found = thresholds_of([alike, other], slow=SLOW, rate=1e3)
    assert found.spread > 2.0
    assert quietly([alike, sensed(noise(60.0, 7))]).spread < 1.5
    assert np.isnan(MOVING.spread)


def test_the_scale_follows_the_speed_of_the_joint_and_grows_beyond_what_was_seen():
    fast = np.where(np.arange(6000) % 2000 < 1000, 0.1, 0.8)[:, None] * np.ones(3)
    log = sensed(noise(60.0, 8) * np.where(fast > 0.2, 3.0, 1.0), fast)
    found = quietly([log])
    assert found.edges[1] == pytest.approx([0.24] * 3)
    assert found.limits[4] / found.limits[3] == pytest.approx([3.0] * 3, rel=0.15)
    excess = [found_in(sensed(np.full((200, 3), 5.0), speed), found) for speed in (0.8, 1.6)]
    assert excess[0].excess[-1] == pytest.approx(2.0 * excess[1].excess[-1])
    assert (excess[0].fast.any(), excess[1].fast[100:].all()) == (False, True)


def pushed(size: float, joints: tuple[int, ...], first: float, last: float, seed: int = 20) -> SensedLog:
    log = sensed(noise(20.0, seed))
    tau, t = log.tau.copy(), log.t
    tau[np.ix_((t >= first) & (t < last), joints)] += size * SIZES[list(joints)]
    wrench = log.wrench.copy()
    wrench[:, 0] = tau[:, 0] / 0.5
    return replace(log, tau=tau, wrench=wrench)


@pytest.mark.parametrize(("joints", "link"), [((0,), "a"), ((0, 1), "b"), ((0, 1, 2), "c"), ((0, 2), "c")])
def test_a_push_is_found_when_it_is_and_on_the_link_furthest_out_that_feels_it(joints, link):
    found = found_in(pushed(12.0, joints, 8.0, 9.5), MOVING)
    (event,) = found.events
    assert (event.start, event.end, event.link) == (pytest.approx(8.0), pytest.approx(9.49), link)
    assert event.peak == pytest.approx(12.0 * 2.0 / 0.5, rel=0.5)
    assert event.excess == pytest.approx(found.excess.max())
    assert not event.open
    assert not event.fast
    assert json.loads(json.dumps(event.to_dict()))["link"] == link


def test_a_contact_ends_below_the_release_not_below_the_threshold():
    level = MOVING.limits[4, 0]
    tau = np.zeros((1500, 3))
    tau[500:600, 0], tau[600:800, 0], tau[800:900, 0] = 1.1 * level, 0.8 * level, 1.1 * level
    held = found_in(sensed(tau), MOVING).events
    assert [(e.start, e.end) for e in held] == [(pytest.approx(5.0), pytest.approx(8.99))]
    at_once = replace(MOVING, rules=replace(MOVING.rules, release=1.0))
    assert len(found_in(sensed(tau), at_once).events) == 2


def test_a_contact_at_the_end_of_a_log_is_open():
    assert found_in(pushed(12.0, (0,), 18.0, 30.0), MOVING).events[-1].open


def test_steps_are_what_a_log_gives_and_leave_their_memory_alone():
    log = pushed(12.0, (0, 1), 2.0, 2.5)
    whole, detector = found_in(log, MOVING), ContactDetector(thresholds=MOVING, step=STEP)
    memory = detector.start()
    for k in range(300):
        before = memory.rows.copy(), memory.state.copy()
        after, sample = detector.advance(memory, log.tau[k], log.tau_std[k] ** 2, log.dq[k])
        assert all((old == new).all() for old, new in zip(before, memory, strict=True))
        assert (sample.contact, sample.excess) == (whole.touched[k], whole.excess[k])
        assert (sample.link is not None) == sample.contact
        memory = after
    assert sample.condition == "moving"


def test_no_sample_is_changed_by_those_after_it():
    log = pushed(12.0, (0,), 2.0, 2.5)
    names = ("t", "rows", "q", "dq", "tau", "tau_std", "raw", "wrench", "wrench_std", "settled")
    cut = replace(log, **{name: getattr(log, name)[:230].copy() for name in names})
    assert (found_in(cut, MOVING).excess == found_in(log, MOVING).excess[:230]).all()


def test_what_friction_holds_when_an_arm_comes_to_rest_is_zeroed_and_fades_on_the_way():
    offset = np.array([30.0, -12.0, 8.0])
    tau = noise(20.0, 30) + offset
    speed = np.where(np.arange(2000) < 1500, 0.0, 0.5)[:, None] * np.ones(3)
    pauses = [sensed(noise(20.0, 100 + seed), 0.0) for seed in range(12)]
    stays = quietly(pauses, rules=ContactRules(zero=StandingZero(follow=np.inf)))
    found = found_in(sensed(tau, speed), stays)
    assert found.zero[1400] == pytest.approx(offset, abs=2.0)
    assert found.resting[:1500].all()
    assert not found.touched[:1500].any()
    # 0.02 rad take a zero to 37 % of itself
    assert found.zero[1503] == pytest.approx(found.zero[1499] * np.exp(-4 * 0.5 * STEP / 0.02))
    assert np.abs(found.zero[1600]).max() < 1e-6
    unzeroed = quietly(pauses, rules=ContactRules(zero=NO_ZERO))
    assert found_in(sensed(tau, 0.0), unzeroed).touched[50:].all()


def test_the_zero_follows_a_drift_but_not_a_push():
    drift = np.minimum(STEP * np.arange(4000), 30.0)[:, None] / 10.0 * SIZES
    tau = noise(40.0, 31) + drift
    tau[3000:3300, 0] += 30.0
    found = found_in(sensed(tau, 0.0), STANDING)
    assert found.zero[2900] == pytest.approx(drift[2900], abs=1.5)
    assert found.zero[3299, 0] == pytest.approx(found.zero[3001, 0])
    assert [event.link for event in found.events] == ["a"]


def test_nothing_is_told_before_the_sensor_has_forgotten_its_start():
    log = pushed(40.0, (0,), 0.0, 1.0)
    late = replace(log, settled=log.t >= 0.8)
    assert found_in(log, MOVING).events[0].start == pytest.approx(0.5, abs=0.011)
    assert found_in(late, MOVING).events[0].start == pytest.approx(0.8)


def test_thresholds_come_back_from_their_file(tmp_path):
    thresholds = replace(MOVING, rules=ContactRules(zero=StandingZero(follow=np.inf)))
    thresholds.save(tmp_path / "limits.json")
    again = load_contact_thresholds(tmp_path / "limits.json")
    assert again.to_dict() == thresholds.to_dict()
    assert again.rules == thresholds.rules
    assert (again.limits == thresholds.limits).all()


def test_the_sensor_learns_on_recordings_and_finds_a_push_at_the_wrist():
    model = frictionless()
    q, tau = motion(model.robot, seconds=6.0, rate=250.0)
    rng = np.random.default_rng(5)
    t, noisy = np.arange(len(q)) / 250.0, tau + rng.normal(scale=0.3, size=tau.shape)
    sensor = ForceSensor(model=model, rate=250.0)
    free = Recording(t=t, q=q, tau=noisy, joint_names=model.robot.joint_names)
    with pytest.warns(TauhatWarning, match="free motion can promise"):
        thresholds = learn_contact_thresholds(sensor, [free])
    solver = WrenchSolver(robot=model.robot)
    force = np.array([0.0, 40.0, 0.0])
    felt = np.array([solver.jacobian(place)[0][:3].T @ force for place in q]) * ((t > 3.0) & (t < 4.0))[:, None]
    log = sensor.along(replace(free, tau=noisy - felt))
    (event,) = ContactDetector(thresholds=thresholds, step=sensor.step).along(log).events
    assert event.start == pytest.approx(3.0, abs=0.15)
    assert event.end == pytest.approx(4.0, abs=0.35)
    assert event.link in model.robot.joint_names[4:]


def test_a_pass_in_air_takes_off_what_belongs_to_the_motion():
    place = np.sin(STEP * np.arange(2000))[:, None] * SIZES * 10.0
    air, touched = sensed(place + noise(20.0, 40) * 0.1), sensed(place[::-1].copy()[::-1] + noise(20.0, 41) * 0.1)
    known = air_pass(air)
    left = touched.tau - known.torque_at(touched.t - touched.t[0])
    assert np.sqrt(np.mean(left**2)) < 0.05 * np.sqrt(np.mean(touched.tau**2))
    assert known.wrench_at(np.array([5.0]))[0, 0] == pytest.approx(air.wrench[500, 0])
    assert known.torque_at(np.array([1e3]))[0] == pytest.approx(air.tau[-1])


def test_a_pass_in_air_knows_only_what_was_settled_and_may_go_by_the_path():
    air, way = sensed(noise(5.0, 42)), np.linspace(0.0, 2.0, 500)
    known = air_pass(replace(air, settled=air.t >= 1.0), progress=way)
    assert known.progress.tolist() == way[100:].tolist()
    assert known.torque_at(way[[0, 300]]) == pytest.approx(air.tau[[100, 300]])
    with pytest.raises(SensingError, match="progress of a pass"):
        air_pass(air, progress=way[::-1])


def with_robot(q: np.ndarray, tau: np.ndarray) -> SensedLog:
    n_t, n_v = q.shape
    return SensedLog(
        name="arm", joint_names=tuple(f"j{k}" for k in range(n_v)), prismatic=(), frame="", axes="base", step=STEP,
        t=STEP * np.arange(n_t), rows=np.arange(n_t), q=q, dq=np.gradient(q, STEP, axis=0), tau=tau,
        tau_std=np.ones_like(tau), raw=tau, wrench=np.zeros((n_t, 6)), wrench_std=np.ones((n_t, 6)),
        settled=np.ones(n_t, dtype=bool), counts=SampleCounts(taken=n_t), lag=np.zeros_like(tau),
        force_shared=np.zeros((n_t, 3)),
    )  # fmt: skip


ROBOT = frictionless().robot
SOLVER = WrenchSolver(robot=ROBOT)
Q, _ = motion(ROBOT, seconds=12.0, rate=1.0 / STEP)


def weight(q: np.ndarray, mass: float, centre: tuple[float, float, float]) -> np.ndarray:
    def at(place: np.ndarray) -> np.ndarray:
        jacobian, rotation = SOLVER.jacobian(place)
        force = mass * np.array([0.0, 0.0, -9.81])
        return jacobian.T @ np.concatenate([force, np.cross(rotation @ np.array(centre), force)])

    return np.array([at(place) for place in q])


def test_a_payload_is_told_with_its_mass_and_centre():
    rng = np.random.default_rng(6)
    log = with_robot(Q, weight(Q, 1.5, (0.02, -0.05, 0.1)) + rng.normal(scale=0.2, size=Q.shape))
    found = check_payload(log, SOLVER)
    assert found.verdict == "payload"
    assert found.mass == pytest.approx(1.5, abs=4.0 * found.mass_std)
    assert found.mass_std < 0.05
    assert found.centre == pytest.approx([0.02, -0.05, 0.1], abs=0.05)
    assert found.unexplained < 0.05


def test_a_push_and_nothing_at_all_are_no_payload():
    rng = np.random.default_rng(7)
    nothing = rng.normal(scale=0.2, size=Q.shape)
    push = nothing.copy()
    push[400:600] += np.array([SOLVER.jacobian(place)[0][:3].T @ [20.0, 15.0, 0.0] for place in Q[400:600]])
    found = check_payload(with_robot(Q, nothing), SOLVER)
    assert found.verdict == "no payload"
    assert found.mass < 3.0 * found.mass_std
    assert np.isnan(found.centre).all(), "no mass has no centre"
    assert check_payload(with_robot(Q, push), SOLVER).verdict == "no payload"
    held = np.repeat(Q[:1], 600, axis=0)
    assert check_payload(with_robot(held, weight(held, 1.5, (0.0, 0.0, 0.1))), SOLVER).verdict == "undecided"


def test_a_zero_is_taken_off_torque_and_wrench():
    log = with_robot(Q[:50], weight(Q[:50], 2.0, (0.0, 0.0, 0.0)))
    again = zeroed(log, log.tau, solver=SOLVER)
    assert np.abs(again.tau).max() == 0.0
    assert np.abs(again.wrench).max() == 0.0
    late = replace(log, lag=np.ones_like(log.tau))  # what changed within the lag stays in doubt
    doubled = SOLVER.along(log.q, log.tau, np.full_like(log.tau, 2.0)).standard_errors
    assert zeroed(late, log.tau, solver=SOLVER).wrench_std == pytest.approx(doubled, rel=1e-12)
    wide = WrenchSolver(robot=ROBOT, largest=(1e4, 1e3))
    assert zeroed(log, np.zeros_like(log.tau), solver=wide).wrench[:, 2] == pytest.approx(-2.0 * 9.81, rel=0.02)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: StandingZero(fade=0.0), "zero of a standing arm"),
        (lambda: ContactRules(release=0.0), "release of a contact"),
        (lambda: ContactRules(margin=0.5), "rules of contact"),
        (lambda: thresholds_of([], slow=SLOW), "no free motion"),
        (lambda: thresholds_of([sensed(noise(1.0, 1))], slow=SLOW, rate=0.0), "rate of false alarms"),
        (lambda: thresholds_of([sensed(noise(0.8, 1))], slow=SLOW), "too short for any threshold"),
        (lambda: replace(MOVING, limits=-MOVING.limits), "thresholds of contact"),
        (lambda: ContactDetector(thresholds=MOVING, step=0.0), "time between samples"),
        (lambda: found_in(replace(sensed(noise(1.0, 1)), joint_names=("x", "y", "z")), MOVING), "another robot"),
        (lambda: found_in(replace(sensed(noise(1.0, 1)), step=0.02), MOVING), "another rate"),
        (
            lambda: ContactDetector(thresholds=MOVING, step=STEP).advance(
                ContactDetector(thresholds=MOVING, step=STEP).start(), np.zeros(2), np.ones(2), np.zeros(2)
            ),
            "a sample of another robot",
        ),
        (lambda: AirPass(progress=[0.0, 0.0], torque=np.zeros((2, 3)), wrench=np.zeros((2, 6))), "progress of a pass"),
        (lambda: check_payload(with_robot(Q[:100], Q[:100]), SOLVER), "too short to tell"),
    ],
)  # fmt: skip
def test_what_means_nothing_is_refused(make, message):
    with pytest.raises(SensingError, match=message):
        make()


def test_a_zero_of_another_shape_is_refused():
    with pytest.raises(ArrayError, match="zero has the wrong shape"):
        zeroed(with_robot(Q[:50], Q[:50]), np.zeros((49, 7)), solver=SOLVER)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda data: json.dumps(data)[:-9], "damaged"),
        (lambda data: json.dumps(data | {"schema": "other"}), "not contact thresholds"),
        (lambda data: json.dumps(data | {"schema_version": 99}), "of this version"),
        (lambda data: json.dumps({key: data[key] for key in data if key != "limits"}), "damaged"),
        (lambda data: json.dumps(data | {"limits": [[1.0]]}), "cannot be used"),
    ],
)  # fmt: skip
def test_files_that_are_no_thresholds_are_refused(tmp_path, change, message):
    (tmp_path / "limits.json").write_text(change(MOVING.to_dict()), encoding="utf-8")
    with pytest.raises(SensingError, match=message):
        load_contact_thresholds(tmp_path / "limits.json")
