"""Steady friction is what the law says it is, with the error bar of its parts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rough_arms import rough_truth

from sample_arms import chain, planar_truth
from tauhat.dynamics import TorqueModel, base_parameters, inverse_dynamics, torque_model
from tauhat.dynamics.terms import (
    Asymmetric,
    Coulomb,
    Coupling,
    Dahl,
    Inertia,
    LoadDahl,
    PolynomialFriction,
    Stribeck,
    Viscous,
)
from tauhat.estimation import identify
from tauhat.estimation.friction import steady_friction
from tauhat.recordings.processing import Processing

SPEEDS = np.array([0.4, 1.5])


def steady(truth, speeds: np.ndarray = SPEEDS) -> np.ndarray:
    base = base_parameters(truth.model)
    values = base.projection @ truth.standard
    return steady_friction(truth.model, base, values, np.zeros((base.n_b, base.n_b)), speeds).torque


@pytest.mark.parametrize(
    ("terms", "keys", "values", "expected"),
    [
        ((), "inertia,viscous", {"Fv": 2.0}, 2.0 * SPEEDS),
        ((), "inertia,cube-root", {"Fr": 2.0}, 2.0 * np.cbrt(SPEEDS)),
        ((Coulomb(widths=(0.4, 0.4)),), "inertia", {"Fc": 3.0}, 3.0 * np.tanh(SPEEDS / 0.4)),
        ((), "inertia,viscous,viscous-asymmetry", {"Fv": 2.0, "Fva": 0.7}, 2.0 * SPEEDS),
        (
            (Asymmetric(widths=(1e-3, 1e-3)),),
            "inertia",
            {"Fv+": 2.0, "Fv-": 1.0, "Fc+": 3.0, "Fc-": 4.0},
            1.5 * SPEEDS + 3.5,
        ),
        (
            (Stribeck(speeds=(0.5, 0.5)),),
            "inertia",
            {"Fs": 2.0},
            2.0 * np.exp(-((SPEEDS / 0.5) ** 2)) * np.tanh(SPEEDS / 0.05),
        ),
        (
            (PolynomialFriction(speeds=(0.5, 0.5)),),
            "inertia",
            {"k0": 1.0, "k1": 0.5, "k2": -0.1, "k3": 0.02, "k4": 2.0},
            np.tanh(SPEEDS / 0.05) * (1.0 + 2.0 * np.exp(-SPEEDS / 0.5))
            + 0.5 * SPEEDS
            - 0.1 * SPEEDS**2
            + 0.02 * SPEEDS**3,
        ),
        ((Dahl(scales=(5.0, 0.1)),), "inertia", {"Fd": 1.0, "Fe": 2.5}, np.full(2, 3.5)),
        ((), "inertia,offset,spring", {"To": 4.0, "Ks": 5.0}, np.zeros(2)),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_steady_friction_is_the_laws_own(terms, keys: str, values: dict[str, float], expected: np.ndarray) -> None:
    assert np.allclose(steady(rough_truth(*terms, keys=keys, **values)), expected, rtol=0, atol=1e-9)


def test_load_friction_counts_with_the_load_at_zero() -> None:
    truth = rough_truth(LoadDahl(), keys="inertia", Fl=(0.1, 0.2))
    still = np.zeros((1, 2))
    load = np.abs(inverse_dynamics(truth.model.robot, still, still, still))[0]
    assert np.allclose(steady(truth), np.array([0.1, 0.2]) * load, rtol=0, atol=1e-9)


def test_a_joint_is_braked_by_a_shared_motor_as_if_it_moved_alone() -> None:
    robot = chain(np.random.default_rng(0), "RR")
    term = Coupling(motors=((1, 0, 2.0),), widths=(1e-3,))
    model = TorqueModel(robot=robot, terms=(Inertia(), Viscous(), term))
    standard = np.concatenate([robot.inertia.ravel(), [0.5, 0.4], [0.1, 0.3, 7.0]])  # Fv, then Iam Fvm Fsm
    base = base_parameters(model)
    found = steady_friction(model, base, base.projection @ standard, np.zeros((base.n_b, base.n_b)), SPEEDS).torque
    assert np.allclose(found, [0.5 * SPEEDS[0] + 2.0 * 7.0, 0.4 * SPEEDS[1] + 7.0], rtol=0, atol=1e-9)


def test_its_error_bar_is_that_of_the_sum_with_its_correlations() -> None:
    truth = planar_truth()
    noise = np.random.default_rng(0).normal(size=(4000, 2))
    estimate = identify(
        truth.model, [truth.recording(noise=noise)], processing=Processing(cutoff=10.0, motion_cutoff=30.0)
    )
    names = [estimate.base.names[index] for index in estimate.base.independent]
    widths = next(term.widths for term in estimate.model.terms if isinstance(term, Coulomb))
    friction = estimate.friction(SPEEDS)
    for joint in range(2):
        weights = np.zeros(len(names))
        weights[names.index(f"Fv_{joint + 1}")] = SPEEDS[joint]
        weights[names.index(f"Fc_{joint + 1}")] = np.tanh(SPEEDS[joint] / widths[joint])
        assert friction.torque[joint] == pytest.approx(weights @ estimate.values)
        assert friction.standard_errors[joint] == pytest.approx(np.sqrt(weights @ estimate.covariance @ weights))


def test_friction_that_drives_is_negative_and_none_is_zero() -> None:
    truth = rough_truth(keys="inertia,viscous", Fv=-1.0)
    assert (steady(truth) < 0.0).all()
    rigid = rough_truth(keys="inertia")
    assert np.array_equal(steady(rigid), np.zeros(2))


def test_a_joint_with_the_term_left_out_has_no_friction_of_it() -> None:
    truth = rough_truth(Viscous(joints=(False, True)), keys="inertia", Fv=2.0)
    assert steady(truth).tolist() == [0.0, 2.0 * SPEEDS[1]]
    bare = replace(truth.model, terms=torque_model(truth.model.robot, "inertia").terms)
    assert base_parameters(bare).n_b < base_parameters(truth.model).n_b
