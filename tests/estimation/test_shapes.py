"""Shapes come back, joint by joint, from torque that they made."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rough_arms import SETTINGS, rough_truth, slow_and_fast

from tauhat.dynamics import base_parameters, torque_model
from tauhat.dynamics.terms import Coulomb, Dahl, PolynomialFriction, ShapedTerm, Stribeck
from tauhat.estimation import identify
from tauhat.estimation.evidence import collect_all, gathering
from tauhat.estimation.least_squares import WeightedLeastSquares
from tauhat.estimation.shapes import chosen_form
from tauhat.estimation.solution import joint_residuals
from tauhat.estimation.tuning import tuned

DRY = {"Fv": 0.6, "Fc": (1.5, 0.8)}
CASES = {
    "stribeck speed": (Stribeck(speeds=(0.25, 0.06)), "inertia,viscous,coulomb", {**DRY, "Fs": (1.2, 0.9)}),
    "width of the smooth sign": (Coulomb(widths=(0.12, 0.02)), "inertia,viscous", DRY),
    "scale of pre-sliding": (Dahl(scales=(2.5, 0.4)), "inertia,viscous", {"Fv": 0.6, "Fd": 1.0, "Fe": (0.8, 0.9)}),
    "speed of the polynomial": (
        PolynomialFriction(speeds=(0.5, 0.15)), "inertia", {"k0": 1.0, "k1": 0.5, "k2": -0.05, "k4": (1.0, 0.8)},
    ),
}  # fmt: skip


def recovered(term: ShapedTerm, keys: str, values: dict, *, seed: int, noise: float) -> np.ndarray:
    truth = rough_truth(term, keys=keys, **values)
    blank = type(term)()
    model = truth.model.with_term(blank)
    recordings = [
        slow_and_fast(truth, seed=seed, noise=noise),
        slow_and_fast(truth, seed=seed + 50, noise=noise, part=0.2),
    ]
    settled, _ = tuned(model, recordings, processing=SETTINGS)
    return np.array(next(own for own in settled.terms if own.key == term.key).shape)


@pytest.mark.parametrize("seed", [0, 2, 6, 9])
@pytest.mark.parametrize("case", CASES)
def test_each_joints_own_shape_comes_back(case: str, seed: int) -> None:
    term, keys, values = CASES[case]
    found = recovered(term, keys, values, seed=seed, noise=0.02)
    assert np.abs(np.log(found / np.array(term.shape))).max() < np.log(1.35)


def test_without_noise_a_shape_on_the_grid_is_found_exactly() -> None:
    forms = [Stribeck(speeds=(speed, 3 * speed)) for speed in (0.02, 0.05, 0.1)]
    truth = rough_truth(forms[1], keys="inertia,viscous,coulomb", **DRY, Fs=1.0)
    base = base_parameters(truth.model)
    chosen = chosen_form(truth.model, base, forms, gathering([slow_and_fast(truth, seed=3)], SETTINGS))
    assert chosen.shape == pytest.approx((0.05, 0.15))


def test_joints_may_take_different_forms_of_the_grid() -> None:
    truth = rough_truth(Dahl(scales=(1.0, 3.0)), keys="inertia,viscous", Fv=0.6, Fd=1.0, Fe=1.0)
    base = base_parameters(truth.model)
    forms = [Dahl(scales=(scale, scale)) for scale in (0.3, 1.0, 3.0)]
    chosen = chosen_form(truth.model, base, forms, gathering([slow_and_fast(truth, seed=4)], SETTINGS))
    assert chosen.shape == pytest.approx((1.0, 3.0))


def test_a_closer_look_never_leaves_more_residual_than_the_grid() -> None:
    truth = rough_truth(Stribeck(speeds=(0.13, 0.05)), keys="inertia,viscous,coulomb", **DRY, Fs=1.0)
    recording = slow_and_fast(truth, seed=5, noise=0.05)
    base = base_parameters(truth.model)

    def level(term: Stribeck) -> float:
        model = truth.model.with_term(term)
        evidence = collect_all(model, base, [recording], SETTINGS)
        residuals = joint_residuals(evidence, WeightedLeastSquares(power=1.0).solve(evidence).values)
        return float(np.log(residuals).mean())

    forms = [Stribeck(speeds=(speed, speed)) for speed in (0.02, 0.08, 0.3)]
    best = chosen_form(truth.model, base, forms, gathering([recording], SETTINGS))
    assert isinstance(best, Stribeck)
    assert level(best) < min(level(form) for form in forms) + 1e-3


def test_a_joint_without_the_term_does_not_disturb_the_others_choice() -> None:
    term = Stribeck(speeds=(0.2, 0.2), joints=(True, False))
    truth = rough_truth(term, keys="inertia,viscous,coulomb", **DRY, Fs=1.2)
    model = truth.model.with_term(Stribeck(joints=(True, False)))
    settled, _ = tuned(model, [slow_and_fast(truth, seed=6, noise=0.02)], processing=SETTINGS)
    (found,) = (own for own in settled.terms if isinstance(own, Stribeck))
    assert found.shape[0] == pytest.approx(0.2, rel=0.3)
    assert found.joints == (True, False)


def test_a_joint_that_stands_still_takes_what_the_others_take() -> None:
    truth = rough_truth(Coulomb(widths=(0.05, 0.05)), keys="inertia,viscous", **DRY)
    run = slow_and_fast(truth, seed=2, noise=0.02)
    q = run.q.copy()
    q[:, 1] = 0.3 + 1e-7 * np.random.default_rng(0).normal(size=q.shape[0])
    settled, _ = tuned(torque_model(truth.model.robot), [replace(run, q=q)], processing=SETTINGS)
    (found,) = (own for own in settled.terms if isinstance(own, Coulomb))
    assert np.isfinite(found.widths).all()


def test_given_shapes_are_kept_to_the_end() -> None:
    truth = rough_truth(Coulomb(widths=(0.05, 0.05)), keys="inertia,viscous", **DRY)
    given = truth.model.with_term(Coulomb(widths=(0.011, 0.013)))
    estimate = identify(given, [slow_and_fast(truth, seed=2)], processing=SETTINGS)
    assert next(own for own in estimate.model.terms if isinstance(own, Coulomb)).widths == (0.011, 0.013)
