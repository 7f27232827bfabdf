"""A rotor that is regrouped into a link is no load on the gear, and the friction of the load tells it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rough_arms import SETTINGS, rough_truth, slow_and_fast

from sample_arms import Truth
from tauhat.dynamics import Motion, TorqueModel, base_parameters, torque_model
from tauhat.dynamics.terms import Coulomb, LoadCoulomb, LoadDahl, RotorInertia
from tauhat.estimation import WeightedLeastSquares, identify
from tauhat.estimation.iterating import iterated
from tauhat.estimation.loaded_run import loaded_model
from tauhat.estimation.rotor_load import hidden_rotors, load_term, rigid_parameters, rotor_load, standard_with_rotors

WIDTHS = (0.05, 0.05)
ROTORS = (0.6, 0.1)
LOADS = (0.15, 0.25)
TERMS = [LoadCoulomb(widths=WIDTHS), LoadDahl()]


def driven_truth(term: LoadCoulomb | LoadDahl = TERMS[0], rotors: tuple[float, float] = ROTORS) -> Truth:
    """Return the planar arm whose first rotor is regrouped into its link; its gears feel the links alone."""
    dry = {"Fv": 0.5, "Fc": (0.8, 0.5)}
    return rough_truth(Coulomb(widths=WIDTHS), term, keys="inertia,rotor,viscous", **dry, Ia=rotors, Fl=LOADS)


def found(model: TorqueModel, values: np.ndarray, symbol: str) -> dict[str, float]:
    base = base_parameters(model)
    names = [base.names[index] for index in base.independent]
    return {name: value for name, value in zip(names, values, strict=True) if name.startswith(symbol)}


@pytest.mark.parametrize("term", TERMS, ids=lambda term: term.key)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_load_friction_does_not_count_the_rotor_of_the_first_joint(seed: int, term: LoadCoulomb | LoadDahl) -> None:
    truth = driven_truth(term)
    estimate = identify(truth.model, [slow_and_fast(truth, seed=seed, noise=0.02)], processing=SETTINGS)
    ratios = found(estimate.model, estimate.values, "Fl")
    assert ratios["Fl_1"] == pytest.approx(LOADS[0], rel=0.03)
    assert ratios["Fl_2"] == pytest.approx(LOADS[1], rel=0.03)
    assert load_term(estimate.model).rotors == pytest.approx((ROTORS[0], 0.0), rel=0.15)


def test_true_parameters_are_in_their_intervals_as_often_as_these_say() -> None:
    inside = []
    for seed in range(12):
        truth = driven_truth()
        estimate = identify(truth.model, [slow_and_fast(truth, seed=seed, noise=0.1)], processing=SETTINGS)
        error = estimate.values - estimate.base.projection @ truth.standard
        names = [estimate.base.names[index] for index in estimate.base.independent]
        inside.append((np.abs(error) <= estimate.half_intervals())[names.index("Fl_1")])
    assert sum(inside) >= 10


def test_without_a_rotor_none_is_taken_off() -> None:
    truth = driven_truth(rotors=(0.0, 0.1))
    estimate = identify(truth.model, [slow_and_fast(truth, seed=3, noise=0.02)], processing=SETTINGS)
    assert sum(load_term(estimate.model).rotors) < 0.03
    assert found(estimate.model, estimate.values, "Fl") == pytest.approx({"Fl_1": 0.15, "Fl_2": 0.25}, rel=0.03)


def test_error_bars_know_that_the_rotor_was_found_on_the_same_recordings() -> None:
    truth = driven_truth()
    recordings = [slow_and_fast(truth, seed=4, noise=0.2)]
    free = identify(truth.model, recordings, processing=SETTINGS)
    alone = replace(truth.model, terms=tuple(t for t in truth.model.terms if not isinstance(t, RotorInertia)))
    assert rotor_load(free.model, free.base, free.values) is not None
    assert rotor_load(alone, base_parameters(alone), np.ones(base_parameters(alone).n_b)) is None
    ratio = [free.base.names[index] for index in free.base.independent].index("Fl_1")
    known = WeightedLeastSquares().fit(_evidence(free, recordings))
    assert free.standard_errors[ratio] > 1.05 * np.sqrt(known.covariance[ratio, ratio])


def _evidence(estimate, recordings):
    from tauhat.estimation.evidence import collect_all

    return collect_all(estimate.model, estimate.base, recordings, estimate.processing)


def test_its_slope_is_the_change_of_friction_with_the_rotor() -> None:
    truth = driven_truth()
    model = iterated(truth.model, [slow_and_fast(truth, seed=0, seconds=6.0)], SETTINGS, WeightedLeastSquares())
    base = base_parameters(model)
    values = base.projection @ truth.standard
    slope, (rotor,) = rotor_load(model, base, values), hidden_rotors(model, base, values)
    assert (rotor.joint, slope.joints) == (0, (0,))
    rng = np.random.default_rng(5)
    motion = Motion(q=rng.normal(size=(2, 50)), dq=rng.normal(size=(2, 50)), ddq=3.0 * rng.normal(size=(2, 50)))
    term = load_term(model)
    rigid = np.array(term.inertia).reshape(-1, 10)

    def friction(part: float) -> np.ndarray:
        changed = rigid.copy()
        changed[0, 9] -= part * rotor.most
        return LOADS[0] * term.after(changed).columns(model.robot, motion, None)[0][0][0]

    smooth = np.sign(friction(-0.06)) == np.sign(friction(0.06))
    bent = friction(0.05) - 2.0 * friction(0.0) + friction(-0.05)
    smooth &= np.abs(bent) < 1e-9  # the load keeps its sign
    assert smooth.sum() > 30
    columns = slope.columns(model.robot, motion, None)[0]
    assert np.allclose(columns[0][0][smooth], ((friction(0.01) - friction(-0.01)) / 0.02)[smooth], rtol=1e-9)
    assert columns[1].shape == (0, 50)


def test_standard_parameters_with_rotors_are_those_base_parameters() -> None:
    truth = driven_truth()
    model = truth.model.with_term(replace(load_term(truth.model), rotors=(0.4, 0.0)))
    base = base_parameters(model)
    values = base.projection @ truth.standard
    standard = standard_with_rotors(model, base, values)
    assert np.allclose(base.projection @ standard, values, rtol=0, atol=1e-12)
    assert standard[base.names.index("Ia_1")] == 0.4


def test_a_rotor_takes_no_more_than_there_is_and_no_less_than_nothing() -> None:
    truth = driven_truth(rotors=(40.0, 0.1))
    recording = slow_and_fast(truth, seed=1, noise=1.0)
    for sign in (1.0, -1.0):
        wrong = replace(recording, tau=recording.tau + sign * np.abs(recording.q))
        model = iterated(truth.model, [wrong], SETTINGS, WeightedLeastSquares())
        term = load_term(model)
        if term.rotors:
            assert min(term.rotors) >= 0.0
            assert np.array(term.inertia).reshape(-1, 10)[0, 9] >= -1e-9


def test_a_payload_hangs_on_links_without_the_rotor() -> None:
    truth = driven_truth()
    estimate = identify(truth.model, [slow_and_fast(truth, seed=0, noise=0.02)], processing=SETTINGS)
    payload = np.array([0.9, 0.4, 0.0, 0.0, 0.02, 0.0, 0.2, 0.0, 0.0, 0.2])
    loaded = load_term(loaded_model(estimate, estimate.values, payload, 1))
    bare = load_term(loaded_model(estimate, estimate.values, np.zeros(10), 1))
    assert loaded.rotors == bare.rotors == load_term(estimate.model).rotors
    change = np.array(loaded.inertia) - np.array(bare.inertia)
    assert np.allclose(change.reshape(-1, 10), [np.zeros(10), payload], rtol=0, atol=1e-12)
    with_rotor = rigid_parameters(estimate.model, _all(estimate))
    taken_off = with_rotor[0, 9] - np.array(bare.inertia).reshape(-1, 10)[0, 9]
    assert taken_off == pytest.approx(bare.rotors[0])


def _all(estimate) -> np.ndarray:
    standard = np.zeros(estimate.model.n_p)
    standard[estimate.base.independent] = estimate.values
    return standard


def test_models_without_load_friction_or_rotors_hide_none() -> None:
    robot = driven_truth().model.robot
    for keys in ("inertia,rotor,viscous", "inertia,load-coulomb", "viscous,load-coulomb"):
        model = torque_model(robot, keys)
        base = base_parameters(model)
        assert hidden_rotors(model, base, np.ones(base.n_b)) == ()
