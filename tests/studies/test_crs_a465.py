"""The CRS A465 study: its arms are bodies, its maps are exact, its methods behave, and its words follow its figures."""

from __future__ import annotations

import json
import pickle
import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tauhat.dynamics import random_motion
from tauhat.errors import ModelError
from tauhat.excitation import MotionSamples
from tauhat.robots import central_inertia, inertia_defect, load_robot
from tauhat.studies.crs_a465 import CrsA465Study
from tauhat.studies.crs_a465.conclusions import conclusions, summary
from tauhat.studies.crs_a465.coordinates import coordinates
from tauhat.studies.crs_a465.crs_a465_study import piece_done
from tauhat.studies.crs_a465.experiment import (
    CONDITIONS,
    TERMS,
    Experiment,
    fitted_motion,
    gross_errors,
    identifiable,
    recorded,
    spoiled,
    true_arm,
)
from tauhat.studies.crs_a465.findings import Findings, against, listed, percent
from tauhat.studies.crs_a465.fits import CASES, METHODS, ArmPiece, Case, FitFigures, first_seconds, prepared, solved
from tauhat.studies.crs_a465.plant import PlantPiece
from tauhat.workers import LocalWorkers

LENGTHS = (0.15, 2.5, 40.0)  # the first is too short for either model
WRIST = slice(3, 6)


@pytest.fixture(scope="module")
def found() -> Findings:
    pieces = [ArmPiece(experiment=Experiment(), seed=seed, lengths=LENGTHS) for seed in (0, 1)]
    return Findings(
        experiment=Experiment(), lengths=LENGTHS, arms=tuple(piece_done(piece) for piece in pieces), plants=()
    )


def states(count: int) -> MotionSamples:
    """Return random states of the arm."""
    motion = random_motion(load_robot("crs_a465"), count, np.random.default_rng(3))
    t = np.arange(count, dtype=np.float64)
    return MotionSamples(t=t, q=motion.q.T, dq=motion.dq.T, ddq=motion.ddq.T)


def scaled(found: Findings, case: Case, factor: float) -> Findings:
    """Return the findings with the torque error of one case multiplied."""

    def changed(fit: FitFigures) -> FitFigures:
        return fit._replace(torque=factor * fit.torque, joints=factor * fit.joints)

    arms = [replace(arm, fits={**arm.fits, case: changed(arm.fits[case])}) for arm in found.arms]
    return replace(found, arms=tuple(arms))


def test_a_true_arm_is_a_physical_body_with_products_of_inertia_on_every_link():
    truth = true_arm(Experiment(), np.random.default_rng(0))
    nominal = load_robot("crs_a465").inertia[:, [5, 7, 8]]
    assert np.abs(nominal).max() < 1e-12
    for link in truth.inertia:
        mass, _, central = central_inertia(link)
        assert mass > 0.0
        assert not inertia_defect(mass, central)
        assert (np.abs(link[[5, 7, 8]]) > 1e-3 * link[[4, 6, 9]].max()).all()


def test_barycentric_parameters_predict_the_torque_of_both_models():
    samples = states(40)
    shared = identifiable("full").regressor(samples) @ coordinates().to_full
    for name in TERMS:
        own = identifiable(name)
        values = np.random.default_rng(1).standard_normal(own.base.n_b)
        torque = own.regressor(samples) @ values
        again = shared @ (coordinates().from_base[name] @ values)
        assert np.allclose(again, torque, rtol=0, atol=1e-9 * np.abs(torque).max())


def test_products_of_inertia_are_what_the_simplified_model_cannot_say():
    rank = np.linalg.matrix_rank(coordinates().from_base["simplified"])
    assert rank == identifiable("simplified").base.n_b < coordinates().n_c == identifiable("full").base.n_b


def test_error_bars_go_through_the_map_as_values_do():
    rng = np.random.default_rng(5)
    log = recorded(
        (motion := fitted_motion(Experiment(), rng, seconds=20.0)),
        identifiable("full").regressor(motion) @ identifiable("full").true_values(true_arm(Experiment(), rng)),
        robot=load_robot("crs_a465"),
        name="log",
    )
    solution = solved(prepared(identifiable("simplified"), spoiled(log, "unequal", Experiment(), rng)), "wls")
    turn = coordinates().from_base["simplified"]
    drawn = rng.multivariate_normal(solution.values, solution.covariance, size=20_000) @ turn.T
    expected = np.sqrt(np.einsum("jk,kl,jl->j", turn, solution.covariance, turn))
    assert np.allclose(drawn.std(axis=0), expected, rtol=0.05, atol=1e-12)


def test_without_noise_the_full_model_is_recovered_and_the_simplified_one_is_biased(found):
    for arm in found.arms:
        error = arm.effects * (arm.exact["full"].values - arm.true_values)
        assert np.linalg.norm(error) < 1e-5 * np.linalg.norm(arm.effects * arm.true_values)
        assert arm.exact["full"].torque < 1e-5
        assert 1e-3 < arm.exact["simplified"].torque < 0.05


def test_weights_of_the_joints_pay_where_the_noise_is_unequal_and_cost_nothing_where_it_is_equal(found):
    ols, wls = (found.joints(Case("unequal", "full", method)) for method in ("ols", "wls"))
    assert (wls[WRIST] < 0.7 * ols[WRIST]).all()
    assert found.torque(Case("unequal", "full", "wls")) <= found.torque(Case("unequal", "full", "ols"))
    assert found.torque(Case("equal", "full", "wls")) == pytest.approx(
        found.torque(Case("equal", "full", "ols")), rel=0.1
    )


@pytest.mark.parametrize("model", list(TERMS))
def test_reweighting_survives_gross_errors_that_spoil_the_others(found, model):
    for method in ("irls", "irls-huber"):
        clean = found.torque(Case("unequal", model, method))
        assert found.torque(Case("outliers", model, method)) < 2.5 * clean
    for method in ("ols", "wls"):
        clean = found.torque(Case("unequal", model, method))
        assert found.torque(Case("outliers", model, method)) > 10.0 * clean


def test_the_simplified_model_wins_on_short_logs_and_loses_on_long_ones(found):
    full, simplified = (found.after_lengths(name)[1] for name in ("full", "simplified"))
    assert simplified[1] < full[1]
    assert simplified[2] > full[2]
    assert found.simplified_wins()[2] == 0.0


def test_a_log_too_short_for_the_model_is_an_infinite_error_and_not_a_failure(found):
    assert all(np.isinf(found.after_lengths(name)[:, 0]).all() for name in TERMS)
    assert all(np.isfinite(found.after_lengths(name)[:, 1:]).all() for name in TERMS)
    fewer_samples_than_a_log_needs = piece_done(ArmPiece(experiment=Experiment(), seed=0, lengths=(0.01,)))
    assert np.isinf(fewer_samples_than_a_log_needs.lengths).all()


def test_intervals_of_the_full_model_hold_the_truth_whatever_the_noise(found):
    for case in CASES:
        if case.model == "full":
            assert found.inside(case).mean() > 0.9, case
            assert 0.5 < found.missed(case) < 1.3, case


def test_the_same_seed_gives_the_same_arm_and_another_seed_another(found):
    piece = pickle.loads(pickle.dumps(ArmPiece(experiment=Experiment(), seed=0, lengths=LENGTHS[:1])))  # noqa: S301
    again = piece_done(piece)
    assert np.array_equal(again.true_values, found.arms[0].true_values)
    assert not np.array_equal(again.true_values, found.arms[1].true_values)


def test_noise_of_equal_joints_has_the_power_of_unequal_ones():
    settings = Experiment()
    equal, unequal = (settings.levels(condition) for condition in ("equal", "unequal"))
    assert np.ptp(equal) == 0.0
    assert np.ptp(unequal) > 0.0
    assert np.sum(equal**2) == pytest.approx(np.sum(unequal**2))


def test_gross_errors_are_as_many_and_as_large_as_the_settings_say():
    tau = np.tile([1.0, 2.0, 4.0, 8.0, 16.0, 32.0], (20_000, 1))
    spikes = gross_errors(tau, Experiment(spikes=0.02, pushes=0.0), np.random.default_rng(0))
    assert np.mean(spikes != 0.0, axis=0) == pytest.approx(0.02, rel=0.2)
    assert np.unique(np.abs(spikes / tau)).tolist() == [0.0, 10.0]
    pushes = gross_errors(tau, Experiment(spikes=0.0, pushes=0.05), np.random.default_rng(0))
    assert np.mean(pushes != 0.0, axis=0) == pytest.approx(0.05, rel=0.2)
    assert not gross_errors(tau, Experiment(spikes=0.0, pushes=0.0), np.random.default_rng(0)).any()


def test_the_words_follow_the_figures(found):
    case = Case("unequal", "full", "wls")
    better, worse = scaled(found, case, 0.1), scaled(found, case, 10.0)
    for changed, word in ((better, "smaller"), (worse, "larger")):
        weights = conclusions(changed).text[0]
        assert f"WLS is off by {percent(changed.torque(case))}" in weights
        assert re.search(rf"WLS [\d.]+ times {word}", weights)
    spoiled_irls = scaled(found, Case("outliers", "full", "irls"), 50.0)
    assert "irls" not in conclusions(spoiled_irls).text[1].rpartition("the error: ")[2].split(", ")
    assert summary(spoiled_irls) != summary(found)


def test_lengths_are_said_of_the_model_that_won_them(found):
    text = conclusions(found).text[3]
    assert "the simplified model predicts better after logs of 2.5 s (" in text
    assert "the full model predicts better after logs of 40 s (" in text
    hopeless = replace(found, arms=tuple(replace(arm, lengths=np.full((2, 3), np.inf)) for arm in found.arms))
    assert "neither model predicts better after any of the logs" in conclusions(hopeless).text[3]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (lambda: against(1.0, 2.0), "2 times smaller"),
        (lambda: against(30.0, 1.0), "30 times larger"),
        (lambda: against(1.02, 1.0), "about the same"),
        (lambda: listed((1.0,), "s"), "1 s"),
        (lambda: listed((1.0, 2.5, 4.0), "s"), "1, 2.5 and 4 s"),
        (lambda: percent(0.00456), "0.46 %"),
        (lambda: percent(1.234), "123 %"),
    ],
)
def test_numbers_in_words(words: Callable[[], str], said: str):
    assert words() == said


def test_a_run_is_plain_data_with_every_case_in_its_tables():
    told: list[str] = []
    result = CrsA465Study(seeds=1, lengths=(5.0, 20.0)).run(LocalWorkers(count=1), tell=told.append)
    document = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert told == ["1 of 1 arms"]
    assert document["settings"]["seeds"] == 1
    titles = [chapter["title"] for chapter in document["chapters"]]
    assert titles[-1] == "Conclusions"
    assert "The same on a simulated plant" not in titles
    torque = document["chapters"][2]["tables"][0]
    assert [tuple(row[:3]) for row in torque["rows"]] == list(CASES)
    assert len(CASES) == len(CONDITIONS) * len(TERMS) * len(METHODS)


def test_one_arm_in_ten_is_moved_by_a_controller_unless_told_otherwise():
    assert [CrsA465Study(seeds=seeds).n_plants for seeds in (2, 10, 20)] == [0, 1, 2]
    assert CrsA465Study(seeds=2, plants=3).n_plants == 3


def test_on_a_simulated_plant_reweighting_survives_gross_errors_too():
    fits = piece_done(PlantPiece(experiment=Experiment(), seed=0, seconds=5.0, methods=("ols", "irls")))
    assert len(fits) == 8
    for model in TERMS:
        assert fits[Case("outliers", model, "irls")].torque < 0.2 * fits[Case("outliers", model, "ols")].torque


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: CrsA465Study(seeds=0), "crs-a465: arms of the study; expected 1 seed or more"),
        (lambda: CrsA465Study(plants=-1), "no negative plants, got 20 and -1"),
        (lambda: CrsA465Study(lengths=()), "lengths of the logs; expected positive seconds"),
        (lambda: CrsA465Study(lengths=(1.0, -2.0)), "lengths of the logs; expected positive seconds"),
        (lambda: Experiment(noise=(1.0, 2.0)), "crs_a465: noise of the joints; expected 6, got 2"),
        (lambda: Experiment(spikes=-0.1), "setting spikes; expected no negative number, got -0.1"),
        (lambda: Experiment(reach=float("nan")), "setting reach; expected no negative number"),
    ],
)
def test_settings_that_make_no_study_are_refused(make: Callable[[], object], said: str):
    with pytest.raises(ModelError, match=said):
        make()


def test_the_first_seconds_of_a_log_are_the_logs_own():
    motion = fitted_motion(Experiment(), np.random.default_rng(0), seconds=4.0)
    log = recorded(motion, np.zeros_like(motion.q), robot=load_robot("crs_a465"), name="log")
    part = first_seconds(log, 1.0)
    assert part.n_t == 200
    assert np.array_equal(part.q, log.q[:200])
    assert first_seconds(log, 100.0).n_t == log.n_t
