"""Held poses: gravity is half the sum from both sides, friction half the difference, both against the model's."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from sample_arms import PLANAR, WIDTHS, Truth, planar_truth
from tauhat.dynamics import torque_model
from tauhat.dynamics.terms import Asymmetric
from tauhat.errors import ModelError, RecordingError
from tauhat.estimation import Estimate, identify
from tauhat.excitation import static_motion
from tauhat.recordings import Processing, Recording
from tauhat.verification import StaticCheck, static_check
from tauhat.verification.stands import _mean_error

SETTINGS = Processing(cutoff=10.0, motion_cutoff=30.0)
TRUTH = planar_truth()
ROBOT = TRUTH.model.robot
POSES = np.array([[0.4, -0.8], [1.1, 0.5], [-0.7, 0.3]])
COULOMB = np.array([1.4, 0.7])  # of the planar truth
OFFSET = np.array([0.3, -0.2])
NOISE = 0.1  # [Nm]


@lru_cache
def estimate() -> Estimate:
    return identify(TRUTH.model, [TRUTH.recording(seed=1, noise=noise(1, 4000))], processing=SETTINGS)


def noise(seed: int, count: int) -> np.ndarray:
    return NOISE * np.random.default_rng(seed).standard_normal((count, 2))


@lru_cache
def held() -> Recording:
    """Return a static motion whose friction keeps its last direction at rest, as dry friction does."""
    motion = static_motion(ROBOT, POSES, hold=1.5, speed=0.6)
    sample = motion.sample(np.arange(0.0, motion.duration, 0.005))
    rigid = TRUTH.torque(sample.q, 0.0 * sample.q, sample.ddq)
    way = np.sign(np.where(np.abs(sample.dq) > 1e-9, sample.dq, 0.0))
    for row in range(1, len(way)):
        way[row] = np.where(way[row] == 0.0, way[row - 1], way[row])
    return Recording(t=sample.t, q=sample.q, tau=rigid + COULOMB * way + noise(5, len(way)), name="held")


@lru_cache
def check() -> StaticCheck:
    return static_check(estimate(), [held()])


def gravity(pose: np.ndarray) -> np.ndarray:
    """Return the textbook's gravity torque of the two-link arm, with the offsets."""
    (m1, l1, c1, _), (m2, _, c2, _) = PLANAR
    beyond = 9.81 * m2 * c2 * np.cos(pose.sum())
    return np.array([9.81 * (m1 * c1 + m2 * l1) * np.cos(pose[0]) + beyond, beyond]) + OFFSET


def test_half_the_sum_is_the_textbooks_gravity():
    for joint in range(2):
        pairs = sorted((pair for pair in check().pairs if pair.joint == joint), key=lambda pair: pair.position)
        poses = sorted(POSES, key=lambda pose: pose[joint])
        assert len(pairs) == len(POSES)
        for pair, pose in zip(pairs, poses, strict=True):
            assert pair.gravity == pytest.approx(gravity(pose)[joint], abs=5 * NOISE / np.sqrt(160))
            assert abs(pair.gravity - pair.model_gravity) < 4 * np.hypot(pair.gravity_error, pair.model_gravity_error)


def test_half_the_difference_is_the_dry_friction():
    for pair in check().pairs:
        assert pair.held
        assert pair.friction == pytest.approx(COULOMB[pair.joint], abs=0.05)
        assert pair.model_friction == pytest.approx(COULOMB[pair.joint], abs=0.2)


def test_a_right_model_is_not_accused():
    assert check().findings == ()


def test_a_load_that_the_model_has_not_is_found_on_the_joints_that_carry_it():
    heavy = replace(held(), tau=held().tau + np.array([1.5, 0.0]))
    (finding,) = static_check(estimate(), [heavy]).findings
    assert (finding.code, finding.joint) == ("static_gravity", "j1")
    assert finding.number == pytest.approx(1.5, abs=0.3)


def test_friction_beyond_the_models_is_found():
    recording = held()
    way = np.sign(recording.tau - np.array([gravity(pose) for pose in recording.q]))
    stiff = replace(recording, tau=recording.tau + np.array([0.0, 1.0]) * way)
    findings = static_check(estimate(), [stiff]).findings
    assert [(finding.code, finding.joint) for finding in findings] == [("static_friction", "j2")]


@pytest.mark.parametrize("left", [0.0, 0.5, 1.0])
def test_a_right_model_of_friction_that_differs_by_direction_is_not_accused_however_much_of_it_is_left(left):
    estimate, truth = differing()
    way = np.sign(held().tau - np.array([gravity(pose) for pose in held().q]))
    rigid = truth.torque(held().q, 0.0 * held().q, 0.0 * held().q)
    log = replace(held(), tau=rigid + left * np.where(way > 0.0, 1.6, -0.8) + noise(9, len(way)))
    assert static_check(estimate, [log]).findings == ()
    for sign in (1.0, -1.0):
        found = static_check(estimate, [replace(log, tau=log.tau + sign * np.array([1.5, 0.0]))]).findings
        assert ("static_gravity", "j1") in {(finding.code, finding.joint) for finding in found}


def test_a_passed_pose_has_all_of_the_friction_that_differs_by_direction():
    estimate, truth = differing()
    t = np.arange(0.0, 60.0, 0.005)
    q = np.column_stack([0.5 + np.abs((t / 15.0) % 2.0 - 1.0), np.full_like(t, -0.4)])
    q[t > 58.0, 0] += 0.4 * (1.0 - np.cos(2 * np.pi * (t[t > 58.0] - 58.0)))
    tau = truth.torque(q, np.gradient(q, t, axis=0), 0.0 * q) + noise(7, len(t))
    joint = static_check(estimate, [Recording(t=t, q=q, tau=tau)]).joints[0]
    assert joint.poses > 20
    assert not joint.held
    assert abs(joint.gravity_difference) < 2 * joint.gravity_half < 0.2


@lru_cache
def differing() -> tuple[Estimate, Truth]:
    """Return an arm whose friction differs by 0.8 Nm between the directions, and a right model of it."""
    value = {"Ia": 0.05, "Fv+": 0.3, "Fv-": 0.2, "Fc+": 1.6, "Fc-": 0.8}
    model = torque_model(ROBOT, "inertia,rotor,asymmetric").with_term(Asymmetric(widths=WIDTHS))
    values = [value[parameter.symbol] for parameter in model.parameters[20:]]
    truth = Truth(model=model, standard=np.concatenate([ROBOT.inertia.ravel(), values]))
    return identify(model, [truth.recording(seed=1, noise=noise(1, 4000))], processing=SETTINGS), truth


def test_a_motion_that_never_holds_says_so():
    (finding,) = static_check(estimate(), [TRUTH.recording(seed=2)]).findings
    assert (finding.code, finding.severity) == ("static_none", "note")
    assert "from both sides" in finding.message


def test_a_pose_reached_from_one_side_alone_is_no_pair():
    first = held().rows(0, 800)  # the approach from below and a part of the way beyond
    assert static_check(estimate(), [first]).pairs == ()


def test_slow_passes_of_a_single_joint_count_where_nothing_is_held():
    t = np.arange(0.0, 60.0, 0.005)
    turn = np.abs((t / 15.0) % 2.0 - 1.0)  # up and down, twice, at a fifteenth rad/s
    q = np.column_stack([0.5 + turn, np.full_like(t, -0.4)])
    dash = t > 58.0  # a fast end, by which the rest is slow
    q[dash, 0] += 0.8 * (1.0 - np.cos(2 * np.pi * (t[dash] - 58.0))) / 2.0
    dq = np.gradient(q, t, axis=0)
    tau = TRUTH.torque(q, dq, 0.0 * q) + noise(7, len(t))
    checked = static_check(estimate(), [Recording(t=t, q=q, tau=tau)])
    assert {pair.joint for pair in checked.pairs} == {0}
    assert not any(pair.held for pair in checked.pairs)
    joint = checked.joints[0]
    assert joint.poses > 20
    assert abs(joint.gravity_difference) < 2 * joint.gravity_half
    assert joint.friction == pytest.approx(joint.model_friction, abs=0.25)


def test_error_bars_of_short_cells_are_as_wide_as_their_means_scatter():
    rng = np.random.default_rng(3)
    for count in (3, 4, 6):
        squares = [_mean_error(rng.standard_normal((count, 2))) ** 2 for _ in range(2000)]
        assert np.mean(squares) * count == pytest.approx(1.1, abs=0.15)


def test_results_are_plain_data():
    document = check().to_dict()
    assert document["joints"][0]["poses"] == 3
    assert set(document["pairs"][0]) >= {"gravity", "model_gravity", "friction", "model_friction"}


def test_a_recording_without_torque_is_refused():
    with pytest.raises(RecordingError, match="no torque"):
        static_check(estimate(), [replace(held(), tau=None)])


def test_no_recording_is_refused():
    with pytest.raises(ModelError, match="no recording"):
        static_check(estimate(), [])
