"""Limits of several joints hold between the samples too: by Pinocchio and coal on a grid ten times finer."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from limit_benchmark import NO_EXCESS, Oracle, arm
from scipy.optimize import brentq

from tauhat.arrays import FloatArray
from tauhat.excitation import parse_limits, random_points
from tauhat.excitation.guard import FINER, Guard, lowest_between
from tauhat.excitation.poses import guard_of, motion_space

SAMPLES = 200
MARGIN = 0.05


@pytest.mark.parametrize("harmonics", [3, 10, 40])
def test_the_bound_is_below_every_trigonometric_polynomial_and_close_to_it(harmonics: int) -> None:
    rng, k = np.random.default_rng(harmonics), np.arange(1, harmonics + 1)
    weights = rng.normal(size=(2, 30, harmonics)) / k
    angle = 2.0 * np.pi * np.arange(20 * 2000) / (20 * 2000) + rng.uniform(0.0, 1e-3)
    finer = weights[0] @ np.sin(np.outer(k, angle)) + weights[1] @ np.cos(np.outer(k, angle))
    bound = lowest_between(finer[:, ::20])
    ends = np.roll(finer[:, ::20], -1, axis=1)
    true = np.minimum(finer.reshape(30, 2000, 20).min(axis=2), ends)
    assert (bound <= true + 1e-12).all()
    assert (true - bound).max() < 3e-6 * harmonics**2 * np.abs(finer).max()


def test_kinks_that_point_up_need_nothing_and_constants_lose_nothing() -> None:
    t = np.linspace(0.0, 2.0 * np.pi, 500, endpoint=False)
    rows = np.array([0.3 - np.abs(np.sin(t)), np.full(500, 0.25)])
    assert lowest_between(rows)[0].min() >= rows[0].min() - 1e-4
    np.testing.assert_allclose(lowest_between(rows)[1], 0.25, atol=1e-15)


FAST = "[joints]\nvelocity = 6\nacceleration = 60\n"
LIMITS = {
    "torque": "[torque]\nlargest = [5, 14, 5]",
    "tool box": "[tool]\nlower = [-0.5, -0.4, 0.1]\nupper = [0.6, 0.5, 0.7]",
    "tool speed": "[tool]\nspeed = 0.5",
    "plane": "[[planes]]\nnormal = [-1, 0.1, 0.2]\noffset = -0.3",
    "box": "[[boxes]]\nsize = [0.3, 0.6, 0.4]\nxyz = [-0.4, 0.2, 0.4]\nrpy = [0.3, 0.5, 0]",
    "self-collision": "[collision]\nclearance = 0.01",
}


def guarded(text: str, seed: int) -> tuple[Oracle, Guard, FloatArray]:
    """The three-joint arm of the benchmark with its own geometry, and a random motion from a feasible pose."""
    rng, robot = np.random.default_rng(seed), arm(0)
    limits = parse_limits(FAST + text, robot)
    space = motion_space(limits, margin=MARGIN, period=5.0, harmonics=5)
    guard = guard_of(space, limits, margin=MARGIN, samples=SAMPLES, rng=rng)
    return Oracle(limits, margin=MARGIN), guard, random_points(space, 1, rng)[0]


def longest(guard: Guard, x: FloatArray, left: Callable[[FloatArray], float]) -> FloatArray:
    """The point shrunk towards the first pose until just nothing is left of a limit."""
    rest = guard.space.resting(guard.poses[0])
    scale = brentq(lambda part: left(rest + part * (x - rest)), 0.0, 1.0, xtol=1e-9)
    return rest + (scale - 2e-9) * (x - rest)


@pytest.mark.parametrize("text", LIMITS.values(), ids=LIMITS.keys())
def test_motions_that_just_keep_a_limit_do_not_exceed_it_between_the_samples(text: str) -> None:
    bounded, sampled = [], []
    for seed in range(6):
        oracle, guard, x = guarded(text, seed)
        if guard.worst(x[None], FINER * SAMPLES)[0] > 0.0:
            continue
        on_samples = longest(guard, x, lambda point, guard=guard: guard.worst(point[None], FINER * SAMPLES)[0])
        everywhere = longest(guard, x, lambda point, guard=guard: min(guard._lowest(point)))
        sampled.append(min(oracle.worst(guard.space.series(on_samples)).values()))
        bounded.append(min(oracle.worst(guard.space.series(everywhere)).values()))
    assert len(bounded) > 0
    assert min(bounded) >= NO_EXCESS
    assert max(bounded) < 3e-4, "the bound costs little"
    assert min(sampled) < -1e-8, "on its samples alone the limit is exceeded: this test can fail"
