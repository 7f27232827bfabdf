"""Sensor errors have the statistics they are given."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tauhat.errors import SimulationError
from tauhat.simulation import SensorErrors, measure

RNG = np.random.default_rng(0)
Q, DQ, TAU = RNG.standard_normal((3, 20_000, 3)) * np.array([1.0, 2.0, 30.0])


def shown(seed: int = 1, **errors: Any) -> Any:
    return measure(SensorErrors(**errors), Q, DQ, tau=TAU, rng=np.random.default_rng(seed))


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
    np.testing.assert_array_equal(shown(velocity_noise=0.0).dq, DQ)
    np.testing.assert_allclose((shown(velocity_noise=0.2).dq - DQ).std(axis=0), 0.2, rtol=0.03)


def test_same_seed_shows_the_same_and_another_seed_does_not() -> None:
    np.testing.assert_array_equal(shown(3, torque_noise=1.0).tau, shown(3, torque_noise=1.0).tau)
    assert not np.array_equal(shown(3, torque_noise=1.0).tau, shown(4, torque_noise=1.0).tau)


@pytest.mark.parametrize(
    ("errors", "message"),
    [
        ({"encoder_step": -1.0}, "encoder_step is negative"),
        ({"torque_noise": np.nan}, "torque_noise"),
        ({"torque_offset": np.zeros((2, 2))}, "torque_offset"),
        ({"velocity_noise": np.array([0.1, -0.1])}, "velocity_noise is negative"),
    ],
)
def test_impossible_errors_are_refused(errors: dict[str, Any], message: str) -> None:
    with pytest.raises(SimulationError, match=message):
        SensorErrors(**errors)


def test_errors_that_do_not_fit_the_robot_are_refused() -> None:
    with pytest.raises(SimulationError, match="does not fit the robot; expected 1 or 3 values, got 2"):
        shown(torque_noise=np.ones(2))
