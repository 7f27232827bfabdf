"""Error budgets of logs: noise is what does not repeat, effects are what was put in, the parts make the whole."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tauhat.dynamics import torque_model
from tauhat.errors import ModelError
from tauhat.estimation import identify
from tauhat.estimation.estimate import Estimate
from tauhat.excitation import random_fourier
from tauhat.excitation.repeated import Repeated
from tauhat.recordings import Recording
from tauhat.robots import load_robot
from tauhat.simulation import ExperimentSettings, simulate
from tauhat.simulation.sensors import SensorErrors
from tauhat.simulation.typical import typical_plant
from tauhat.verification.error_budget import LogBudget, log_budget

ARM = load_robot("two_link")
PERIOD = 4.0
NOISE = 2.0  # [Nm]


@cache
def log(kind: str, noise: float, *, seed: int) -> Recording:
    """Return four periods of a motion of the arm whose parameters are always the same, whatever its friction."""
    truth = typical_plant(ARM, kind, rng=np.random.default_rng(1))
    series = random_fourier(ARM, period=PERIOD, harmonics=4, rng=np.random.default_rng(seed))
    settings = ExperimentSettings(sample_rate=250.0, sensors=SensorErrors(torque_noise=noise))
    rng = np.random.default_rng(seed + 100)
    return simulate(ARM, Repeated(series=series, periods=4), rng=rng, parameters=truth, settings=settings).recording


@cache
def estimate() -> Estimate:
    """Return the model of the arm with plain friction, identified without noise."""
    return identify(torque_model(ARM), [log("plain", 0.0, seed=seed) for seed in (0, 1)])


@cache
def noisy(period: float | None) -> LogBudget:
    (budget,) = log_budget(estimate(), [log("plain", NOISE, seed=2)], period=period)
    return budget


def whole(budget: LogBudget) -> float:
    return (
        sum(share.share for share in budget.missing)
        + budget.noise
        + budget.uncertain
        + budget.refitted
        + budget.unnamed
    )


def test_a_right_model_leaves_nothing_but_noise():
    budget = noisy(PERIOD)
    assert (budget.source, budget.periods, budget.missing) == ("periods", 3, ())
    assert budget.noise == pytest.approx(1.0, abs=0.1)


def test_noise_that_does_not_repeat_is_as_large_as_it_was_made():
    budget, processing = noisy(PERIOD), estimate().processing
    kernel = processing.parallel_filter(250.0).kernel
    recording = log("plain", NOISE, seed=2)
    torque = budget.noise * (budget.relative_rms * np.sqrt(np.mean(recording.tau**2))) ** 2
    assert torque == pytest.approx(NOISE**2 * float(kernel @ kernel), rel=0.25)


def test_without_a_period_white_noise_is_found_in_the_torque_itself():
    budget = noisy(None)
    assert (budget.source, budget.periods) == ("white torque", 0)
    assert budget.noise == pytest.approx(noisy(PERIOD).noise, abs=0.2)


def test_an_effect_that_was_put_in_is_named_and_only_refitted_parameters_take_of_it():
    (budget,) = log_budget(estimate(), [log("viscous-asymmetry", 0.05, seed=2)], period=PERIOD)
    assert budget.missing[0].effect == "friction by direction"
    assert budget.missing[0].share > 0.05
    assert budget.missing[0].share + budget.refitted > 0.95
    assert budget.uncertain < 0.01
    assert budget.missing[0].term == "viscous-asymmetry"
    assert {name for name, _ in budget.missing[0].joints} <= set(ARM.joint_names)
    assert budget.noise < 0.05
    assert whole(budget) == pytest.approx(1.0, abs=1e-9)


def test_the_parts_make_the_whole():
    assert whole(noisy(PERIOD)) == pytest.approx(1.0, abs=1e-9)
    assert sum(share for _, share in noisy(PERIOD).joints) == pytest.approx(1.0)


def test_parameters_that_noise_left_uncertain_are_told_from_what_has_no_name():
    rough = identify(torque_model(ARM), [log("plain", NOISE, seed=3).rows(0, 1000)])
    (budget,) = log_budget(rough, [log("plain", 0.0, seed=2)], period=PERIOD)
    assert budget.noise < 0.01
    assert budget.uncertain > 0.3


@pytest.mark.parametrize("period", [0.0, -1.0, float("nan"), 9.0])
def test_a_period_that_the_log_has_not_twice_is_refused(period):
    with pytest.raises(ModelError, match="period"):
        log_budget(estimate(), [log("plain", NOISE, seed=2)], period=period)
