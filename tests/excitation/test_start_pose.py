"""A prescribed start: motions begin and end there, stay inside all limits, and poses that cannot be one are named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tauhat.arrays import FloatArray
from tauhat.dynamics.motion import MotionGradient
from tauhat.errors import ExcitationError
from tauhat.excitation import (
    DesignSettings,
    FourierSeries,
    FourierSpace,
    GeneticSettings,
    LimitSet,
    design,
    motion_limits,
    parse_limits,
    random_points,
)
from tauhat.excitation.barrier import Barrier
from tauhat.excitation.gradient import soft_map
from tauhat.robots import load_robot

QUICK = DesignSettings(harmonics=3, period=5.0, genetic=GeneticSettings(population=12, generations=3))


def space(start: FloatArray, name: str = "two_link") -> FourierSpace:
    limits = motion_limits(load_robot(name), jerk=np.full(start.size, 30.0))
    return FourierSpace(limits=limits, period=5.0, harmonics=3, start=start)


def start_near_a_limit(name: str, part: float) -> FloatArray:
    """A pose that leaves the given part of each half range to the lower limits."""
    limits = motion_limits(load_robot(name))
    return limits.lower + part * 0.5 * (limits.upper - limits.lower)


@pytest.mark.parametrize("name", ["two_link", "ur5e", "panda"])
@pytest.mark.parametrize("part", [1.0, 0.2, 0.001])
def test_random_motions_begin_and_end_at_the_start_inside_all_joint_limits(name: str, part: float) -> None:
    where = space(start_near_a_limit(name, part), name)
    for point in random_points(where, 20, np.random.default_rng(0)):
        fine = where.series(point).sample(np.linspace(0.0, 5.0, 4001))
        np.testing.assert_allclose(fine.q[[0, -1]], np.tile(where.start, (2, 1)), rtol=0, atol=1e-12)
        assert np.abs(fine.dq[[0, -1]]).max() <= 1e-12
        assert (fine.q >= where.limits.lower - 1e-12).all()
        assert (fine.q <= where.limits.upper + 1e-12).all()
        assert (np.abs(fine.dq) <= where.limits.velocity * (1 + 1e-12)).all()
        assert (np.abs(fine.ddq) <= where.limits.acceleration * (1 + 1e-12)).all()


def test_motions_from_a_start_near_a_limit_use_the_room_on_the_other_side() -> None:
    where = space(start_near_a_limit("ur5e", 0.01), "ur5e")
    moved = [
        np.ptp(where.series(x).sample(np.linspace(0, 5, 501)).q, axis=0)
        for x in random_points(where, 20, np.random.default_rng(0))
    ]
    assert (np.median(moved, axis=0) > 5 * 0.01 * where.reach).all()


def test_the_start_is_eliminated_and_every_series_of_the_space_comes_back() -> None:
    where = space(np.array([0.3, -0.4]))
    assert where.shape == (2, 4)
    x = random_points(where, 1, np.random.default_rng(1))[0]
    series = where.series(x)
    np.testing.assert_allclose(where.point(series), x, atol=1e-14)
    again = FourierSeries.from_start(series.free, start=where.start, period=5.0)
    np.testing.assert_allclose(again.offset, series.offset, atol=1e-15)
    np.testing.assert_array_equal(
        where.series(where.resting(where.start)).sample(np.arange(3.0)).q, np.tile(where.start, (3, 1))
    )


def test_the_grid_is_the_motion_and_its_pullback_the_transpose() -> None:
    where, rng = space(np.array([0.3, -0.4])), np.random.default_rng(2)
    grid, x = where.grid(40), random_points(where, 1, rng)[0]
    motion, samples = grid.motion(x), where.series(x).sample(np.arange(40) * 5.0 / 40)
    for name in ("q", "dq", "ddq"):
        np.testing.assert_allclose(getattr(motion, name), getattr(samples, name).T, atol=1e-12)
    bars = rng.normal(size=(3, 2, 40))
    still = grid.motion(np.zeros(where.shape))
    change = [(getattr(motion, name) - getattr(still, name)) for name in ("q", "dq", "ddq")]
    expected = sum((bar * part).sum() for bar, part in zip(bars, change, strict=True))
    assert (grid.pull(MotionGradient(*bars)) * x).sum() == pytest.approx(expected)
    assert (grid.pull_each(MotionGradient(*bars)).sum(axis=0) * x.ravel()).sum() == pytest.approx(expected)


def test_limits_are_affine_and_the_gauge_takes_a_point_onto_them() -> None:
    where = space(start_near_a_limit("two_link", 0.3))
    grid, rng = where.grid(4000), np.random.default_rng(3)
    x = rng.normal(size=where.shape)
    edge = x / where.gauge(x)[:, None]
    used = grid.rest() + np.einsum("jrk,jk->jr", grid.rows(), edge)
    largest = np.abs(used).max(axis=1)
    assert (largest <= 1.0 + 1e-12).all()
    assert (largest >= 0.999).all()
    places = (grid.motion(edge).q - where.middle[:, None]) / where.reach[:, None]
    np.testing.assert_allclose(used[:, :4000], places, atol=1e-12)


def test_soft_map_and_barrier_have_the_slopes_of_finite_differences_with_a_start() -> None:
    where = space(start_near_a_limit("two_link", 0.3))
    grid, rng = where.grid(60), np.random.default_rng(4)
    rows, rest = grid.rows(), grid.rest()
    x, way, weight = rng.normal(size=(3, *where.shape))
    image, pull = soft_map(rows, rest, 3.0 * x)
    assert np.abs(rest + np.einsum("jrk,jk->jr", rows, image)).max() < 1.0
    ahead, behind = (soft_map(rows, rest, 3.0 * x + sign * 1e-6 * way)[0] for sign in (1, -1))
    assert (pull(weight) * way).sum() == pytest.approx((weight * (ahead - behind)).sum() / 2e-6, rel=1e-5)
    barrier, inner = Barrier(rows=rows, rest=rest, weight=0.3), 0.5 * x / where.gauge(x)[:, None]
    up, down = (barrier.at(inner + sign * 1e-6 * way)[0] for sign in (1, -1))
    assert (barrier.at(inner)[1] * way).sum() == pytest.approx((up - down) / 2e-6, rel=1e-6)
    assert np.abs(barrier.used(inner + barrier.longest(inner, way) * way)).max() == pytest.approx(1.0)


LIMITS = {
    "joint limits alone": "",
    "several joints": "[torque]\nfraction = 0.8\n[tool]\nspeed = 1\n[[planes]]\nname = 'floor'\noffset = -0.5",
}


@pytest.mark.parametrize("text", LIMITS.values(), ids=LIMITS.keys())
@pytest.mark.parametrize("method", ["gradient", "genetic", "both"])
def test_a_design_begins_and_ends_at_the_start_of_the_file(method: str, text: str) -> None:
    robot = load_robot("two_link")
    limits = parse_limits(f"[start]\nq = [30, -60]\nunit = 'deg'\n{text}", robot)
    found = design(robot, rng=np.random.default_rng(0), settings=replace(QUICK, limits=limits, method=method))
    fine = found.trajectory.sample(np.linspace(0.0, 5.0, 2001))
    np.testing.assert_allclose(np.rad2deg(fine.q[[0, -1]]), [[30, -60], [30, -60]], atol=1e-10)
    assert min(found.margins.values()) >= -1e-12
    assert found.condition < (300 if method == "genetic" else 60)
    recording = found.recording(rate=100.0)
    np.testing.assert_allclose(np.rad2deg(recording.q[[0, -1]]), [[30, -60], [30, -60]], atol=1e-10)


def test_degrees_are_of_revolute_joints_only() -> None:
    from sample_arms import chain

    robot = chain(np.random.default_rng(0), "RPR")
    text = "[start]\nq = [90, 0.3, -45]\nunit = '{}'"
    np.testing.assert_allclose(parse_limits(text.format("deg"), robot).start, [np.pi / 2, 0.3, -np.pi / 4])
    np.testing.assert_allclose(parse_limits(text.format("rad"), robot).start, [90, 0.3, -45])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[start]\nq = [0, 0]\n[[boxes]]\nname = 'crate'\nsize = [1, 1, 1]\nxyz = [0.8, 0, 0]",
         "crate: start pose in collision; got link of joint_2: "),
        ("[start]\nq = [0, 0]\n[[planes]]\nname = 'table'\noffset = -0.05",
         "table: start pose nearer than the clearance; got link of joint_2: 5 mm nearer than 10 mm"),
        ("[start]\nq = [-1.0, 0]\n[[planes]]\nname = 'table'\noffset = -0.05", "table: start pose in collision"),
        ("[start]\nq = [4, 0]",
         "joint joint_1: start pose outside joint limits; expected inside (-2.98451, 2.98451), got 4; 5 % of"),
        ("[start]\nq = [0, 0]\n[torque]\nlargest = 20",
         "torque: the start pose does not keep the limit; got joint joint_1"),
        ("[start]\nq = [0, 0]\n[tool]\nlower = [0, -1, 0.2]\nupper = [0.5, 1, 0.9]",
         "tool box: the start pose does not keep the limit; got highest x of the tool: 400 mm outside"),
    ],
)  # fmt: skip
def test_a_pose_that_cannot_be_the_start_is_named_with_the_limit_and_how_much(text: str, message: str) -> None:
    robot = load_robot("two_link")
    limits = parse_limits(text, robot)
    with pytest.raises(ExcitationError) as caught:
        design(robot, rng=np.random.default_rng(0), settings=replace(QUICK, limits=limits))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_links_that_collide_with_each_other_at_the_start_are_both_named() -> None:
    robot = load_robot("ur5e")
    pose = [0.0, -1.57, 2.8, 0.0, 0.0, 0.0]
    limits = parse_limits(f"[start]\nq = {pose}\n[collision]\nradius = 0.068", robot)
    with pytest.raises(ExcitationError, match=r"self-collision: start pose in collision; got .* and .*: .* mm deep"):
        design(robot, rng=np.random.default_rng(0), settings=replace(QUICK, limits=limits))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[start]", "[start]: a key is missing; expected q"),
        ("[start]\nq = [1]", "q has the wrong form; expected 2 numbers"),
        ("[start]\nq = [1, nan]", "q is not finite"),
        ("[start]\nq = [1, 1]\nunit = 'grad'", "unknown unit; expected rad | deg, got grad"),
        ("[start]\npose = [1, 1]", "unknown key; got pose"),
        ("home = [0, 0]\n[start]\nq = [0, 0]", "both a home and a start pose"),
    ],
)
def test_mistakes_in_the_start_section_are_one_line(text: str, message: str) -> None:
    with pytest.raises(ExcitationError) as caught:
        parse_limits(text, load_robot("two_link"))
    assert message in str(caught.value)


def test_a_start_pose_of_the_wrong_size_is_refused() -> None:
    with pytest.raises(Exception, match="start has the wrong shape"):
        LimitSet(robot=load_robot("two_link"), start=np.zeros(3))
