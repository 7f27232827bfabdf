"""The study of estimators: its measures against hand calculations, its laws on tiny runs."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from tauhat.dynamics import base_parameters, torque_model
from tauhat.dynamics.rigid_body import inverse_dynamics
from tauhat.errors import ModelError, TauhatError
from tauhat.estimation.estimators import ESTIMATORS
from tauhat.excitation import random_fourier
from tauhat.robots import load_robot
from tauhat.simulation import nominal_parameters
from tauhat.studies.monte_carlo import (
    FAMILIES,
    SLOW,
    Cell,
    Fit,
    MonteCarloStudy,
    cells_of,
    column_sizes,
    experiment_of,
    model_torque,
    relative_error,
)
from tauhat.studies.monte_carlo.standings import standings_of
from tauhat.studies.study import StudyResult
from tauhat.verification import standard_parameters
from tauhat.workers import LocalWorkers

TINY = MonteCarloStudy(
    robots=("two_link",),
    noises=(0.1, 1.0, 10.0),
    rates=(25.0, 200.0),
    estimators=("ols", "wls", "didim", "ekf-root", "sequential"),
    seeds=1,
    slow_seeds=1,
    seconds=4.0,
)


@pytest.fixture(scope="module")
def fits() -> tuple[Fit, ...]:
    return TINY.fits(LocalWorkers(count=1))


@pytest.fixture(scope="module")
def story(fits) -> StudyResult:
    return TINY.result(fits)


def untimed(found: tuple[Fit, ...]) -> str:
    return repr([replace(fit, seconds=0.0) for fit in found])


def fit(estimator: str, seed: int, torque_error: float, *, failure: str = "") -> Fit:
    return Fit(
        robot="arm", noise=1.0, rate=100.0, seed=seed, estimator=estimator, parameter_error=2.0 * torque_error,
        torque_error=torque_error, inside=0.95, passes=3, seconds=0.5, cause="solved", failure=failure,
    )  # fmt: skip


def test_the_relative_error_is_that_of_a_hand_calculation():
    values, truth, sizes = np.array([1.1, 2.0]), np.array([1.0, 2.5]), np.array([2.0, 1.0])
    # Errors of 0.1 and 0.5 count 0.2 and 0.5, the truth 2 and 2.5.
    assert relative_error(values, truth, sizes) == pytest.approx(np.sqrt(0.04 + 0.25) / np.sqrt(4.0 + 6.25), rel=1e-14)


def test_the_relative_error_does_not_know_the_units_of_a_parameter():
    rng = np.random.default_rng(3)
    values, truth, sizes, units = (rng.uniform(0.1, 2.0, 6) for _ in range(4))
    assert relative_error(values * units, truth * units, sizes / units) == pytest.approx(
        relative_error(values, truth, sizes), rel=1e-12
    )


def test_the_size_of_a_column_is_the_torque_of_one_unit_of_its_parameter():
    robot = load_robot("two_link")
    model = torque_model(robot)
    base = base_parameters(model)
    motion = random_fourier(robot, period=4.0, harmonics=3, rng=np.random.default_rng(1)).sample(
        np.linspace(0.0, 4.0, 50)
    )
    whole = model_torque(model, standard_parameters(model, nominal_parameters(robot)), motion)
    alone = [model_torque(model, np.eye(model.n_p)[index], motion) for index in base.independent]
    by_hand = [np.sqrt(np.sum(np.mean(torque**2, axis=0) / np.mean(whole**2, axis=0))) for torque in alone]
    np.testing.assert_allclose(column_sizes(model, base, motion, whole), by_hand, rtol=1e-10)


def test_the_torque_of_a_model_is_inverse_dynamics_with_friction():
    robot = load_robot("ur5e")
    model, truth = torque_model(robot, ["inertia", "rotor", "viscous"]), nominal_parameters(robot)
    motion = random_fourier(robot, period=4.0, harmonics=3, rng=np.random.default_rng(2)).sample(
        np.linspace(0.0, 4.0, 20)
    )
    expected = inverse_dynamics(robot, motion.q, motion.dq, motion.ddq)
    expected = expected + truth.rotor * motion.ddq + truth.viscous * motion.dq
    np.testing.assert_allclose(model_torque(model, standard_parameters(model, truth), motion), expected, atol=1e-9)


def test_every_estimator_has_one_family():
    assert sorted(key for keys in FAMILIES.values() for key in keys) == sorted(ESTIMATORS)
    assert set(SLOW) <= set(ESTIMATORS)


def test_slow_estimators_have_fewer_seeds_and_every_log_holds_all_that_see_it():
    study = MonteCarloStudy(estimators=("wls", "cloe"), seeds=4, slow_seeds=2)
    cases = study.cases()
    assert len(cases) == 4 * 2 * 3 * 3
    assert {case.estimators for case in cases if case.seed < 2} == {("wls", "cloe")}
    assert {case.estimators for case in cases if case.seed >= 2} == {("wls",)}
    assert MonteCarloStudy(seeds=1).seeds_of("cloe") == 1


def test_one_process_and_two_find_the_same(fits):
    keys = ("ols", "wls", "sequential")
    small = replace(TINY, noises=(1.0,), estimators=keys)
    alone = tuple(one for one in fits if one.noise == 1.0 and one.estimator in keys)
    assert len(alone) == 6
    assert untimed(small.fits(LocalWorkers(count=2))) == untimed(alone)


@pytest.mark.parametrize("key", ["ols", "wls", "didim", "ekf-root"])
def test_errors_fall_with_less_noise(fits, key):
    errors = {one.noise: one for one in fits if one.estimator == key and one.rate == 200.0}
    assert not any(one.failure for one in errors.values())
    assert errors[0.1].torque_error < errors[1.0].torque_error < errors[10.0].torque_error
    assert errors[0.1].parameter_error < errors[10.0].parameter_error


@pytest.mark.parametrize("key", ["ols", "wls", "didim", "ekf-root"])
def test_intervals_of_a_quiet_log_hold_the_truth(fits, key):
    (quiet,) = [one for one in fits if one.estimator == key and one.rate == 200.0 and one.noise == 0.1]
    assert quiet.inside >= 12 / 13  # one of 13 intervals of 95 % may miss
    assert quiet.parameter_error < 0.01


def test_seeds_are_other_robots_and_the_judged_motion_is_not_the_fitted_one():
    first, second = (experiment_of("two_link", seed=seed, seconds=4.0) for seed in (0, 1))
    assert not np.isclose(first.standard, second.standard)[first.standard != 0.0].any()
    assert not np.isclose(first.unseen.q, first.clean.q[:: len(first.clean.t) // 400][:400]).all()


def test_an_estimator_that_refuses_is_counted_with_its_reason(fits, story):
    refused = [one for one in fits if one.estimator == "sequential" and one.rate == 25.0 and one.noise == 1.0]
    assert [one.failure for one in refused] == [
        "the segments tell no friction parameter; record runs at several constant speeds"
    ]
    assert np.isnan(refused[0].torque_error)
    rows = [
        row
        for chapter in story.chapters
        for table in chapter.tables
        if "did not end" in table.title
        for row in table.rows
    ]
    assert ("sequential", "two_link", 1.0, 25.0, "1 of 1", refused[0].failure) in rows
    assert "sequential" in story.summary.partition("Not every fit ended well: ")[2]


def test_a_log_that_cannot_be_processed_fails_for_all_estimators():
    study = replace(TINY, noises=(1.0,), rates=(1.0,), estimators=("ols", "wls"))
    found = study.fits(LocalWorkers(count=1))
    assert [one.estimator for one in found] == ["ols", "wls"]
    assert found[0].failure == found[1].failure != ""
    assert "None is to be trusted" in study.result(found).summary


def test_a_cell_counts_what_failed_and_what_is_useless():
    diverged = replace(fit("x", 4, 0.03), doubt="diverged")
    group = [fit("x", 0, 0.01), fit("x", 1, 0.03), fit("x", 2, 0.9), fit("x", 3, np.nan, failure="it broke"), diverged]
    (cell,) = cells_of(group, usable=0.2)
    assert isinstance(cell, Cell)
    assert (cell.seeds, cell.ended) == (5, 0.4)
    assert cell.torque_error == pytest.approx(0.03)
    assert cell.losses == ("torque of the unseen motion off by more than 20 % (solved)", "it broke", "diverged")


def test_bias_is_the_mean_error_over_its_standard_error_of_the_fits_that_ended_well():
    errors = ((1.0, -0.5), (2.0, 0.5), (3.0, 0.0), (90.0, 90.0))
    group = [replace(fit("wls", seed, 0.01), errors=values) for seed, values in enumerate(errors[:3])]
    group.append(replace(fit("wls", 3, 0.5), errors=errors[3]))  # not usable: it does not count
    (cell,) = cells_of(group, usable=0.2)
    # Means 2 and 0, standard errors 1 / sqrt(3) and 0.5 / sqrt(3).
    assert cell.bias == pytest.approx(np.sqrt((2.0**2 * 3.0 + 0.0) / 2.0), rel=1e-12)
    (few,) = cells_of(group[:2], usable=0.2)
    assert np.isnan(few.bias)


def test_a_standing_is_the_mean_ratio_to_the_reference_on_the_same_logs():
    group = [fit("wls", 0, 0.01), fit("wls", 1, 0.02), fit("x", 0, 0.04), fit("x", 1, 0.02), fit("y", 0, 0.009)]
    reference, twice, once = standings_of(group, noises=(1.0,), usable=0.2)
    assert (reference.ratio, twice.ratio) == pytest.approx((1.0, 2.0))  # geometric mean of 4 and 1
    assert once.ratio == pytest.approx(0.9)  # of the one log that it saw
    assert [row.trusted for row in (reference, twice, once)] == [True, False, True]
    assert twice.reasons == ("error 2 times as large",)


def test_the_story_has_a_chapter_for_every_family_and_is_plain_data(story):
    titles = [chapter.title for chapter in story.chapters]
    assert titles == ["What was done", *FAMILIES, "Which to trust"]
    json.dumps(story.to_dict(), allow_nan=False)
    (squares,) = [chapter for chapter in story.chapters if chapter.title == "Least squares"]
    assert len(squares.tables[0].rows) == 2 * 3 * 2  # estimators, noises, rates
    assert story.chapters[-1].charts[0].series[0].name == "ols"


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"rates": (300.0,)}, "whole part of 2000 Hz"),
        ({"estimators": ("magic",)}, "unknown estimator"),
        ({"robots": ()}, "at least one"),
        ({"noises": (1.0, 1.0)}, "none twice"),
        ({"noises": (-1.0,)}, "positive numbers"),
        ({"seeds": 0}, "at least 1"),
        ({"seconds": 0.0}, "positive number"),
    ],
)
def test_settings_that_mean_nothing_are_refused(changes, word):
    with pytest.raises(ModelError, match=word):
        MonteCarloStudy(**changes)


def test_an_unknown_robot_stops_the_study():
    with pytest.raises(TauhatError, match="no such robot"):
        replace(TINY, robots=("nobody",)).fits(LocalWorkers(count=1))
