"""A payload that was weighed: the model finds it within its error bars, and a wrong weight is outside."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from sample_arms import planar_truth
from tauhat.errors import ModelError
from tauhat.estimation import Estimate, identify
from tauhat.recordings import Processing, Recording
from tauhat.robots import inertia_at_origin
from tauhat.verification import PayloadCheck, check_payload

SETTINGS = Processing(cutoff=10.0, motion_cutoff=30.0)
TRUTH = planar_truth()
MASS, CENTRE = 1.5, np.array([0.45, 0.05, 0.0])


@lru_cache
def estimate() -> Estimate:
    return identify(TRUTH.model, [TRUTH.recording(seed=1, noise=noise(1))], processing=SETTINGS)


def noise(seed: int) -> np.ndarray:
    return 0.1 * np.random.default_rng(seed).standard_normal((4000, 2))


@lru_cache
def loaded() -> Recording:
    body = inertia_at_origin(mass=MASS, com=CENTRE, inertia_at_com=0.01 * np.eye(3))
    standard = TRUTH.standard.copy()
    standard[10:20] += body
    carrying = type(TRUTH)(TRUTH.model, standard)
    return carrying.recording(seed=2, noise=noise(2))


def check(mass: float = MASS) -> PayloadCheck:
    return check_payload(estimate(), [loaded()], mass=mass, centre=CENTRE)


def test_what_was_weighed_is_found_inside_its_error_bars():
    numbers = {number.quantity: number for number in check().numbers}
    assert set(numbers) == {"mass", "centre x", "centre y", "centre z"}
    moment = numbers["mass"].found * numbers["centre x"].found
    assert moment == pytest.approx(MASS * CENTRE[0], rel=0.02)
    assert numbers["mass"].found == pytest.approx(MASS, abs=2 * numbers["mass"].half)
    assert numbers["centre z"].inside is None  # a planar arm does not show it


def test_a_wrong_weight_is_outside():
    assert not check(mass=3.0).numbers[0].inside


def test_the_payload_explains_what_the_arm_alone_does_not():
    seen = check()
    assert seen.ignored > 5 * seen.found


def test_results_are_plain_data():
    document = check().to_dict()
    assert document["numbers"][0]["known"] == MASS
    assert document["relative_rms_found"] < document["relative_rms_ignored"]


def test_a_payload_without_mass_is_refused():
    with pytest.raises(ModelError, match="must be positive"):
        check(mass=0.0)
