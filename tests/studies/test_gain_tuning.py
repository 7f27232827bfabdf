"""Gains tuned on a rehearsed plant, judged where they were not tuned."""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tauhat.control import PD, PID, TrackingController
from tauhat.errors import MissingExtraError, ModelError, SimulationError
from tauhat.excitation import random_fourier
from tauhat.robots import load_robot
from tauhat.simulation import Encoder, perturbed, tracking_gains
from tauhat.studies.gain_rehearsal import Judged, Price, Rehearsal, rehearsal_settings
from tauhat.studies.gain_tuning import GainSearch, tune_gains

pytest.importorskip("optuna", reason="the extra `tuning` is not installed")
ARM = load_robot("ur5e")
SEARCH = GainSearch(trials=10, seed=2)


def rehearsal(seed, *, delay=1e-3):
    motion = random_fourier(ARM, period=1.5, harmonics=2, rng=np.random.default_rng(seed), margin=0.3)
    truth = perturbed(ARM, np.random.default_rng(3), spread=0.2)
    settings = replace(rehearsal_settings(), control_delay=delay, settle=0.05)
    return Rehearsal(robot=ARM, motion=motion, truth=truth, settings=settings, seed=seed)


def by_hand(place):
    samples = place.motion.sample(np.linspace(0.0, 1.5, 40))
    return tracking_gains(ARM, samples.q, bandwidth=8.0, control_rate=1000.0)


@cache
def tuned():
    place = rehearsal(1)
    return tune_gains(place, by_hand(place), unseen=rehearsal(2), search=SEARCH)


def test_tuned_gains_track_better_on_a_motion_and_with_noise_they_never_saw():
    result = tuned()
    assert np.linalg.norm(result.unseen_after.error) < 0.7 * np.linalg.norm(result.unseen_before.error)
    assert result.improvement > 0.3
    assert result.after.cost(result.before, SEARCH.price) == pytest.approx(result.costs.min())


def test_the_first_trial_is_the_gains_set_by_hand_and_the_best_never_worse():
    result = tuned()
    assert result.costs[0] == pytest.approx(1.0 + SEARCH.price.effort + SEARCH.price.chatter)
    assert result.best_so_far[-1] == result.costs.min() <= result.costs[0]
    assert (np.diff(result.best_so_far) <= 0.0).all()


def test_the_same_seed_finds_the_same_gains():
    place = rehearsal(1)
    again = tune_gains(place, by_hand(place), unseen=rehearsal(2), search=SEARCH)
    np.testing.assert_array_equal(again.costs, tuned().costs)
    np.testing.assert_array_equal(again.tuned.kp, tuned().tuned.kp)


def test_unstable_trials_are_stopped_counted_and_kept_out_of_the_result():
    place = rehearsal(1, delay=4e-3)
    law = by_hand(place)
    search = GainSearch(trials=8, span=100.0, seed=1)
    result = tune_gains(place, law, unseen=rehearsal(2, delay=4e-3), search=search)
    assert result.unstable == np.isinf(result.costs).sum() > 0
    assert not result.after.failure
    plain = result.to_dict()
    assert plain["costs"].count(None) == plain["unstable"] == result.unstable
    assert plain["trials"] == 8


def test_noise_delay_and_coarse_encoders_cost_torque_chatter():
    place = rehearsal(1)
    controller = TrackingController(law=by_hand(place))
    noisy = place.judged(controller)
    exact = replace(place.settings, encoder=Encoder(), control_delay=0.0)
    quiet = replace(place, position_noise=0.0, speed_noise=0.0, settings=exact).judged(controller)
    other = replace(place, seed=5).judged(controller)
    assert (noisy.chatter > 1.5 * quiet.chatter).all()
    assert not np.array_equal(noisy.error, other.error)


def test_the_integral_gain_of_a_pid_is_tuned_with_the_others():
    place = rehearsal(1)
    law = by_hand(place)
    pid = PID(kp=law.kp, kd=law.kd, ki=2.0 * law.kp, torque_limit=law.torque_limit)
    result = tune_gains(place, pid, unseen=rehearsal(2), search=GainSearch(trials=4, seed=1))
    assert isinstance(result.tuned, PID)
    best = result.tuned.ki / pid.ki
    assert result.costs.argmin() == 0 or np.ptp(best) > 0.0
    assert result.to_dict()["tuned"]["ki"] == result.tuned.ki.tolist()


def test_cost_is_error_plus_the_price_of_torque_and_chatter():
    one = Judged(error=np.ones(2), effort=np.ones(2), chatter=np.ones(2))
    other = Judged(error=np.array([0.5, 1.5]), effort=np.array([2.0, 2.0]), chatter=np.array([4.0, 0.0]))
    assert other.cost(one, Price(effort=0.1, chatter=0.2)) == pytest.approx(1.0 + 0.2 + 0.4)
    assert replace(other, failure="lost").cost(one, Price()) == np.inf


def test_gains_that_cannot_be_tuned_or_judged_are_refused():
    place, other = rehearsal(1), rehearsal(2)
    law = by_hand(place)
    with pytest.raises(ModelError, match="expected another motion and another seed"):
        tune_gains(place, law, unseen=replace(other, seed=place.seed), search=SEARCH)
    with pytest.raises(ModelError, match="kd to begin with; expected positive gains, got 0"):
        tune_gains(place, PD(kp=law.kp, kd=0.0 * law.kd), unseen=other, search=SEARCH)
    with pytest.raises(SimulationError, match=r"the gains set by hand are unstable; .*the robot is lost"):
        tune_gains(place, PD(kp=np.full(6, 1e-3), kd=np.full(6, 1e-3)), unseen=other, search=SEARCH)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"trials": 1}, "trials of a search for gains; expected at least 2, got 1"),
        ({"span": 0.5}, "span of a search for gains; expected a factor >= 1, got 0.5"),
        ({"price": Price(effort=-1.0)}, "price of effort and chatter"),
    ],
)
def test_impossible_searches_are_refused(settings, message):
    with pytest.raises(ModelError, match=message):
        GainSearch(**settings)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"speed_noise": -1.0}, "noise of a rehearsal; expected deviations >= 0"),
        ({"farthest": 0.0}, "farthest of a rehearsal; expected a positive distance, got 0"),
    ],
)
def test_impossible_rehearsals_are_refused(settings, message):
    with pytest.raises(ModelError, match=message):
        replace(rehearsal(1), **settings)


def test_without_optuna_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "optuna", None)
    place = rehearsal(1)
    with pytest.raises(MissingExtraError, match=r"pip install 'tauhat\[tuning\]'"):
        tune_gains(place, by_hand(place), unseen=rehearsal(2), search=SEARCH)
