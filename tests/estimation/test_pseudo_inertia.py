"""The pseudo-inertia and its log-Cholesky form are Pinocchio's, and positive exactly for bodies that can exist."""

from __future__ import annotations

import numpy as np
import pinocchio
import pytest

from sample_arms import random_inertia
from tauhat.estimation.log_cholesky import log_cholesky_of, shape_of
from tauhat.estimation.pseudo_inertia import (
    inertial_parameters,
    margins,
    pseudo_inertia,
    pushed_inside,
    stacked,
    unstacked,
)

SEEDS = range(5)


@pytest.mark.parametrize("seed", SEEDS)
def test_pseudo_inertia_is_pinocchios(seed):
    parameters = random_inertia(np.random.default_rng(seed))
    theirs = pinocchio.Inertia.FromDynamicParameters(parameters).toPseudoInertia().toMatrix()
    assert np.allclose(pseudo_inertia(parameters), theirs, rtol=0, atol=1e-14)


def test_pseudo_inertia_of_point_masses_is_their_sum_of_squares():
    rng = np.random.default_rng(0)
    points, masses = rng.normal(size=(7, 3)), rng.uniform(0.1, 1.0, 7)
    homogeneous = np.column_stack([points, np.ones(7)])
    inertia = sum(m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, points, strict=True))
    moments = inertia[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]
    parameters = np.concatenate([[masses.sum()], masses @ points, moments])
    assert np.allclose(pseudo_inertia(parameters), homogeneous.T @ np.diag(masses) @ homogeneous)


def test_parameters_come_back_from_their_pseudo_inertia():
    parameters = np.random.default_rng(1).normal(size=(3, 4, 10))
    assert np.allclose(inertial_parameters(pseudo_inertia(parameters)), parameters)


def test_stacks_keep_dot_products_and_come_back():
    first, second = (pseudo_inertia(part) for part in np.random.default_rng(2).normal(size=(2, 10)))
    assert stacked(first) @ stacked(second) == pytest.approx(np.trace(first @ second))
    assert np.allclose(unstacked(stacked(first)), first)


def test_margin_is_negative_where_one_moment_exceeds_the_sum_of_the_others():
    possible = np.array([2.0, 0, 0, 0, 0.02, 0, 0.02, 0, 0, 0.03])
    impossible = np.array([2.0, 0, 0, 0, 0.02, 0, 0.02, 0, 0, 0.05])
    assert margins(possible) == pytest.approx(0.005 / 2.035)  # second moments 0.015, 0.015, 0.005
    assert margins(impossible) < 0


def test_pushing_inside_reaches_the_margin_and_leaves_others_alone():
    flat = np.array([2.0, 0, 0, 0, 0.02, 0, 0.02, 0, 0, 0.04])
    round_ = np.array([2.0, 0, 0, 0, 0.02, 0, 0.02, 0, 0, 0.02])
    pushed = pushed_inside(np.stack([flat, round_]), 1e-4)
    assert margins(pushed[0]) == pytest.approx(1e-4, rel=1e-9)
    assert np.array_equal(pushed[1], round_)


@pytest.mark.parametrize("seed", SEEDS)
def test_log_cholesky_parameters_are_pinocchios(seed):
    free = 0.5 * np.random.default_rng(seed).normal(size=10)
    theirs = pinocchio.LogCholeskyParameters(free).toPseudoInertia().toMatrix()
    assert np.allclose(shape_of(free), theirs, rtol=0, atol=1e-13)
    assert np.allclose(log_cholesky_of(shape_of(free)), free)
