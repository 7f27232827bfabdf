"""Courses of speed: trapezoids in closed form, bounded jerk against Ruckig's own samples, and the shapes of corners."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tauhat.arrays import FloatArray
from tauhat.errors import ExcitationError
from tauhat.excitation import (
    AccelerationLimited,
    JerkLimited,
    JointMove,
    WaypointSettings,
    motion_limits,
    waypoint_motion,
)
from tauhat.excitation.waypoints.ramps import RAMPS, Ramps, ramps_named
from tauhat.excitation.waypoints.time_law import RateLimits, TimeLaw
from tauhat.robots import load_robot

LIMITS = RateLimits(1.3, 4.0, 25.0)
ruckig = pytest.importorskip("ruckig", reason="the extra `planner` is not installed")


def planned(
    ends: tuple[FloatArray, FloatArray], limits: tuple[FloatArray, ...], *, speeds: tuple[float, float] = (0, 0)
):
    """Return Ruckig's own trajectory from position to position."""
    n = ends[0].size
    wanted, found = ruckig.InputParameter(n), ruckig.Trajectory(n)
    wanted.current_position, wanted.target_position = (list(end) for end in ends)
    wanted.current_velocity, wanted.target_velocity = ([speed] * n for speed in speeds)
    wanted.max_velocity, wanted.max_acceleration = list(limits[0]), list(limits[1])
    if len(limits) > 2:
        wanted.max_jerk = list(limits[2])
    wanted.synchronization = ruckig.Synchronization.Phase
    ruckig.Ruckig(n).calculate(wanted, found)
    return found


def values(law: TimeLaw, t: FloatArray) -> FloatArray:
    return np.stack(law.course(t))


@pytest.mark.parametrize(("distance", "speed"), [(1.0, 1.3), (0.2, 1.3)])
def test_a_trapezoid_is_the_closed_form(distance: float, speed: float):
    law = AccelerationLimited().law((0.0, distance), (0.0, 0.0), LIMITS)
    v, a = LIMITS.speed, LIMITS.acceleration
    long = distance > v**2 / a
    assert law.duration == pytest.approx(distance / v + v / a if long else 2.0 * np.sqrt(distance / a), rel=1e-14)
    t = np.linspace(0.0, law.duration, 101)
    ramp = min(v / a, 0.5 * law.duration)
    speeds = a * np.minimum(ramp, np.minimum(t, law.duration - t))
    s, ds, _ = values(law, t)
    assert np.abs(ds - speeds).max() < 1e-14
    rising = t <= ramp
    assert np.abs(s[rising] - 0.5 * a * t[rising] ** 2).max() < 1e-14
    assert s[-1] == pytest.approx(distance, rel=1e-14)


def test_a_trapezoid_between_speeds_is_what_ruckig_plans_without_a_limit_of_jerk():
    rng = np.random.default_rng(1)
    for _ in range(30):
        first = rng.uniform(0.0, 1.3)
        distance = rng.uniform(0.05, 1.0)
        last = rng.uniform(0.0, 1.0) * AccelerationLimited().reachable(first, distance, LIMITS)
        last = max(last, np.sqrt(max(0.0, first**2 - 2.0 * LIMITS.acceleration * distance)))
        law = AccelerationLimited().law((0.0, distance), (first, last), LIMITS)
        arrays = tuple(np.array([limit]) for limit in LIMITS[:2])
        oracle = planned((np.zeros(1), np.array([distance])), arrays, speeds=(first, last))
        assert law.duration == pytest.approx(oracle.duration, rel=1e-9)
        for part in (0.1, 0.5, 0.8):
            t = part * law.duration
            assert values(law, np.array([t]))[:2, 0] == pytest.approx([x[0] for x in oracle.at_time(t)[:2]], abs=1e-9)


def test_a_move_of_one_joint_is_ruckigs_own_motion():
    robot = load_robot("ur5e")
    limits = motion_limits(robot, jerk=np.linspace(60.0, 200.0, 6))
    home, settings = np.zeros(6), WaypointSettings(limits=limits, ramps=JerkLimited())
    for joint in range(6):
        for length in (0.01, 0.5, -2.5):
            goal = home + length * np.eye(6)[joint]
            motion = waypoint_motion(robot, home, [JointMove(target=goal)], settings=settings)
            oracle = planned((home, goal), (limits.velocity, limits.acceleration, limits.jerk))
            assert motion.duration == pytest.approx(oracle.duration, rel=1e-10)
            t = np.linspace(0.0, motion.duration, 40)[:-1]
            samples = motion.sample(t)
            for row, time in enumerate(t):
                q, dq, ddq = (np.array(part) for part in oracle.at_time(time))
                assert np.abs(samples.q[row] - q).max() < 1e-10
                assert np.abs(samples.dq[row] - dq).max() < 1e-8
                assert np.abs(samples.ddq[row] - ddq).max() < 1e-6


def test_a_move_of_all_joints_is_ruckigs_motion_in_phase_where_one_joint_sets_all_limits():
    robot = load_robot("ur5e")
    velocity = motion_limits(robot).velocity
    limits = replace(motion_limits(robot, jerk=40.0 * velocity), acceleration=4.0 * velocity)
    goal = np.array([0.9, -0.3, 1.4, 0.2, -0.8, 0.5])
    motion = waypoint_motion(
        robot, np.zeros(6), [JointMove(target=goal)], settings=WaypointSettings(limits=limits, ramps=JerkLimited())
    )
    oracle = planned((np.zeros(6), goal), (limits.velocity, limits.acceleration, limits.jerk))
    assert motion.duration == pytest.approx(oracle.duration, rel=1e-10)
    for t in np.linspace(0.0, 0.99, 25) * motion.duration:
        found = motion.sample(np.array([t]))
        q, dq, _ = (np.array(part) for part in oracle.at_time(t))
        assert np.abs(found.q[0] - q).max() < 1e-10
        assert np.abs(found.dq[0] - dq).max() < 1e-8


@pytest.mark.parametrize("ramps", RAMPS, ids=lambda ramps: ramps.key)
def test_a_law_meets_its_ends_and_never_leaves_its_limits(ramps: Ramps):
    rng = np.random.default_rng(5)
    for _ in range(60):
        limits = RateLimits(*(10.0 ** rng.uniform([-1, 0, 1], [2, 3, 5])))
        low = rng.uniform(0.0, 0.4)
        distance = 10.0 ** rng.uniform(-4, -0.3)
        first = rng.uniform(0.0, 1.0) * limits.speed
        last = ramps.reachable(first, distance, limits)
        ends = (low, low + distance)
        rates = (first, last) if rng.random() < 0.5 else (last, first)  # a change is reversible in time
        law = ramps.law(ends, rates, limits)
        course = law.course(np.linspace(0.0, law.duration, 400))
        assert course.s[[0, -1]] == pytest.approx(ends, abs=1e-9)
        assert course.ds[[0, -1]] == pytest.approx(rates, rel=1e-6)
        assert course.ds.max() <= limits.speed * (1 + 1e-9)
        assert course.ds.min() >= min(rates) * (1 - 1e-6)
        assert np.abs(course.dds).max() <= limits.acceleration * (1 + 1e-9)
        if isinstance(ramps, JerkLimited):
            assert np.abs(law.state[:, 3]).max() <= limits.jerk * (1 + 1e-9)
            assert np.abs(course.dds[[0, -1]]).max() <= 1e-6 * limits.acceleration


@pytest.mark.parametrize("ramps", RAMPS, ids=lambda ramps: ramps.key)
def test_no_higher_speed_than_the_reachable_one_can_be_reached(ramps: Ramps):
    first, distance = 0.3, 0.05
    last = ramps.reachable(first, distance, LIMITS)
    assert first < last < LIMITS.speed
    shortest = ramps.law((0.0, distance), (first, last), LIMITS).duration
    assert shortest == pytest.approx(2.0 * distance / (first + last), rel=1e-5)  # no time for anything but the change
    assert ramps.reachable(first, 10.0, LIMITS) == LIMITS.speed
    assert ramps.reachable(first, 0.0, LIMITS) == first


@pytest.mark.parametrize("ramps", RAMPS, ids=lambda ramps: ramps.key)
def test_in_a_corner_one_way_slows_down_exactly_as_the_other_speeds_up(ramps: Ramps):
    u, h = np.linspace(0.001, 0.999, 200), 1e-6
    here, mirrored = ramps.corner(u), ramps.corner(1.0 - u)
    assert np.abs(here.ds + mirrored.ds - 2.0).max() < 1e-14
    assert np.abs((ramps.corner(u + h).s - ramps.corner(u - h).s) / (2 * h) - here.ds).max() < 1e-9
    assert np.abs((ramps.corner(u + h).ds - ramps.corner(u - h).ds) / (2 * h) - here.dds).max() < 1e-8
    assert np.abs(here.dds).max() == pytest.approx(ramps.corner_acceleration, rel=1e-4)
    ends = ramps.corner(np.array([0.0, 1.0]))
    assert (*ends.s, *ends.ds) == (0.0, 1.0, 0.0, 2.0)
    jerk = np.abs(np.diff(here.dds) / np.diff(u)).max()
    assert ramps.corner_jerk * 0.98 <= jerk <= ramps.corner_jerk + 1e-9


def test_ramps_are_found_by_name():
    assert ramps_named("jerk-limited") == JerkLimited()
    with pytest.raises(ExcitationError, match="unknown ramps; expected trapezoidal, jerk-limited, got sudden"):
        ramps_named("sudden")


def test_a_law_without_phases_is_refused():
    with pytest.raises(ExcitationError, match="time law"):
        TimeLaw(begin=np.array([0.0, 0.5]), state=np.zeros((2, 4)), duration=0.4)
