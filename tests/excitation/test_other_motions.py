"""Motions of other kinds: inside their limits, derivatives that belong together, at rest at both ends."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tauhat.errors import ExcitationError
from tauhat.excitation import (
    PointToPoint,
    Quintic,
    TaskPath,
    Trajectory,
    Trapezoidal,
    motion_limits,
    point_to_point,
    static_motion,
    sweep,
    task_path,
)
from tauhat.robots import load_robot

ROBOT = load_robot("ur5e")
LIMITS = motion_limits(ROBOT, margin=0.1)
POSES = LIMITS.lower + (LIMITS.upper - LIMITS.lower) * np.random.default_rng(0).uniform(0.3, 0.7, (5, 6))
MOTIONS: dict[str, Callable[[], Trajectory]] = {
    "quintic": lambda: point_to_point(POSES, LIMITS, wait=0.5),
    "trapezoidal": lambda: point_to_point(POSES, LIMITS, wait=0.5, profile=Trapezoidal()),
    "sweep": lambda: sweep(LIMITS, duration=20.0),
    "task path": lambda: task_path(POSES, LIMITS),
    "task path of short ways": lambda: task_path(POSES[0] + np.outer([0, 0.02, 0.3, 0.31, 0.0], np.ones(6)), LIMITS),
    "static": lambda: static_motion(ROBOT, POSES[:2]),
}  # fmt: skip


@pytest.fixture(params=list(MOTIONS))
def motion(request: pytest.FixtureRequest) -> Trajectory:
    return MOTIONS[request.param]()


def test_no_limit_is_left_at_any_time(motion):
    seen = motion.sample(np.arange(0.0, motion.duration, 1e-3))
    room = motion_limits(ROBOT) if motion.duration > 30 else LIMITS
    assert (seen.q >= room.lower - 1e-12).all()
    assert (seen.q <= room.upper + 1e-12).all()
    assert (np.abs(seen.dq) / room.velocity).max() <= 1 + 1e-9
    assert (np.abs(seen.ddq) / room.acceleration).max() <= 1 + 1e-9


def test_positions_are_the_integral_of_velocities_and_these_of_accelerations(motion):
    t = np.linspace(0.0, motion.duration, 40_001)
    seen = motion.sample(t)
    step = t[1] - t[0]
    for rate, value in ((seen.dq, seen.q), (seen.ddq, seen.dq)):
        summed = np.cumsum(0.5 * (rate[1:] + rate[:-1]) * step, axis=0)
        assert np.abs(value[1:] - value[0] - summed).max() < 5e-3


def test_it_starts_and_ends_at_rest(motion):
    ends = motion.sample(np.array([0.0, motion.duration]))
    assert ends.dq == pytest.approx(0.0, abs=1e-9)


def test_point_to_point_waits_at_every_pose():
    motion = MOTIONS["quintic"]()
    assert isinstance(motion, PointToPoint)
    waits = motion.sample(motion.departures - 0.25)
    assert waits.q == pytest.approx(POSES[:-1])
    assert waits.dq == pytest.approx(0.0)


def test_the_slowest_joint_of_a_way_uses_its_whole_limit():
    motion = MOTIONS["quintic"]()
    seen = motion.sample(np.arange(0.0, motion.duration, 1e-3))
    used = np.maximum(np.abs(seen.dq) / LIMITS.velocity, np.abs(seen.ddq) / LIMITS.acceleration)
    assert used.max() == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("profile", [Quintic(), Trapezoidal(), Trapezoidal(ramp=0.5)])
def test_a_profile_peaks_where_it_says_and_covers_the_whole_way(profile):
    course = profile.course(np.linspace(0.0, 1.0, 10_001))
    assert (course.s[0], course.s[-1]) == (pytest.approx(0.0), pytest.approx(1.0))
    assert course.ds.max() == pytest.approx(profile.peak_speed, rel=1e-6)
    assert np.abs(course.dds).max() == pytest.approx(profile.peak_acceleration, rel=1e-6)


def test_a_sweep_becomes_faster():
    motion = sweep(LIMITS, duration=20.0, start=0.1, end=2.0)
    first = motion.sample(np.arange(0.0, motion.duration, 1e-3)).q[:, 0] - motion.centre[0]
    crossings = np.flatnonzero(np.diff(np.sign(first)) != 0) * 1e-3
    halves = np.diff(crossings[crossings > 1.0])
    assert halves[-3] < 0.2 * halves[0]


def test_a_task_path_stays_inside_the_hull_of_its_poses_and_passes_their_middle():
    motion = TaskPath(poses=np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]), times=np.array([2.0, 2.0]), blend=0.5)
    seen = motion.sample(np.array([0.0, 1.5, 3.5, motion.duration]))  # half a way is passed a blend later
    assert seen.q == pytest.approx(np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.5], [1.0, 1.0]]))


def test_a_static_motion_reaches_each_pose_from_both_sides():
    motion = static_motion(ROBOT, POSES[:1], away=0.1)
    before = np.sign(motion.poses[[1, 3]] - motion.poses[[0, 2]])
    assert motion.poses[[1, 3]] == pytest.approx(np.tile(POSES[0], (2, 1)))
    assert before == pytest.approx(np.outer([1.0, -1.0], np.ones(6)))


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (lambda: point_to_point(POSES + 9.0, LIMITS), "outside the limits"),
        (lambda: point_to_point(POSES, LIMITS, speed=2.0), "speed of a motion"),
        (lambda: point_to_point(POSES[:1], LIMITS), "point to point"),
        (lambda: Trapezoidal(ramp=0.7), "ramp"),
        (lambda: sweep(LIMITS, duration=20.0, start=2.0, end=1.0), "sweep"),
        (lambda: task_path(POSES[[0, 0]], LIMITS), "task path"),
        (lambda: TaskPath(poses=POSES, times=np.ones(4), blend=2.0), "task path"),
        (lambda: static_motion(ROBOT, POSES[:1], hold=0.0), "static motion"),
        (lambda: static_motion(ROBOT, POSES[:1], away=9.0), "outside the limits"),
    ],
)
def test_what_cannot_be_is_refused(made, message):
    with pytest.raises(ExcitationError, match=message):
        made()
