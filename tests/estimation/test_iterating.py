"""Load friction is found without the description's masses, and stays only where it brakes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rough_arms import SETTINGS, rough_truth, slow_and_fast, without_masses

from tauhat.dynamics import TorqueModel, base_parameters, torque_model
from tauhat.dynamics.terms import Coulomb, LoadCoulomb, LoadDahl, Viscous
from tauhat.estimation import OrdinaryLeastSquares, WeightedLeastSquares, identify
from tauhat.estimation.evidence import collect_all
from tauhat.estimation.iterating import first_loaded, iterated
from tauhat.estimation.rotor_load import rigid_parameters

WIDTHS = (0.05, 0.05)
DRY = {"Fv": 0.5, "Fc": (0.8, 0.5)}


def loaded_truth(load: tuple[float, float], term: LoadCoulomb | LoadDahl | None = None):
    return rough_truth(
        Coulomb(widths=WIDTHS), term or LoadCoulomb(widths=WIDTHS), keys="inertia,viscous", **DRY, Fl=load
    )


def blank(model: TorqueModel) -> TorqueModel:
    """Return the model whose load terms know no masses, of a robot whose description tells none either."""
    return without_masses(model)


def coefficients(estimate) -> dict[str, float]:
    return {row.name: row.value for row in estimate.summary() if row.name.startswith("Fl")}


@pytest.mark.parametrize("term", [LoadCoulomb(widths=WIDTHS), LoadDahl()], ids=lambda term: term.key)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_load_friction_comes_back_though_the_description_tells_no_masses(
    seed: int, term: LoadCoulomb | LoadDahl
) -> None:
    truth = loaded_truth((0.15, 0.25), term)
    recordings = [slow_and_fast(truth, seed=seed, noise=0.02), slow_and_fast(truth, seed=seed + 20, noise=0.02)]
    estimate = identify(blank(truth.model), recordings, processing=SETTINGS)
    found = coefficients(estimate)
    assert found["Fl_1"] == pytest.approx(0.15, abs=0.01)
    assert found["Fl_2"] == pytest.approx(0.25, abs=0.02)


def test_the_load_is_that_of_the_masses_that_were_found_not_of_the_description() -> None:
    truth = loaded_truth((0.15, 0.25))
    heavy = replace(
        truth.model.robot,
        joints=tuple(replace(joint, inertia=5.0 * joint.inertia) for joint in truth.model.robot.joints),
    )
    estimate = identify(replace(truth.model, robot=heavy), [slow_and_fast(truth, seed=3)], processing=SETTINGS)
    assert coefficients(estimate) == pytest.approx({"Fl_1": 0.15, "Fl_2": 0.25}, abs=0.01)


def test_a_joint_whose_load_friction_would_drive_it_loses_it_and_keeps_the_others() -> None:
    truth = loaded_truth((-0.1, 0.25))
    estimate = identify(blank(truth.model), [slow_and_fast(truth, seed=4, noise=0.02)], processing=SETTINGS)
    assert set(coefficients(estimate)) == {"Fl_2"}
    term = next(own for own in estimate.model.terms if own.key == "load-coulomb")
    assert term.joints == (False, True)


@pytest.mark.parametrize("seed", range(6))
def test_no_load_friction_that_is_left_drives_its_joint(seed: int) -> None:
    rng = np.random.default_rng(seed)
    truth = loaded_truth((0.0, 0.0))
    recording = slow_and_fast(truth, seed=seed, noise=0.5)
    recording = replace(recording, tau=recording.tau + 0.3 * rng.normal(size=2) * np.abs(recording.q))
    model = iterated(blank(truth.model), [recording], SETTINGS, WeightedLeastSquares())
    base = base_parameters(model)
    values = WeightedLeastSquares().solve(collect_all(model, base, [recording], SETTINGS)).values
    names = [base.names[index] for index in base.independent]
    assert all(value > -0.01 for name, value in zip(names, values, strict=True) if name.startswith("Fl"))


def test_a_model_without_load_friction_stays_as_it_is() -> None:
    truth = rough_truth(keys="inertia,viscous,coulomb", **DRY)
    recordings = [slow_and_fast(truth, seed=0, seconds=4.0)]
    for method in (OrdinaryLeastSquares(), WeightedLeastSquares()):
        assert iterated(truth.model, recordings, SETTINGS, method) is truth.model
        assert first_loaded(truth.model, recordings, SETTINGS, method) is truth.model


def test_a_model_without_rigid_bodies_keeps_the_load_of_the_description() -> None:
    truth = loaded_truth((0.2, 0.2))
    model = TorqueModel(robot=truth.model.robot, terms=(Viscous(), LoadCoulomb(widths=WIDTHS)))
    recordings = [slow_and_fast(truth, seed=0, seconds=4.0)]
    for made in (first_loaded, iterated):
        term = made(model, recordings, SETTINGS, WeightedLeastSquares()).terms[-1]
        assert term.inertia == ()


def test_rigid_parameters_are_picked_by_name() -> None:
    model = torque_model(loaded_truth((0.0, 0.0)).model.robot, "viscous,inertia")
    standard = np.arange(float(model.n_p))
    assert np.array_equal(rigid_parameters(model, standard), (2.0 + np.arange(20.0)).reshape(2, 10))
