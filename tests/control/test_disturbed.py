"""Noise on what a controller sees, and the end of a run whose robot is lost."""

from __future__ import annotations

import numpy as np
import pytest

from tauhat.control import PD, ControlSample, NoisySight, TrackingController, Watched, noisy_sight
from tauhat.errors import ArrayError, SimulationError

INNER = TrackingController(law=PD(kp=[10.0, 20.0], kd=[1.0, 2.0], torque_limit=[np.inf, 300.0]))


def sample_at(q, *, t=0.0):
    still = np.zeros(2)
    return ControlSample(t, 1e-3, np.asarray(q, dtype=float), still, still, still, still, still, still)


def test_noise_is_added_to_what_is_seen_row_by_row_and_repeats():
    position, speed = np.array([[0.1, 0.0], [0.0, -0.2]]), np.array([[0.0, 1.0], [0.5, 0.0]])
    sees = NoisySight(inner=INNER, position=position, speed=speed)
    memory, torques = sees.start(sample_at([0.0, 0.0])), []
    for _ in range(3):
        memory, torque = sees.step(memory, sample_at([0.0, 0.0]))
        torques.append(torque)
    np.testing.assert_allclose(torques, [[-1.0, -2.0], [-0.5, 4.0], [-1.0, -2.0]])
    assert sees.feedforward == INNER.feedforward
    np.testing.assert_array_equal(sees.torque_limit, [np.inf, 300.0])


def test_white_noise_has_its_deviations_and_the_same_seed_the_same_noise():
    sizes = (np.array([1e-3, 2e-3]), np.array([0.1, 0.0]))
    first, second = (noisy_sight(INNER, np.random.default_rng(3), rows=20_000, deviations=sizes) for _ in range(2))
    np.testing.assert_array_equal(first.position, second.position)
    np.testing.assert_allclose(first.position.std(axis=0), sizes[0], rtol=0.03)
    np.testing.assert_allclose(first.speed.std(axis=0), sizes[1], rtol=0.03)


def test_a_watched_controller_gives_up_beyond_its_distance_and_only_there():
    watched = Watched(inner=INNER, farthest=[0.5, 0.1])
    shown = sample_at([0.5, -0.1], t=0.25)
    memory, torque = watched.step(watched.start(shown), shown)
    np.testing.assert_allclose(torque, INNER.step(memory.inner, shown)[1])
    with pytest.raises(SimulationError, match=r"joint 2, t = 0.25 s: the robot is lost; expected within 0.1 of"):
        watched.step(memory, sample_at([0.5, 0.11], t=0.25))
    with pytest.raises(SimulationError, match="joint 1, t = 0 s: the robot is lost"):
        watched.step(memory, sample_at([np.nan, 0.0]))
    assert watched.feedforward == INNER.feedforward
    np.testing.assert_array_equal(watched.torque_limit, INNER.torque_limit)


def swung(watched, every):
    """Step 200 times with an error that changes its sign every so many steps; return the steps that went well."""
    memory = watched.start(sample_at([0.0, 0.0]))
    for k in range(200):
        try:
            memory, _ = watched.step(memory, sample_at([0.0, 1.0 if k // every % 2 else -1.0]))
        except SimulationError as error:
            return k, str(error)
    return 200, ""


def test_a_torque_that_swings_between_its_limits_is_rattling_and_a_rare_jump_is_not():
    law = PD(kp=[10.0, 2000.0], kd=[1.0, 2.0], torque_limit=[np.inf, 300.0])
    watched = Watched(inner=TrackingController(law=law), farthest=[2.0, 2.0])
    steps, message = swung(watched, 4)
    assert 20 <= steps < 60  # more than five jumps, and those fade
    assert "joint 2" in message
    assert "the robot rattles; expected jumps in less than 10 % of the steps" in message
    assert swung(watched, 25) == (200, "")


def test_no_noise_and_no_distance_are_refused():
    with pytest.raises(ArrayError, match="noisy sight: position is empty"):
        NoisySight(inner=INNER, position=np.zeros((0, 2)), speed=np.zeros((0, 2)))
    with pytest.raises(ArrayError, match="watched controller: farthest is not positive; got 0"):
        Watched(inner=INNER, farthest=[1.0, 0.0])
