"""The barrier of the joint limits and the descent inside it: exact slopes, no step across, the optimum is found."""

from __future__ import annotations

import numpy as np
import pytest

from tauhat.excitation import ConditionNumber, DOptimal, EOptimal, FourierSpace, Mixed, motion_limits
from tauhat.excitation.barrier import Barrier, descend
from tauhat.excitation.gradient import schedule_of, sharpened
from tauhat.robots import load_robot


def box() -> Barrier:
    """Two joints whose three variables are limited to +-1 each."""
    return Barrier(rows=np.tile(np.eye(3), (2, 1, 1)), weight=1e-6)


def test_slope_of_the_barrier_is_that_of_finite_differences():
    where = FourierSpace(limits=motion_limits(load_robot("two_link")), period=5.0, harmonics=3)
    barrier, rng = Barrier(rows=where.grid(40).rows(), weight=0.3), np.random.default_rng(0)
    x, direction = rng.normal(size=(2, *where.shape))
    x *= 0.5 / where.gauge(x)[:, None]
    ahead, behind = (barrier.at(x + sign * 1e-6 * direction)[0] for sign in (1, -1))
    assert (barrier.at(x)[1] * direction).sum() == pytest.approx((ahead - behind) / 2e-6, rel=1e-6)


def test_the_longest_step_ends_on_a_limit():
    barrier, rng = box(), np.random.default_rng(1)
    x, step = 0.4 * rng.uniform(-1, 1, (2, 3)), rng.normal(size=(2, 3))
    assert np.abs(barrier.used(x + barrier.longest(x, step) * step)).max() == pytest.approx(1.0)
    assert barrier.longest(x, np.zeros((2, 3))) == np.inf


def test_descent_finds_the_optimum_on_the_limits_without_leaving_them():
    goal = np.array([[3.0, 0.2, -5.0], [0.0, -0.7, 1.5]])
    seen: list[float] = []

    def distance(x: np.ndarray) -> tuple[float, np.ndarray]:
        seen.append(float(np.abs(x).max()))
        return 0.5 * float(np.sum((x - goal) ** 2)), x - goal

    found, evaluations = descend(distance, box(), np.zeros((2, 3)), iterations=100)
    assert np.allclose(found, np.clip(goal, -1.0, 1.0), atol=1e-3)
    assert max(seen) < 1.0
    assert evaluations == len(seen)


def test_criteria_with_a_power_are_sharpened_in_steps_and_the_others_are_not():
    for criterion in (ConditionNumber(), EOptimal(), Mixed(weight=0.7)):
        assert sharpened(criterion, 4.0).power == 4.0  # type: ignore[attr-defined]
        assert len(schedule_of(criterion).barriers) == 3
    assert sharpened(Mixed(weight=0.7), 64.0) == Mixed(weight=0.7, power=64.0)
    assert sharpened(DOptimal(), 4.0) == DOptimal()
    assert len(schedule_of(DOptimal()).powers) == 1


def test_size_of_a_criterion_is_its_change_when_all_eigenvalues_grow_by_e():
    values = np.random.default_rng(2).uniform(0.1, 2.0, 7)
    change = DOptimal().of_spectrum(values)[0] - DOptimal().of_spectrum(np.e * values)[0]
    assert DOptimal().size(7) == pytest.approx(change)
