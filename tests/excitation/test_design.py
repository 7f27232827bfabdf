"""Designed motions: inside their limits at all times, at rest at the ends, better than random, the same for a seed."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest

from tauhat.errors import ExcitationError, MissingExtraError, RobotError
from tauhat.excitation import (
    ConditionNumber,
    DesignSettings,
    FourierSpace,
    GeneticSettings,
    Mixed,
    design,
    motion_limits,
    random_points,
)
from tauhat.excitation.gradient import soft_map
from tauhat.robots import Joint, Limits, Robot, load_robot

QUICK = DesignSettings(harmonics=3, period=5.0, genetic=GeneticSettings(population=20, generations=5))


def two_link() -> Robot:
    return load_robot("two_link")


def space(robot: Robot, harmonics: int = 3) -> FourierSpace:
    return FourierSpace(limits=motion_limits(robot), period=5.0, harmonics=harmonics)


@pytest.mark.parametrize("name", ["two_link", "ur5e", "panda", "crs_a465"])
def test_random_points_are_feasible_every_time_and_touch_no_limit_from_outside(name):
    where = space(load_robot(name))
    points = random_points(where, 25, np.random.default_rng(0))
    gauges = np.array([where.gauge(point) for point in points])
    assert (gauges <= 1.0 + 1e-12).all()
    assert gauges.max() > 0.7


def test_joint_limits_are_linear_in_a_point():
    where = space(two_link())
    grid, rng = where.grid(40), np.random.default_rng(1)
    a, b = rng.normal(size=(2, *where.shape))
    used = np.einsum("jrk,jk->jr", grid.rows(), a + 2 * b)
    parts = [np.einsum("jrk,jk->jr", grid.rows(), part) for part in (a, b)]
    assert np.allclose(used, parts[0] + 2 * parts[1])
    motion = grid.motion(a)
    assert np.allclose(used.shape, (2, 120))
    assert np.allclose(parts[0][:, 40:80], motion.dq / where.limits.velocity[:, None])


def test_motion_and_pullback_of_the_grid_are_transposes():
    where = space(two_link())
    grid, rng = where.grid(30), np.random.default_rng(2)
    x = rng.normal(size=where.shape)
    bars = rng.normal(size=(3, 2, 30))
    motion, still = grid.motion(x), grid.motion(np.zeros(where.shape))
    from tauhat.dynamics.motion import MotionGradient

    forward = sum((bar * (m - s)).sum() for bar, m, s in zip(
        bars, (motion.q, motion.dq, motion.ddq), (still.q, still.dq, still.ddq), strict=True))  # fmt: skip
    assert (grid.pull(MotionGradient(*bars)) * x).sum() == pytest.approx(forward)


def test_soft_map_stays_inside_and_its_gradient_is_that_of_finite_differences():
    where = space(two_link())
    grid, rng = where.grid(50), np.random.default_rng(3)
    rows, rest = grid.rows(), grid.rest()
    x, direction, weight = rng.normal(size=(3, *where.shape))
    image, pull = soft_map(rows, rest, 3.0 * x)
    assert np.abs(np.einsum("jrk,jk->jr", rows, image)).max() < 1.0
    ahead, behind = (soft_map(rows, rest, 3.0 * x + sign * 1e-6 * direction)[0] for sign in (1, -1))
    expected = (weight * (ahead - behind)).sum() / 2e-6
    assert (pull(weight) * direction).sum() == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("method", ["gradient", "genetic", "both"])
def test_a_designed_motion_keeps_its_limits_on_a_fine_grid_and_rests_at_its_ends(method):
    robot = two_link()
    found = design(robot, rng=np.random.default_rng(4), settings=replace(QUICK, method=method, margin=0.1))
    t = np.linspace(0.0, 5.0, 4001)
    samples, limits = found.trajectory.sample(t), motion_limits(robot, margin=0.1)
    slack = 1e-12
    assert (samples.q >= limits.lower - slack * np.abs(limits.lower)).all()
    assert (samples.q <= limits.upper + slack * np.abs(limits.upper)).all()
    assert (np.abs(samples.dq) <= limits.velocity * (1 + slack)).all()
    assert (np.abs(samples.ddq) <= limits.acceleration * (1 + slack)).all()
    assert np.abs(samples.dq[[0, -1]]).max() <= 1e-12
    assert np.abs(samples.ddq[[0, -1]]).max() <= 1e-12
    assert min(found.margins.values()) >= 0.1 - 1e-9


def test_gradient_design_beats_random_motions_by_far():
    robot = two_link()
    found = design(robot, rng=np.random.default_rng(5), settings=QUICK, criterion=ConditionNumber())
    from tauhat.dynamics import torque_model
    from tauhat.excitation import information

    where, facts = space(robot), information(torque_model(robot))
    grid = where.grid(400)
    random = [
        np.linalg.cond(facts.matrix(grid.motion(x))) ** 0.5 for x in random_points(where, 20, np.random.default_rng(0))
    ]
    assert found.condition < 0.8 * min(random)


def test_the_same_seed_gives_the_same_motion():
    runs = [design(two_link(), rng=np.random.default_rng(6), settings=replace(QUICK, method="both")) for _ in range(2)]
    assert np.array_equal(runs[0].trajectory.coefficients, runs[1].trajectory.coefficients)


def test_more_weight_on_volume_buys_information_for_condition():
    lean, rich = (
        design(two_link(), rng=np.random.default_rng(7), settings=QUICK, criterion=Mixed(weight=weight))
        for weight in (0.0, 3.0)
    )
    assert rich.log_det > lean.log_det
    assert rich.condition >= 0.99 * lean.condition


def test_twice_the_time_and_a_quarter_of_the_acceleration_is_the_same_problem():
    """Scaling law: a motion that is slower by two keeps limits that are slower by two and four."""
    robot = two_link()
    slow = Robot(
        name="slow",
        joints=tuple(
            replace(joint, limits=replace(joint.limits, velocity=1.0, acceleration=3.0)) for joint in robot.joints
        ),
    )
    fast = Robot(
        name="fast",
        joints=tuple(
            replace(joint, limits=replace(joint.limits, velocity=2.0, acceleration=12.0)) for joint in robot.joints
        ),
    )
    points = [
        random_points(FourierSpace(limits=motion_limits(arm), period=period, harmonics=3), 3, np.random.default_rng(8))
        for arm, period in ((slow, 10.0), (fast, 5.0))
    ]
    assert np.allclose(points[0], points[1])


def test_progress_is_told_after_each_generation():
    told: list[tuple[int, float]] = []
    design(
        two_link(), rng=np.random.default_rng(9), settings=replace(QUICK, method="genetic"),
        progress=lambda generation, best: told.append((generation, best)),
    )  # fmt: skip
    assert [generation for generation, _ in told] == [1, 2, 3, 4, 5]
    assert [best for _, best in told] == sorted((best for _, best in told), reverse=True)


def test_what_cannot_be_designed_is_named():
    stuck = Joint(
        name="stuck", kind="revolute", parent=-1, rotation=np.eye(3), translation=np.zeros(3),
        axis=np.array([0.0, 0.0, 1.0]), limits=Limits(lower=1.0, upper=1.0),
    )  # fmt: skip
    with pytest.raises(RobotError, match="joint stuck: the limits leave the joint no room"):
        design(Robot(name="arm", joints=(stuck,)), rng=np.random.default_rng(0))
    with pytest.raises(ExcitationError, match="unknown method"):
        DesignSettings(method="luck")  # type: ignore[arg-type]
    with pytest.raises(ExcitationError, match="too small a genetic search"):
        GeneticSettings(population=2)
    with pytest.raises(ExcitationError, match="at least one start"):
        DesignSettings(starts=0)


def test_genetic_design_without_pymoo_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "pymoo.algorithms.soo.nonconvex.ga", None)
    with pytest.raises(MissingExtraError, match=r"tauhat\[excitation\]"):
        design(two_link(), rng=np.random.default_rng(0), settings=replace(QUICK, method="genetic"))
