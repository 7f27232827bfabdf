"""Residuals that still hold an effect name it and its term; those of a right model name nothing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from scipy import signal

from sample_arms import planar_truth
from tauhat.arrays import FloatArray
from tauhat.dynamics import torque_model
from tauhat.errors import ModelError
from tauhat.estimation import Estimate, identify
from tauhat.recordings import Processing, Recording
from tauhat.verification import LogResiduals, residual_tests
from tauhat.verification.fold_gains import Folds, chance_of_gain, gain, passing
from tauhat.verification.whiteness import whiteness

SETTINGS = Processing(cutoff=10.0, motion_cutoff=30.0)
TRUTH = planar_truth()
NOISE = np.array([0.6, 0.3])  # [Nm]
Added = Callable[[Recording], FloatArray]


def log(seed: int, added: Added | None = None) -> Recording:
    """Return a run of the planar arm with white noise, and what `added` makes of it, (n_t, n_v) or one joint's."""
    white = np.random.default_rng(100 + seed).standard_normal((4000, 2))
    recording = TRUTH.recording(seed=seed, noise=NOISE * white)
    return recording if added is None else replace(recording, tau=recording.tau + added(recording))


@lru_cache
def right_model() -> Estimate:
    return identify(TRUTH.model, [log(1)], processing=SETTINGS)


def found(added: Added, **options: object) -> LogResiduals:
    """Return the tests of a run with an effect that the fitted run has as well, and the model has not."""
    poor = identify(TRUTH.model, [log(1, added)], processing=SETTINGS)
    return residual_tests(poor, [log(2, added)], **options)[0]


def found_anew(added: Added) -> LogResiduals:
    """Return the tests of a run with something that the fitted run had not."""
    return residual_tests(right_model(), [log(2, added)])[0]


def test_a_right_model_names_nothing_on_most_runs():
    logs = residual_tests(right_model(), [log(seed) for seed in range(20, 32)])
    assert (
        sum(bool(result.ranked) for result in logs) <= 2
    )  # 5 % are allowed, and more than two of twelve have a chance of 2 %


@pytest.mark.parametrize(
    ("added", "effect", "term"),
    [
        (lambda log: 0.8 * np.abs(log.dq), "friction by direction", "viscous-asymmetry"),
        (lambda log: 5.0 * np.cbrt(log.dq), "degressive friction", "cube-root"),
        (lambda log: 0.8 * np.sin(7.0 * log.q + 0.3), "ripple", ""),
    ],
)
def test_a_missing_effect_is_named_first_with_its_term(added, effect, term):
    for joint in found(added).joints:
        assert (joint.missing[0].effect, joint.missing[0].term) == (effect, term)
        assert joint.missing[0].share > 0.1
        assert joint.missing[0].advice


def test_a_spring_is_named():
    assert found(lambda log: 2.0 * log.q).joints[1].missing[0].effect == "spring"


@pytest.mark.parametrize(
    ("added", "effect"),
    [
        (lambda log: 0.15 * log.t[:, None] * np.ones(2), "drift"),
        (lambda log: 0.1 * log.t[:, None] * log.dq, "warm-up"),
    ],
)
def test_what_changes_in_the_course_of_a_run_is_named(added, effect):
    assert [joint.missing[0].effect for joint in found_anew(added).joints] == [effect, effect]


def test_the_order_of_a_ripple_is_found():
    joints = found(lambda log: 0.8 * np.sin(7.0 * log.q + 0.3)).joints
    assert [joint.missing[0].order for joint in joints] == [7.0, 7.0]


def test_a_gear_ratio_adds_its_orders():
    ripple = found(lambda log: 0.8 * np.sin(31.5 * log.q), gear_ratios={"j1": 31.5, "j2": 31.5})
    assert [joint.missing[0].order for joint in ripple.joints] == [31.5, 31.5]


def test_a_term_that_the_model_has_is_not_missing():
    tried = {effect.term for joint in found(lambda log: 0.0 * log.q).joints for effect in joint.tried}
    assert not tried & {"viscous", "coulomb", "rotor", "offset"}


def test_a_parameter_that_changed_is_told_apart_from_a_missing_effect():
    joints = found_anew(lambda log: 0.8 * log.dq + 0.9 * np.tanh(log.dq / np.array([0.05, 0.08]))).joints
    assert [joint.changed[0].effect for joint in joints] == ["friction has changed"] * 2
    assert all(not joint.missing for joint in joints)


def test_what_the_fit_had_to_make_up_for_is_still_named():
    poor = identify(torque_model(TRUTH.model.robot, "inertia,rotor,viscous,offset"), [log(1)], processing=SETTINGS)
    joint = residual_tests(poor, [log(2)])[0].joints[0]
    assert joint.missing[0].term == "coulomb" or "Coulomb friction" in joint.missing[0].alternatives


def test_temperature_is_blamed_where_it_was_logged():
    heat = 20.0 + 10.0 * np.sin(np.arange(4000) / 700.0)
    warm = replace(log(2, lambda log: 0.08 * (heat[:, None] - 20.0) * log.dq), temperature=np.tile(heat[:, None], 2))
    joint = residual_tests(right_model(), [warm])[0].joints[0]
    assert joint.missing[0].effect == "temperature"


def test_the_shares_are_those_of_the_squared_residual():
    """A ripple of the size of the noise is half of the squared residual."""
    level = 0.3 * np.sqrt(0.1)  # what a low-pass of 10 of 100 Hz leaves of the second joint's noise
    joint = found(lambda log: np.sqrt(2.0) * level * np.sin(7.0 * log.q)).joints[1]
    assert joint.missing[0].share == pytest.approx(0.5, abs=0.12)


def test_results_are_plain_data():
    document = found(lambda log: 2.0 * log.q).to_dict()
    assert document["joints"][1]["missing"][0]["term"] == "spring"
    assert set(document["joints"][0]) >= {"colour", "effective", "correlation_time", "changed", "tried"}


def test_a_short_recording_is_refused():
    with pytest.raises(ModelError, match="too short"):
        residual_tests(right_model(), [log(2).rows(0, 400)])


def test_a_ratio_of_no_joint_is_refused():
    with pytest.raises(ModelError, match=r"gear ratio of an unknown joint; got elbow; known names: j1, j2"):
        residual_tests(right_model(), [log(2)], gear_ratios={"elbow": 100.0})


@pytest.mark.parametrize("ratio", [0.0, float("inf"), float("nan")])
def test_a_ratio_that_is_none_is_refused(ratio):
    with pytest.raises(ModelError, match=r"^j2: gear ratio; expected motor turns a turn of the joint, not 0"):
        residual_tests(right_model(), [log(2)], gear_ratios={"j2": ratio})


def test_no_recording_is_refused():
    with pytest.raises(ModelError, match="no recording"):
        residual_tests(right_model(), [])


def test_white_noise_has_no_colour_and_as_many_independent_rows_as_rows():
    white = np.random.default_rng(0).standard_normal(4000)
    seen = whiteness(white, step=0.01, cutoff=50.0)
    assert seen.p > 0.01
    assert seen.colour < 0.05
    assert seen.effective == pytest.approx(4000, rel=0.15)


def test_the_memory_of_autoregressive_noise_is_found():
    pole = 0.9
    noise = signal.lfilter([1.0], [1.0, -pole], np.random.default_rng(0).standard_normal(40_000))
    seen = whiteness(noise, step=0.01, cutoff=50.0)
    assert seen.correlation_time == pytest.approx(0.01 * (1 + pole) / (1 - pole), rel=0.15)
    assert seen.p < 1e-6
    assert seen.colour > 0.5


def test_a_low_pass_alone_gives_no_colour():
    kernel = signal.firwin(201, 10.0, fs=100.0)
    noise = signal.lfilter(kernel, [1.0], np.random.default_rng(1).standard_normal(20_000))
    assert whiteness(noise, step=0.01, cutoff=10.0).p > 0.01


def test_left_out_stretches_are_judged_by_solutions_without_them():
    rng = np.random.default_rng(2)
    own, other = rng.standard_normal((2, 300)), rng.standard_normal((1, 300))
    other /= np.sqrt(np.mean(other**2))
    residual = 0.5 * other[0] + 0.3 * rng.standard_normal(300)
    folds = Folds.of(own, other, residual, folds=3, redundancy=1.0)
    left = folds.left(np.array([0]), width=1e6)
    columns = np.vstack([own, other]).T
    for fold, rows in enumerate(np.array_split(np.arange(300), 3)):
        training = np.setdiff1d(np.arange(300), rows)
        solution = np.linalg.lstsq(columns[training], residual[training], rcond=None)[0]
        assert left[fold] == pytest.approx(np.sum((residual[rows] - columns[rows] @ solution) ** 2), rel=1e-4)


def test_a_gain_is_a_ratio_of_sums_with_the_error_of_one():
    seen = gain(np.array([4.0, 4.0]), np.array([1.0, 3.0]), np.array([4.0, 4.0]))
    assert seen.share == pytest.approx(0.5)
    assert seen.standard_error == pytest.approx(0.25)


def test_chance_is_fishers():
    from scipy.stats import f

    p = chance_of_gain(np.array([10.0]), np.array([8.0]), columns=2, effective=2.5 * 53.0)
    assert p == pytest.approx(f.sf(2.0 / 2 / (8.0 / 50.0), 2, 50.0))


def test_many_tests_need_smaller_p_values():
    assert passing(np.array([0.04, 0.9, 0.8, 0.7]), rate=0.05) == -1.0
    assert passing(np.array([0.01, 0.02, 0.8, 0.7]), rate=0.05) == 0.02


def test_silence_of_few_independent_rows_is_no_proof():
    right = residual_tests(right_model(), [log(2)])[0]
    assert right.silence == "no effect of the catalogue can be told in the residuals."
    short, long = right.joints
    short = replace(short, whiteness=short.whiteness._replace(effective=12.0))
    assert (
        "on j1 are worth fewer than 30 independent rows: effects may be there"
        in replace(right, joints=(short, long)).silence
    )
    assert "on every joint are worth fewer" in replace(right, joints=(short, short)).silence
