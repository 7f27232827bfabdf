"""Information of a motion: criteria and their gradients against finite differences, scaling, choice of terms."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from tauhat.dynamics import Coulomb, Motion, torque_model
from tauhat.errors import ExcitationError
from tauhat.excitation.criteria import AOptimal, ConditionNumber, Criterion, DOptimal, EOptimal, Mixed
from tauhat.excitation.information import Information, information
from tauhat.robots import load_robot

CRITERIA = (ConditionNumber(), ConditionNumber(power=4.0), DOptimal(), AOptimal(), EOptimal(power=8.0), Mixed())


@lru_cache
def arm() -> Information:
    robot = load_robot("two_link")
    return information(torque_model(robot).with_term(Coulomb(widths=(0.2, 0.2))))


def motion(seed: int = 0, n_t: int = 90) -> Motion:
    q, dq, ddq = np.random.default_rng(seed).normal(size=(3, 2, n_t))
    return Motion(q=q, dq=dq, ddq=ddq)


def eigen(seed: int = 0) -> np.ndarray:
    return np.sort(np.random.default_rng(seed).uniform(0.01, 3.0, 9))


@pytest.mark.parametrize("criterion", CRITERIA, ids=str)
def test_gradient_of_a_criterion_with_respect_to_the_matrix_is_that_of_finite_differences(criterion: Criterion):
    rng = np.random.default_rng(1)
    root = rng.normal(size=(12, 6))
    matrix, direction = root.T @ root, rng.normal(size=(6, 6))
    direction = direction + direction.T
    _, gradient = criterion.evaluate(matrix)
    step = 1e-5
    ahead, behind = (criterion.evaluate(matrix + sign * step * direction)[0] for sign in (1, -1))
    assert (gradient * direction).sum() == pytest.approx((ahead - behind) / (2 * step), rel=1e-6)


@pytest.mark.parametrize("criterion", CRITERIA, ids=str)
def test_gradient_with_respect_to_the_motion_is_that_of_finite_differences(criterion: Criterion):
    start, rng = motion(), np.random.default_rng(2)
    _, gradient = arm().evaluate(start, criterion)
    direction = rng.normal(size=(3, 2, start.n_t))

    def value(step: float) -> float:
        moved = [part + step * d for part, d in zip((start.q, start.dq, start.ddq), direction, strict=True)]
        return criterion.evaluate(arm().matrix(Motion(q=moved[0], dq=moved[1], ddq=moved[2])))[0]

    step = 1e-4
    expected = (8 * (value(step) - value(-step)) - (value(2 * step) - value(-2 * step))) / (12 * step)
    found = sum((d * part).sum() for d, part in zip(direction, gradient, strict=True))
    assert found == pytest.approx(expected, rel=1e-6)


def test_smooth_condition_number_tends_to_the_condition_number_of_the_regressor():
    values = eigen()
    exact = 0.5 * np.log(values[-1] / values[0])
    gaps = [ConditionNumber(power=p).of_spectrum(values)[0] - exact for p in (4.0, 16.0, 64.0, 512.0)]
    assert all(gap >= -1e-12 for gap in gaps)
    assert gaps == sorted(gaps, reverse=True)
    assert gaps[-1] < 3e-3


def test_d_and_a_criteria_are_their_definitions():
    values = eigen()
    assert DOptimal().of_spectrum(values)[0] == pytest.approx(-np.log(np.prod(values)))
    assert AOptimal().of_spectrum(values)[0] == pytest.approx(np.log((1 / values).sum()))
    mixed, parts = Mixed(weight=0.5), ConditionNumber()
    expected = parts.of_spectrum(values)[0] - 0.5 / 9 * np.log(np.prod(values))
    assert mixed.of_spectrum(values)[0] == pytest.approx(expected)


def test_information_is_the_mean_of_the_scaled_columns_products():
    found, moves = arm(), motion(3)
    rows, _ = found.model.columns(moves, found.layout)
    dense = np.zeros((2, moves.n_t, found.model.n_p))
    for joint in range(2):
        part = found.layout.of_joint(joint)
        dense[joint][:, found.layout.parameters[part]] = rows[part].T
    stacked = dense.reshape(-1, found.model.n_p)[:, found.columns] / found.scales
    assert np.allclose(found.matrix(moves), stacked.T @ stacked / moves.n_t)


def test_a_motion_cannot_change_the_scales_and_noisier_joints_count_less():
    robot = load_robot("two_link")
    model = torque_model(robot, "inertia,viscous")
    plain, noisy = information(model), information(model, torque_noise=np.array([1.0, 10.0]))
    assert np.array_equal(plain.scales, noisy.scales)
    assert np.trace(noisy.matrix(motion())) < np.trace(plain.matrix(motion()))


def test_only_the_terms_asked_for_count():
    model = torque_model(load_robot("two_link"))
    friction = information(model, terms=["viscous", "coulomb"])
    assert {model.parameters[index].symbol for index in friction.columns} == {"Fv", "Fc"}
    with pytest.raises(ExcitationError, match="no column of the model"):
        information(torque_model(load_robot("two_link"), "inertia"), terms=["viscous"])
    with pytest.raises(ExcitationError, match="noise must be positive"):
        information(model, torque_noise=np.array([0.0, 1.0]))
