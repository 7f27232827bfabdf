"""Error bars that free motion teaches: they hold logs nobody has seen, and what errors of joints have in common."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sensed_arms import frictionless, motion

from tauhat.dynamics.passive_kernel import DAHL, joint_elements
from tauhat.dynamics.rigid_body import gravity_torque
from tauhat.errors import SensingError
from tauhat.recordings import Recording
from tauhat.sensing import ForceSensor, WrenchSolver, directions_named
from tauhat.sensing.assumed_thresholds import assumed_contact_thresholds
from tauhat.sensing.contact_rules import ContactRules
from tauhat.sensing.free_motion import learnt_from_free_motion, shrunk_correlation
from tauhat.sensing.judged_log import judged_log
from tauhat.sensing.zero import NO_ZERO, zeroed

RATE, SECONDS = 100.0, 2.2
MODEL = frictionless()
Q, TAU = motion(MODEL.robot, SECONDS, RATE)
T = np.arange(len(Q)) / RATE
SIZES = np.array([2.0, 1.0, 3.0, 0.5, 0.8, 0.4, 0.2])
SENSOR = ForceSensor(
    model=MODEL, rate=RATE, wrench=WrenchSolver(robot=MODEL.robot, directions=directions_named("force"))
)
ALIKE = 0.7 * np.ones((7, 7)) + 0.3 * np.eye(7)
SIGNS = np.diag([1.0, -1.0, 1.0, 1.0, -1.0, 1.0, 1.0])
TRUTH = SIGNS @ ALIKE @ SIGNS


def logs(n: int, seed: int) -> list[Recording]:
    """Return logs in air whose torque is off by a value of their own, joints together."""
    offsets = np.random.default_rng(seed).multivariate_normal(np.zeros(7), np.outer(SIZES, SIZES) * TRUTH, n)
    return [Recording(t=T, q=Q, tau=TAU + offset) for offset in offsets]


def inside(sensor: ForceSensor, unseen: list[Recording]) -> tuple[float, float]:
    """Return which part of the 95 % intervals of joint torque and force holds the truth, nothing."""
    joints, forces = [], []
    for log in unseen:
        found = sensor.along(log)
        last = found.settled
        joints.append(np.abs(found.tau[last]) < 1.96 * found.tau_std[last])
        forces.append(np.abs(found.wrench[last, :3]) < 1.96 * found.wrench_std[last, :3])
    return float(np.mean(joints)), float(np.mean(np.concatenate(forces)))


def test_bars_of_unseen_logs_hold_the_truth_as_often_as_they_say():
    learnt = learnt_from_free_motion(SENSOR, logs(150, 1))
    unseen = logs(300, 2)
    torque, force = inside(learnt, unseen)
    assert torque == pytest.approx(0.95, abs=0.02)
    assert force == pytest.approx(0.95, abs=0.02)
    apart = replace(learnt, wrench=replace(learnt.solver, correlation=np.eye(7)))
    assert abs(inside(apart, unseen)[1] - 0.95) > 0.03  # the same joints, each for itself, say something else
    error, without = (
        np.concatenate([sensor.along(log).wrench[-1, :3] for log in unseen]) for sensor in (learnt, apart)
    )
    assert np.sqrt(np.mean(error**2)) < 0.8 * np.sqrt(np.mean(without**2))


def test_few_logs_make_wider_bars_that_still_hold():
    shares = [inside(learnt_from_free_motion(SENSOR, logs(6, seed)), logs(20, 50 + seed))[0] for seed in range(10)]
    assert 0.92 < np.mean(shares) < 0.985
    wide = [learnt_from_free_motion(SENSOR, logs(6, seed)).model.stretch.mean() for seed in range(10)]
    assert np.mean(wide) > 1.1 * learnt_from_free_motion(SENSOR, logs(150, 1)).model.stretch.mean()


def test_a_doubt_that_the_error_already_holds_is_not_counted_twice():
    bristles = joint_elements((DAHL, joint, 1e-3, 5.0) for joint in range(7))
    stiff = replace(MODEL, bristles=bristles)
    logs_of_it = [replace(log, tau=log.tau + friction()) for log in logs(150, 1)]
    sensor = replace(SENSOR, model=stiff)
    learnt = learnt_from_free_motion(sensor, logs_of_it)
    plain = replace(learnt, model=replace(learnt.model, stretch=np.ones(7)))
    assert (learnt.model.stretch < 1.1).all()
    assert (learnt.along(logs_of_it[0]).tau == plain.along(logs_of_it[0]).tau).all()
    unseen = [replace(log, tau=log.tau + friction()) for log in logs(100, 3)]
    assert inside(learnt, unseen)[0] == pytest.approx(0.95, abs=0.02)


def friction() -> np.ndarray:
    """Return the torque of the bristles along the motion, by their law written here again."""
    bent, out = np.zeros(7), np.zeros_like(Q)
    for k in range(1, len(Q)):
        moved = Q[k] - Q[k - 1]
        bent = np.sign(moved) + (bent - np.sign(moved)) * np.exp(-np.abs(moved) / 1e-3)
        out[k] = 5.0 * bent
    return out


def test_correlations_have_the_size_and_sign_of_the_truth():
    found = learnt_from_free_motion(SENSOR, logs(400, 4)).solver.correlation
    assert found == pytest.approx(TRUTH, abs=0.1)


def test_a_correlation_is_believed_as_far_as_logs_agree_on_it():
    rng = np.random.default_rng(5)
    values = rng.multivariate_normal(np.zeros(3), [[1.0, 0.9, 0.0], [0.9, 1.0, 0.0], [0.0, 0.0, 1.0]], 2000)
    many = shrunk_correlation([values[k : k + 1] for k in range(2000)])
    assert many == pytest.approx(np.corrcoef(values.T), abs=0.05)
    repeated = [np.repeat(values[k : k + 1], 500, axis=0) for k in range(4)]  # 2000 samples that are four values
    few = shrunk_correlation(repeated)
    assert abs(few[0, 1]) < abs(shrunk_correlation([values[:1000], values[1000:]])[0, 1])
    noise = shrunk_correlation([rng.normal(size=(1, 5)) for _ in range(6)])
    assert np.abs(noise - np.eye(5)).max() < 0.5
    for found in (many, few, noise):
        assert (found.diagonal() == 1.0).all()
        assert np.linalg.eigvalsh(found)[0] > 0.0


def test_one_log_is_cut_into_parts_and_a_joint_without_error_is_taken_too():
    quiet = SIZES * np.array([1.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    t = np.arange(1500) / RATE
    q, tau = motion(MODEL.robot, 15.0, RATE)
    slow = np.sin(0.7 * t[:, None] + np.arange(7)) * quiet
    learnt = learnt_from_free_motion(SENSOR, [Recording(t=t, q=q, tau=tau + slow)])
    wrong = quiet > 0.0
    assert ((learnt.model.stretch[wrong] > 0.5) & (learnt.model.stretch[wrong] < 3.0)).all()
    assert learnt.model.stretch[1] > 0.0
    assert learnt.model.rms[1] < 1e-2 * learnt.model.rms[0]
    assert (np.abs(learnt.solver.correlation[1]) <= 1.0).all()


def test_logs_that_end_before_their_start_is_forgotten_teach_nothing():
    q, tau = motion(MODEL.robot, 15.0, RATE)
    slow = np.sin(0.7 * np.arange(1500)[:, None] / RATE + np.arange(7)) * SIZES
    long = Recording(t=np.arange(1500) / RATE, q=q, tau=tau + slow)
    short = Recording(t=T[:20], q=Q[:20], tau=TAU[:20])
    alone, beside = (learnt_from_free_motion(SENSOR, given) for given in ([long], [long, short, short, short]))
    assert (beside.model.stretch == alone.model.stretch).all()
    assert (beside.solver.correlation == alone.solver.correlation).all()


def test_logs_count_by_their_time_and_not_by_their_samples():
    offsets = np.random.default_rng(7).normal(size=(12, 7)) * SIZES * np.repeat([3.0, 1.0], 6)[:, None]
    q, tau = motion(MODEL.robot, SECONDS, 1.9 * RATE)
    fine = np.arange(len(q)) / (1.9 * RATE)
    coarse = [Recording(t=T, q=Q, tau=TAU + offset) for offset in offsets]
    finer = [Recording(t=fine, q=q, tau=tau + offset) for offset in offsets[:6]]
    expected, found = (learnt_from_free_motion(SENSOR, given) for given in (coarse, [*finer, *coarse[6:]]))
    assert found.model.stretch == pytest.approx(expected.model.stretch, rel=0.01)
    assert found.solver.correlation == pytest.approx(expected.solver.correlation, abs=0.01)
    some = np.random.default_rng(8).normal(size=(5, 40, 3))
    twice = [np.repeat(some[0], 2, axis=0), *some[1:]]
    assert shrunk_correlation(twice, seconds=np.ones(5)) == pytest.approx(shrunk_correlation(list(some)), abs=1e-12)


def standing(n: int, seed: int) -> list[Recording]:
    """Return logs of an arm that stands for five seconds, held by a friction of its own."""
    rng = np.random.default_rng(seed)
    t = np.arange(500) / RATE
    held = np.tile(Q[0], (500, 1)), np.tile(rnea_at_rest(), (500, 1))
    return [
        Recording(t=t, q=held[0], tau=held[1] + rng.normal(size=7) * SIZES + 0.05 * rng.normal(size=(500, 7)))
        for _ in range(n)
    ]


def rnea_at_rest() -> np.ndarray:
    return gravity_torque(MODEL.robot, Q[:1])[0]


def test_an_error_is_that_of_what_is_told_less_the_zero_of_standing():
    sensor = replace(SENSOR, model=replace(MODEL, rms=np.full(7, 0.01)))
    plain = learnt_from_free_motion(sensor, standing(8, 1))
    less = learnt_from_free_motion(sensor, standing(8, 1), standing=ContactRules())
    assert (less.model.rms < 0.2 * plain.model.rms).all()
    limits = assumed_contact_thresholds(less)
    held = []
    for log in standing(20, 2):
        found = judged_log(less, log, limits, zero="standing").sensed
        held.append(np.abs(found.tau[found.settled]) < 1.96 * found.tau_std[found.settled])
    assert np.mean(held) == pytest.approx(0.95, abs=0.04)
    none = learnt_from_free_motion(sensor, standing(8, 1), standing=ContactRules(zero=NO_ZERO))
    assert (none.model.rms == plain.model.rms).all()


def test_what_was_learnt_before_does_not_change_what_is_learnt():
    once = learnt_from_free_motion(SENSOR, logs(30, 6))
    twice = learnt_from_free_motion(once, logs(30, 6))
    assert (once.model.rms == twice.model.rms).all()
    assert (once.model.stretch == twice.model.stretch).all()
    assert (once.solver.correlation == twice.solver.correlation).all()


def test_a_wrench_solved_again_is_that_of_the_sensor():
    learnt = learnt_from_free_motion(SENSOR, logs(30, 6))
    pushed = Recording(t=T, q=Q, tau=TAU - 20.0 * np.sin(3.0 * T)[:, None] * SIZES)
    found = learnt.along(pushed)
    again = zeroed(found, np.zeros_like(found.tau), solver=learnt.solver)
    assert again.wrench == pytest.approx(found.wrench, rel=1e-9, abs=1e-9)
    assert again.wrench_std == pytest.approx(found.wrench_std, rel=1e-9)


def test_too_little_free_motion_is_refused():
    with pytest.raises(SensingError, match="too little free motion"):
        learnt_from_free_motion(SENSOR, logs(3, 1))


def test_a_stretch_that_is_none_is_refused():
    with pytest.raises(SensingError, match="above zero"):
        replace(MODEL, stretch=np.zeros(7))
