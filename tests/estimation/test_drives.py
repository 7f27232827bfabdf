"""Torque constants come back from a payload of known mass, and what cannot be known is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from loaded_arms import CENTRE, EMPTY, MASS, SETTINGS, carrying, measured
from scipy.linalg import eigh

from tauhat.errors import ModelError
from tauhat.estimation import identify
from tauhat.estimation.drives import DriveCalibration, WeighedPayload, calibrate_drives
from tauhat.estimation.gain_fit import ordinary_solution, total_solution

LOADED = carrying(EMPTY)
GAINS = np.array([0.8, 1.3])
SEEDS = range(40)
WEIGHED = WeighedPayload(mass=MASS)


def calibrated(seed: int, *, size: float = 0.0, payload: WeighedPayload = WEIGHED, gains=GAINS) -> DriveCalibration:
    before = measured(EMPTY, seed=seed, size=size, gains=gains)
    after = measured(LOADED, seed=1000 + seed, size=size, gains=gains)
    estimate = identify(EMPTY.model, [before], processing=SETTINGS)
    return calibrate_drives(estimate, [after], unloaded=[before], payload=payload)


def test_gains_come_back_from_clean_runs_by_both_methods():
    calibration = calibrated(0)
    assert np.allclose(calibration.factors, GAINS, rtol=5e-3)
    assert np.allclose(calibration.ordinary.factors, GAINS, rtol=5e-3)
    assert calibration.joint_names == ("j1", "j2")


def test_95_percent_intervals_of_total_least_squares_cover_the_gains_at_that_rate():
    runs = [calibrated(seed, size=0.3) for seed in SEEDS]
    errors = np.array([run.factors - GAINS for run in runs])
    halves = np.array([run.half_intervals() for run in runs])
    assert (np.mean(np.abs(errors) < halves, axis=0) >= 0.90).all()
    assert (halves.mean(axis=0) < 3.0 * errors.std(axis=0)).all()  # and no wider than the rate needs


def test_least_squares_is_drawn_to_zero_where_total_least_squares_is_not():
    runs = [calibrated(seed, size=2.0) for seed in range(12)]
    total = np.mean([run.total.factors for run in runs], axis=0) / GAINS
    ordinary = np.mean([run.ordinary.factors for run in runs], axis=0) / GAINS
    spread = np.std([run.total.factors for run in runs], axis=0) / GAINS / np.sqrt(len(runs))
    assert (ordinary < 1.0 - 4.0 * spread).all()
    assert (np.abs(total - 1.0) < 3.0 * spread).all()


def test_a_known_centre_makes_gains_more_certain():
    mass_alone = calibrated(0, size=0.3)
    both = calibrated(0, size=0.3, payload=WeighedPayload(mass=MASS, centre=CENTRE))
    assert both.half_intervals().sum() < mass_alone.half_intervals().sum()
    assert (np.abs(both.factors - GAINS) < 2.0 * both.half_intervals()).all()


def test_gains_are_in_proportion_to_the_mass_and_against_those_already_applied():
    once = calibrated(0, size=0.1)
    heavier = calibrated(0, size=0.1, payload=WeighedPayload(mass=2.0 * MASS))
    assert np.allclose(heavier.factors, 2.0 * once.factors)
    applied = calibrated(0, size=0.1, gains=np.ones(2))
    assert np.allclose(applied.factors * GAINS, once.factors, rtol=1e-3)
    assert applied.found_mass == pytest.approx(MASS, rel=0.02)


def test_total_least_squares_is_the_last_generalised_eigenvector():
    rng = np.random.default_rng(0)
    rows = rng.normal(size=(50, 7)) * rng.uniform(0.1, 10.0, 7)
    noise = np.array([0.4, 2.0, 0.9])
    found = total_solution(rows, 4, noise)
    clean = rows[:, :4]
    left = rows[:, 4:] - clean @ np.linalg.lstsq(clean, rows[:, 4:], rcond=None)[0]
    _, axes = eigh(left.T @ left, np.diag(noise))
    direction = axes[:, 0] / np.linalg.norm(axes[:, 0])
    assert abs(direction @ found[4:]) / np.linalg.norm(found[4:]) == pytest.approx(1.0)
    assert found[3] == 1.0
    assert np.allclose(clean.T @ rows @ found, 0.0, atol=1e-8 * np.abs(rows).max() ** 2 * np.abs(found).max() * 50)


def test_least_squares_leaves_nothing_that_its_columns_could_take():
    rows = np.random.default_rng(1).normal(size=(40, 6))
    found = ordinary_solution(rows, 3)
    assert found[2] == 1.0
    assert np.allclose(np.delete(rows, 2, axis=1).T @ (rows @ found), 0.0, atol=1e-12)


@pytest.mark.parametrize(("signs", "joint"), [((1.0, -1.0), "j2"), ((-1.0, -1.0), "j1")])
@pytest.mark.filterwarnings("ignore::tauhat.errors.TauhatWarning")  # friction comes out negative, too
def test_a_torque_of_wrong_sign_is_refused_and_its_joint_named(signs, joint):
    with pytest.raises(ModelError, match=rf"joint {joint}: the torque has the wrong sign"):
        calibrated(0, size=0.1, gains=GAINS * signs)


def test_a_run_without_payload_calibrates_nothing():
    before, after = (measured(EMPTY, seed=seed, size=0.3) for seed in (0, 1))
    estimate = identify(EMPTY.model, [before], processing=SETTINGS)
    with pytest.raises(ModelError, match="do not tell the torque constant"):
        calibrate_drives(estimate, [after], unloaded=[before], payload=WEIGHED)


def test_both_kinds_of_runs_and_a_mass_are_needed():
    before = measured(EMPTY, seed=0)
    estimate = identify(EMPTY.model, [before], processing=SETTINGS)
    with pytest.raises(ModelError, match="with and without a payload"):
        calibrate_drives(estimate, [before], unloaded=[], payload=WEIGHED)
    with pytest.raises(ModelError, match="must be positive"):
        WeighedPayload(mass=0.0)


def test_calibrated_torques_weigh_the_payload_on_runs_that_were_not_used():
    calibration = calibrated(0, size=0.1)
    before, after = (measured(truth, seed=5, size=0.1, gains=GAINS) for truth in (EMPTY, LOADED))
    corrected = [replace(run, tau=run.tau * calibration.factors) for run in (before, after)]
    estimate = identify(EMPTY.model, corrected[:1], processing=SETTINGS)
    other = calibrate_drives(estimate, corrected[1:], unloaded=corrected[:1], payload=WEIGHED)
    assert other.found_mass == pytest.approx(MASS, rel=0.01)
    assert np.allclose(other.factors, 1.0, atol=0.01)
