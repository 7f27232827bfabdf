"""Sensor errors have the statistics they are given."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tauhat.arrays import FloatArray
from tauhat.errors import SimulationError
from tauhat.robots import load_robot
from tauhat.simulation import PRESETS, Measured, Ripple, SensorErrors, Signals, measure, sensor_preset

RNG = np.random.default_rng(0)
STEP = 1e-3
T = STEP * np.arange(20_000)
Q, DQ, TAU = RNG.standard_normal((3, 20_000, 3)) * np.array([1.0, 2.0, 30.0])


def shown(seed: int = 1, **errors: Any) -> Measured:
    """Return what sensors show of white signals."""
    return measure(SensorErrors(**errors), Signals(t=T, q=Q, dq=DQ, tau=TAU), rng=np.random.default_rng(seed))


SPEED = np.array([2.0, 3.0, 5.0])
SMOOTH = Signals(
    t=T, q=np.sin(SPEED * T[:, None]), dq=SPEED * np.cos(SPEED * T[:, None]), tau=np.cos(7.0 * T[:, None] + SPEED)
)


def seen(seed: int = 1, **errors: Any) -> Measured:
    """Return what sensors show of a smooth motion."""
    return measure(SensorErrors(**errors), SMOOTH, rng=np.random.default_rng(seed))


def of_nothing(seed: int = 1, **errors: Any) -> FloatArray:
    """Return the torque that sensors show where there is none."""
    none = replace(SMOOTH, tau=np.zeros_like(Q))
    return measure(SensorErrors(**errors), none, rng=np.random.default_rng(seed)).tau


def test_perfect_sensors_show_the_truth_and_no_velocity() -> None:
    measured = shown()
    np.testing.assert_array_equal(measured.q, Q)
    np.testing.assert_array_equal(measured.tau, TAU)
    assert measured.dq is None


def test_encoder_shows_the_nearest_multiple_of_its_step() -> None:
    step = np.array([1e-2, 0.0, 1e-3])
    measured = shown(encoder_step=step)
    error = measured.q - Q
    np.testing.assert_array_equal(error[:, 1], 0.0)
    for joint in (0, 2):
        counts = measured.q[:, joint] / step[joint]
        np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
        assert np.abs(error[:, joint]).max() <= 0.5 * step[joint] * (1.0 + 1e-9)
        assert error[:, joint].std() == pytest.approx(step[joint] / np.sqrt(12.0), rel=0.02)


def test_torque_noise_is_white_with_the_given_deviation_and_offset() -> None:
    error = shown(torque_noise=np.array([0.1, 0.5, 2.0]), torque_offset=np.array([0.0, 1.0, -3.0])).tau - TAU
    np.testing.assert_allclose(error.std(axis=0), [0.1, 0.5, 2.0], rtol=0.03)
    np.testing.assert_allclose(error.mean(axis=0), [0.0, 1.0, -3.0], atol=0.06)
    centred = error - error.mean(axis=0)
    neighbours = np.mean(centred[1:] * centred[:-1], axis=0) / np.mean(centred**2, axis=0)
    assert np.abs(neighbours).max() < 0.03


def test_relative_noise_is_a_fraction_of_each_joints_rms_torque() -> None:
    error = shown(relative_torque_noise=0.05).tau - TAU
    np.testing.assert_allclose(error.std(axis=0), 0.05 * np.sqrt(np.mean(TAU**2, axis=0)), rtol=0.03)


def test_both_torque_noises_add_as_variances() -> None:
    rms = np.sqrt(np.mean(TAU**2, axis=0))
    error = shown(relative_torque_noise=0.03, torque_noise=0.04 * rms).tau - TAU
    np.testing.assert_allclose(error.std(axis=0), 0.05 * rms, rtol=0.03)


def test_velocity_is_shown_when_it_is_measured() -> None:
    exact, noisy = shown(velocity_noise=0.0).dq, shown(velocity_noise=0.2).dq
    assert exact is not None
    assert noisy is not None
    np.testing.assert_array_equal(exact, DQ)
    np.testing.assert_allclose((noisy - DQ).std(axis=0), 0.2, rtol=0.03)


def test_a_differenced_velocity_is_the_step_of_the_shown_position_and_half_a_period_late() -> None:
    coarse = seen(velocity="differenced", encoder_step=1e-4)
    assert coarse.dq is not None
    np.testing.assert_allclose(np.cumsum(STEP * coarse.dq, axis=0), coarse.q - coarse.q[0], atol=1e-9)
    fine = seen(velocity="differenced")
    assert fine.dq is not None
    late = SPEED * np.cos(SPEED * (T[:, None] - STEP / 2))
    np.testing.assert_allclose(fine.dq[1:], late[1:], atol=1e-5)
    quantisation = (coarse.dq - fine.dq)[1:]
    # Two independent roundings of variance step^2 / 12 over one period.
    np.testing.assert_allclose(quantisation.std(axis=0), 1e-4 / STEP / np.sqrt(6.0), rtol=0.05)


def test_same_seed_shows_the_same_and_another_seed_does_not() -> None:
    np.testing.assert_array_equal(shown(3, torque_noise=1.0).tau, shown(3, torque_noise=1.0).tau)
    assert not np.array_equal(shown(3, torque_noise=1.0).tau, shown(4, torque_noise=1.0).tau)


def test_ripple_is_one_line_in_the_spectrum_over_the_angle() -> None:
    turning = np.linspace(0.0, 2.0 * np.pi * 8.0, T.size, endpoint=False)[:, None] * np.ones(3)
    still = Signals(t=T, q=turning, dq=np.ones_like(Q), tau=np.zeros_like(Q))
    ripples = (
        Ripple(amplitude=[0.3, 0.0, 0.1], order=4.0, phase=0.7),
        Ripple(amplitude=0.2, order=2.0, turns="motor", gear_ratio=50.0),
    )
    torque = measure(SensorErrors(ripples=ripples), still, rng=np.random.default_rng(0)).tau
    spectrum = 2.0 * np.abs(np.fft.rfft(torque, axis=0)) / T.size
    np.testing.assert_allclose(spectrum[8 * 4], [0.3, 0.0, 0.1], atol=1e-9)
    np.testing.assert_allclose(spectrum[8 * 2 * 50], 0.2, atol=1e-9)
    others = np.delete(spectrum, [32, 800], axis=0)
    assert others.max() < 1e-9
    np.testing.assert_allclose(torque[0, [0, 2]], np.sin(0.7) * np.array([0.3, 0.1]), atol=1e-12)


def test_ripple_of_a_motor_follows_the_motor_and_that_of_a_joint_the_link() -> None:
    sides = replace(SMOOTH, tau=np.zeros_like(Q), link=SMOOTH.q + 0.1, motor=SMOOTH.q + 0.3)
    for turns, ahead in (("joint", 0.1), ("motor", 0.3)):
        ripple = Ripple(amplitude=2.0, order=3.0, turns=turns)
        torque = measure(SensorErrors(ripples=(ripple,)), sides, rng=np.random.default_rng(0)).tau
        np.testing.assert_allclose(torque, 2.0 * np.sin(3.0 * (SMOOTH.q + ahead)), atol=1e-12)


def test_drift_has_its_slope_and_a_random_walk_its_growth() -> None:
    drift = of_nothing(torque_drift=np.array([36.0, -18.0, 0.0]))
    np.testing.assert_allclose(drift, T[:, None] / 3600.0 * np.array([36.0, -18.0, 0.0]), atol=1e-12)
    walks = np.array([of_nothing(seed, torque_walk=1.0) for seed in range(40)])
    variance = walks.var(axis=(0, 2))
    hours = T / 3600.0
    assert variance[0] == 0.0
    np.testing.assert_allclose(variance[[5_000, 19_999]], hours[[5_000, 19_999]], rtol=0.4)
    increments = np.diff(walks[0], axis=0)
    assert np.abs(np.mean(increments[1:] * increments[:-1])) < 0.05 * increments.var()


@pytest.mark.parametrize("delay", [0.0, 4e-3, 2.6e-3, -1.3e-3])
def test_a_delayed_torque_is_found_that_late_by_cross_correlation(delay: float) -> None:
    rng = np.random.default_rng(2)
    band = rng.standard_normal((3, 200))
    phases = 2.0 * np.pi * np.arange(1, 201)[:, None] * T / T[-1]
    smooth = (band @ np.sin(phases + 2.0 * np.pi * rng.uniform(size=(200, 1)))).T
    late = measure(SensorErrors(torque_delay=delay), replace(SMOOTH, tau=smooth), rng=rng).tau
    spectra = np.fft.rfft(late, axis=0) * np.conj(np.fft.rfft(smooth, axis=0))
    fine = np.fft.irfft(spectra.sum(axis=1), n=10 * T.size)  # the correlation, ten times finer than the samples
    lag = int(np.argmax(fine))
    lag = lag - 10 * T.size if lag > 5 * T.size else lag
    assert lag * STEP / 10 == pytest.approx(delay, abs=1.5e-4)


def test_torque_factors_scale_the_torque_and_are_drawn_once_for_a_robot() -> None:
    np.testing.assert_allclose(shown(torque_factor=[1.1, 0.9, 1.0]).tau, TAU * [1.1, 0.9, 1.0])
    rng = np.random.default_rng(5)
    drawn = [SensorErrors(torque_factor_spread=0.05).drawn(6, rng).torque_factor for _ in range(500)]
    assert np.log(drawn).std() == pytest.approx(0.05, rel=0.05)
    assert np.log(drawn).mean() == pytest.approx(0.0, abs=0.005)
    robots = SensorErrors(torque_factor_spread=0.05, torque_offset_spread=1.0).drawn(3, rng)
    logs = [measure(robots, SMOOTH, rng=rng).tau for _ in range(2)]
    np.testing.assert_array_equal(*logs)
    assert np.ptp(logs[0] - SMOOTH.tau) > 0.1


def test_jittered_samples_are_the_motion_at_other_instants_which_stamps_tell() -> None:
    log = seen(sampling_jitter=1e-4, velocity_noise=0.0)
    off = log.t - T
    assert off.std() == pytest.approx(1e-4, rel=0.02)
    assert np.abs(off).max() <= np.sqrt(3.0) * 1e-4
    assert np.diff(log.t).min() > 0.0
    np.testing.assert_allclose(log.q, np.sin(SPEED * log.t[:, None]), atol=1e-11)
    assert log.dq is not None
    np.testing.assert_allclose(log.dq, SPEED * np.cos(SPEED * log.t[:, None]), atol=1e-7)


def test_stamps_may_be_wrong_about_the_instants_or_count_ticks() -> None:
    wrong = seen(stamp_jitter=1e-4)
    np.testing.assert_array_equal(wrong.q, SMOOTH.q)
    assert (wrong.t - T).std() == pytest.approx(1e-4, rel=0.02)
    counted = seen(sampling_jitter=1e-4, stamps="ticks")
    np.testing.assert_array_equal(counted.t, T)
    # To first order the error of the position is the speed times how far the instant was off.
    assert (counted.q - SMOOTH.q).std(axis=0) == pytest.approx(1e-4 * np.sqrt(np.mean(SMOOTH.dq**2, axis=0)), rel=0.03)


@pytest.mark.parametrize(("share", "run"), [(0.01, 1.0), (0.05, 4.0), (0.3, 1.0)])
def test_lost_rows_are_missing_at_their_rate_and_in_runs_of_their_length(share: float, run: float) -> None:
    lost, runs = 0, []
    for seed in range(10):
        log = seen(seed, lost_samples=share, lost_run=run)
        np.testing.assert_array_equal(log.t, T[log.rows])
        np.testing.assert_array_equal(log.q, SMOOTH.q[log.rows])
        lost += T.size - log.rows.size
        gaps = np.diff(log.rows) - 1
        runs += gaps[gaps > 0].tolist()
    assert lost / (10 * T.size) == pytest.approx(share, rel=0.15)
    assert np.mean(runs) == pytest.approx(run, rel=0.1)


def test_scaled_sensors_are_that_much_worse_and_keep_their_clock() -> None:
    errors = {"encoder_step": 1e-3, "torque_noise": 0.2, "torque_offset": 0.4, "velocity_noise": 0.1}
    ripple = Ripple(amplitude=0.5, order=3.0)
    sensors = SensorErrors(**errors, torque_factor=1.2, ripples=(ripple,), torque_delay=2e-3, lost_samples=0.1)
    half = sensors.scaled(0.5)
    assert {name: float(getattr(half, name)) for name in errors} == {
        name: 0.5 * value for name, value in errors.items()
    }
    assert (float(half.torque_factor), float(half.ripples[0].amplitude)) == (pytest.approx(1.1), 0.25)
    assert (half.torque_delay, half.lost_samples) == (2e-3, 0.1)
    perfect = measure(replace(sensors.scaled(0.0), torque_delay=0.0, lost_samples=0.0), SMOOTH, rng=RNG)
    np.testing.assert_array_equal(perfect.q, SMOOTH.q)
    np.testing.assert_array_equal(perfect.tau, SMOOTH.tau)


@pytest.mark.parametrize("name", PRESETS)
def test_typical_sensors_show_a_motion_of_their_robot(name: str) -> None:
    robot = load_robot("ur5e")
    sensors = sensor_preset(name, robot)
    motion = replace(SMOOTH, **{key: np.repeat(getattr(SMOOTH, key), 2, axis=1) for key in ("q", "dq", "tau")})
    log = measure(sensors, motion, rng=np.random.default_rng(0))
    error = log.tau - motion.tau[log.rows]
    assert (error.std(axis=0) > np.asarray(sensors.torque_noise)).all()
    assert (error.std(axis=0) < 0.1 * robot.effort_limit).all()


def test_an_unknown_preset_is_answered_with_the_nearest_and_a_robot_without_torque_limits_refused() -> None:
    robot = load_robot("two_link")
    with pytest.raises(SimulationError, match="unknown sensors; got cobott; did you mean cobot"):
        sensor_preset("cobott", robot)
    free = tuple(replace(joint, limits=replace(joint.limits, effort=np.inf)) for joint in robot.joints)
    with pytest.raises(SimulationError, match="no largest torque"):
        sensor_preset("cobot", replace(robot, joints=free))


def test_jitter_that_could_turn_the_order_of_samples_round_is_refused() -> None:
    with pytest.raises(SimulationError, match=r"overtake each other; expected .* below 0.000289 s together"):
        seen(sampling_jitter=2e-4, stamp_jitter=1e-4)
    assert seen(sampling_jitter=2e-4, stamp_jitter=1e-4, stamps="ticks").t.size == T.size


@pytest.mark.parametrize(
    ("errors", "message"),
    [
        ({"encoder_step": -1.0}, "encoder_step is negative"),
        ({"torque_noise": np.nan}, "torque_noise"),
        ({"torque_offset": np.zeros((2, 2))}, "torque_offset"),
        ({"velocity_noise": np.array([0.1, -0.1])}, "velocity_noise is negative"),
        ({"velocity": "guessed"}, "velocity; expected measured or differenced"),
        ({"torque_factor": 0.0}, "torque_factor must be above zero"),
        ({"torque_noise": "loud"}, "torque_noise; expected numbers"),
        ({"torque_delay": np.zeros(2)}, "torque_delay; expected one number"),
        ({"lost_samples": 0.5}, "lost_samples; expected a share"),
        ({"lost_run": 0.5}, "lost_run; expected at least 1"),
    ],
)
def test_impossible_errors_are_refused(errors: dict[str, Any], message: str) -> None:
    with pytest.raises(SimulationError, match=message):
        SensorErrors(**errors)


def test_impossible_ripple_and_scale_are_refused() -> None:
    with pytest.raises(SimulationError, match="ripple, turns; expected joint or motor"):
        Ripple(amplitude=1.0, order=1.0, turns="wheel")  # type: ignore[arg-type]
    with pytest.raises(SimulationError, match=r"ripple\.amplitude is negative"):
        Ripple(amplitude=-1.0, order=1.0)
    with pytest.raises(SimulationError, match="phase is not drawn yet"):
        Ripple(amplitude=1.0, order=1.0, phase=None).torque(Q)
    with pytest.raises(SimulationError, match="scale of sensor errors"):
        SensorErrors().scaled(-1.0)


def test_errors_that_do_not_fit_the_robot_are_refused() -> None:
    with pytest.raises(SimulationError, match="does not fit the robot; expected 1 or 3 values, got 2"):
        shown(torque_noise=np.ones(2))
