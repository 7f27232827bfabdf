"""Fourier motions: rest at both ends, linear, consistent, and inside the limits at all times."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tauhat.errors import ArrayError, RobotError, TauhatError
from tauhat.excitation import FourierSeries, fourier_basis, motion_limits, random_fourier, rest_basis
from tauhat.robots.joint import Joint, Limits
from tauhat.robots.robot import Robot


def robot_with(*limits: Limits, kind: str = "revolute") -> Robot:
    joints = [
        Joint(
            name=f"j{index}",
            kind=kind,
            parent=index - 1,
            rotation=np.eye(3),
            translation=np.zeros(3),
            axis=np.eye(3)[2],
            limits=limit,
        )
        for index, limit in enumerate(limits)
    ]
    return Robot(name="limited", joints=tuple(joints))


def random_limits(rng: np.random.Generator) -> Limits:
    """Limits of any tightness, each of them missing now and then."""
    lower = rng.uniform(-6.0, 3.0)
    upper = lower + 10.0 ** rng.uniform(-2.0, 1.0)
    chosen = np.array([lower, upper, 10.0 ** rng.uniform(-1.0, 1.0), 10.0 ** rng.uniform(-1.0, 2.0)])
    chosen = np.where(rng.uniform(size=4) < 0.2, [-np.inf, np.inf, np.inf, np.inf], chosen)
    return Limits(lower=chosen[0], upper=chosen[1], velocity=chosen[2], acceleration=chosen[3])


def random_series(seed: int, *, n_v: int = 3, harmonics: int = 5, period: float = 7.0) -> FourierSeries:
    rng = np.random.default_rng(seed)
    free = rng.standard_normal((n_v, 2 * harmonics - 2))
    return FourierSeries.from_free(free, offset=rng.standard_normal(n_v), period=period)


@pytest.mark.parametrize("period", [0.3, 10.0, np.e])
def test_motion_is_at_rest_at_both_ends_and_after_many_periods(period: float) -> None:
    series = random_series(1, period=period)
    ends = series.sample(period * np.array([0.0, 1.0, 2.0, 64.0]))
    scale = series.envelope()
    assert np.abs(ends.dq / scale.velocity).max() <= 1e-12
    assert np.abs(ends.ddq / scale.acceleration).max() <= 1e-12
    np.testing.assert_allclose(ends.q, np.tile(ends.q[0], (4, 1)), rtol=0, atol=1e-12)


def test_rest_basis_is_orthonormal_and_spans_all_coefficients_at_rest() -> None:
    for harmonics in range(2, 12):
        basis = rest_basis(harmonics)
        _, velocity, acceleration = fourier_basis(np.zeros(1), period=2.0 * np.pi, harmonics=harmonics)
        assert basis.shape == (2 * harmonics, 2 * harmonics - 2)
        np.testing.assert_allclose(basis.T @ basis, np.eye(2 * harmonics - 2), atol=1e-14)
        assert np.abs(np.vstack([velocity, acceleration]) @ basis).max() <= 1e-12


def test_velocity_and_acceleration_are_the_derivatives_of_position() -> None:
    series = random_series(2)
    t, h = np.linspace(0.0, series.period, 301), 1e-4
    before, at, after = series.sample(t - h), series.sample(t), series.sample(t + h)
    np.testing.assert_allclose((after.q - before.q) / (2.0 * h), at.dq, atol=1e-6 * np.abs(at.dq).max())
    np.testing.assert_allclose((after.dq - before.dq) / (2.0 * h), at.ddq, atol=1e-6 * np.abs(at.ddq).max())


@given(seed=st.integers(0, 2**32 - 1), a=st.floats(-3.0, 3.0), b=st.floats(-3.0, 3.0))
@settings(max_examples=30, deadline=None)
def test_motion_is_linear_in_free_coefficients_and_offset(seed: int, a: float, b: float) -> None:
    x, y = random_series(seed), random_series(seed + 1)
    both = FourierSeries.from_free(a * x.free + b * y.free, offset=a * x.offset + b * y.offset, period=x.period)
    t = np.linspace(0.0, 2.0 * x.period, 57)
    for name in ("q", "dq", "ddq"):
        combined = a * getattr(x.sample(t), name) + b * getattr(y.sample(t), name)
        np.testing.assert_allclose(getattr(both.sample(t), name), combined, atol=1e-10)


def test_half_the_period_is_twice_the_speed_and_four_times_the_acceleration() -> None:
    slow = random_series(3, period=8.0)
    fast = FourierSeries(period=4.0, coefficients=slow.coefficients, offset=slow.offset)
    t = np.linspace(0.0, 8.0, 100)
    np.testing.assert_allclose(fast.sample(t / 2.0).dq, 2.0 * slow.sample(t).dq, atol=1e-11)
    np.testing.assert_allclose(fast.sample(t / 2.0).ddq, 4.0 * slow.sample(t).ddq, atol=1e-10)


def test_free_coefficients_come_back_from_the_series() -> None:
    free = np.random.default_rng(4).standard_normal((2, 6))
    series = FourierSeries.from_free(free, offset=np.zeros(2), period=1.0)
    np.testing.assert_allclose(series.free, free, atol=1e-14)
    assert (series.n_v, series.n_h, series.duration, series.base_frequency) == (2, 4, 1.0, 1.0)


def test_envelope_holds_between_its_own_grid_points_and_is_tight() -> None:
    for seed in range(50):
        series = random_series(seed, harmonics=2 + seed % 9)
        fine = series.sample(np.linspace(0.0, series.period, 1280 * series.n_h + 1))
        bound = series.envelope()
        spans = [
            (bound.upper - bound.lower, np.ptp(fine.q, axis=0)),
            (bound.velocity, np.abs(fine.dq).max(axis=0)),
            (bound.acceleration, np.abs(fine.ddq).max(axis=0)),
        ]
        assert (fine.q <= bound.upper).all()
        assert (fine.q >= bound.lower).all()
        for outer, inner in spans:
            assert (inner <= outer).all()
            assert (outer <= 1.0005 * inner).all()


def test_random_motion_keeps_all_limits_on_a_ten_times_finer_grid_for_100_robots() -> None:
    for seed in range(100):
        rng = np.random.default_rng(seed)
        robot = robot_with(*(random_limits(rng) for _ in range(6)))
        margin = float(rng.choice([0.0, 0.05, 0.3]))
        series = random_fourier(robot, period=10.0, harmonics=5, rng=rng, margin=margin)
        fine, limits = series.sample(np.linspace(0.0, 10.0, 10_001)), motion_limits(robot, margin=margin)
        assert (fine.q <= limits.upper).all()
        assert (fine.q >= limits.lower).all()
        assert (np.abs(fine.dq) <= limits.velocity).all()
        assert (np.abs(fine.ddq) <= limits.acceleration).all()
        room = [limits.upper - limits.lower, limits.velocity, limits.acceleration]
        used = [np.ptp(fine.q, axis=0), np.abs(fine.dq).max(axis=0), np.abs(fine.ddq).max(axis=0)]
        assert (np.max(np.array(used) / np.array(room), axis=0) > 0.999).all()


def test_margin_is_kept_from_the_robots_own_limits() -> None:
    robot = robot_with(Limits(lower=-1.0, upper=3.0, velocity=2.0, acceleration=10.0))
    limits = motion_limits(robot, margin=0.1)
    assert [limits.lower[0], limits.upper[0]] == pytest.approx([-0.8, 2.8])
    assert [limits.velocity[0], limits.acceleration[0]] == pytest.approx([1.8, 9.0])


def test_missing_limits_get_the_documented_ones() -> None:
    free = motion_limits(robot_with(Limits()))
    assert [free.lower[0], free.upper[0], free.velocity[0], free.acceleration[0]] == [-np.pi, np.pi, 2.0, 6.0]
    rail = motion_limits(robot_with(Limits(), kind="prismatic"))
    assert [rail.lower[0], rail.upper[0], rail.velocity[0], rail.acceleration[0]] == [-0.5, 0.5, 0.5, 1.5]
    one_sided = motion_limits(robot_with(Limits(lower=1.0, velocity=4.0), Limits(upper=1.0)))
    assert one_sided.upper[0] == pytest.approx(1.0 + 2.0 * np.pi)
    assert one_sided.lower[1] == pytest.approx(1.0 - 2.0 * np.pi)
    assert one_sided.acceleration[0] == 12.0


def test_same_seed_gives_the_same_motion_and_another_seed_another() -> None:
    robot = robot_with(Limits(), Limits(velocity=1.0))
    first, again, other = (
        random_fourier(robot, period=5.0, harmonics=3, rng=np.random.default_rng(seed)) for seed in (7, 7, 8)
    )
    np.testing.assert_array_equal(first.coefficients, again.coefficients)
    np.testing.assert_array_equal(first.offset, again.offset)
    assert not np.allclose(first.coefficients, other.coefficients)


def test_arrays_are_read_only() -> None:
    series = random_series(5)
    samples = series.sample(np.linspace(0.0, 1.0, 5))
    for array in (series.coefficients, series.offset, samples.t, samples.q, samples.dq, samples.ddq):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


def test_a_series_that_starts_moving_is_refused_and_names_its_joint() -> None:
    coefficients = np.zeros((2, 6))
    coefficients[1, 0] = 1.0
    with pytest.raises(TauhatError, match="joint 2: a Fourier series does not start at rest"):
        FourierSeries(period=1.0, coefficients=coefficients, offset=np.zeros(2))
    coefficients[1] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]
    with pytest.raises(TauhatError, match="does not start at rest"):
        FourierSeries(period=1.0, coefficients=coefficients, offset=np.zeros(2))


@pytest.mark.parametrize("period", [0.0, -1.0, np.inf, np.nan])
def test_period_must_be_a_positive_time(period: float) -> None:
    with pytest.raises(TauhatError, match="positive time"):
        FourierSeries(period=period, coefficients=np.zeros((1, 4)), offset=np.zeros(1))


def test_coefficients_that_make_no_series_are_refused() -> None:
    with pytest.raises(TauhatError, match="pairs"):
        FourierSeries(period=1.0, coefficients=np.zeros((1, 5)), offset=np.zeros(1))
    with pytest.raises(TauhatError, match="pairs"):
        FourierSeries.from_free(np.zeros((1, 3)), offset=np.zeros(1), period=1.0)
    with pytest.raises(TauhatError, match="too few harmonics"):
        FourierSeries.from_free(np.zeros((1, 0)), offset=np.zeros(1), period=1.0)
    with pytest.raises(ArrayError, match="offset is not finite"):
        FourierSeries.from_free(np.zeros((1, 4)), offset=np.array([np.nan]), period=1.0)
    with pytest.raises(ArrayError, match="free coefficients"):
        FourierSeries.from_free(np.zeros((2, 4)), offset=np.zeros(1), period=1.0)


@pytest.mark.parametrize("limits", [Limits(lower=1.0, upper=1.0), Limits(velocity=0.0), Limits(acceleration=0.0)])
def test_a_joint_without_room_is_named(limits: Limits) -> None:
    robot = robot_with(Limits(), limits)
    with pytest.raises(RobotError, match="joint j1: the limits leave the joint no room"):
        random_fourier(robot, period=1.0, harmonics=3, rng=np.random.default_rng(0))


@pytest.mark.parametrize("margin", [-0.1, 1.0, np.nan])
def test_margin_must_leave_room(margin: float) -> None:
    with pytest.raises(TauhatError, match="margin"):
        random_fourier(robot_with(Limits()), period=1.0, harmonics=3, rng=np.random.default_rng(0), margin=margin)


def test_one_harmonic_cannot_move_from_rest_to_rest() -> None:
    with pytest.raises(TauhatError, match="too few harmonics"):
        random_fourier(robot_with(Limits()), period=1.0, harmonics=1, rng=np.random.default_rng(0))
