"""Error budgets of rehearsed experiments: every cause gets what it makes, and all of it together is the whole."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import permutations

import numpy as np
import pytest

from tauhat.arrays import FloatArray
from tauhat.errors import ModelError
from tauhat.excitation import random_fourier
from tauhat.robots import load_robot
from tauhat.simulation import ExperimentSettings
from tauhat.simulation.closed_loop import Encoder
from tauhat.simulation.heat import FrictionHeat
from tauhat.simulation.planned_experiment import PlannedExperiment
from tauhat.simulation.sensors import Ripple, SensorErrors, sensor_preset
from tauhat.studies.error_budget import typical_experiment
from tauhat.verification.error_budget import (
    CAUSES,
    BudgetMotions,
    BudgetSettings,
    Case,
    CauseShare,
    ErrorBudget,
    Measure,
    RobotBudget,
    causes_of,
    error_budget,
)
from tauhat.verification.error_budget.budget import budget_of
from tauhat.verification.error_budget.causes import switched_off
from tauhat.workers import LocalWorkers

ARM = load_robot("two_link")
HERE = LocalWorkers(count=1)
ALWAYS = {"differentiation", "conditioning"}
GAINS = SensorErrors(torque_factor=1.1)
HEAT = FrictionHeat(
    heating=np.zeros(2), time_constant=np.full(2, 1e3), viscous=np.full(2, -0.03), coulomb=np.full(2, -0.02),
    initial=np.full(2, 20.0),
)  # fmt: skip


def motions() -> BudgetMotions:
    fitted, further, unseen = (
        random_fourier(ARM, period=4.0, harmonics=3, rng=np.random.default_rng(seed)) for seed in range(3)
    )
    return BudgetMotions(fitted=fitted, further=further, unseen=unseen)


def settings(experiment: PlannedExperiment, *, seeds: int = 1) -> BudgetSettings:
    return BudgetSettings(experiment=experiment, motions=motions(), terms="plain", seeds=seeds, warmer=20.0)


def planned(sensors: SensorErrors, *, heat: FrictionHeat | None = None, friction: str = "plain") -> PlannedExperiment:
    how = ExperimentSettings(sample_rate=250.0, sensors=sensors)
    return PlannedExperiment(robot=ARM, settings=how, heat=heat, friction=friction)


@cache
def clean() -> ErrorBudget:
    return error_budget(settings(planned(SensorErrors())), HERE)


@cache
def with_wrong_gains() -> ErrorBudget:
    return error_budget(settings(planned(GAINS), seeds=2), HERE)


def of(budget: ErrorBudget, key: str) -> CauseShare:
    (found,) = (share for share in budget.shares if share.key == key)
    return found


def test_a_clean_rehearsal_has_hardly_any_error():
    assert {share.key for share in clean().shares} == ALWAYS
    assert clean().error < 3e-3
    assert clean().on_log < 3e-3


def test_the_only_cause_gets_nearly_all_of_the_error():
    budget = with_wrong_gains()
    assert budget.shares[0].key == "gains"
    assert budget.error == pytest.approx(0.1, rel=0.05)
    assert budget.shares[0].share > 0.95
    assert budget.shares[0].error_without < 3e-3


def test_no_log_shows_a_wrong_torque_constant():
    assert with_wrong_gains().on_log < 0.05 * with_wrong_gains().error
    assert of(with_wrong_gains(), "gains").on_log == pytest.approx(0.0, abs=0.01)


def test_heat_alone_gets_nearly_all_of_the_error():
    budget = error_budget(settings(planned(SensorErrors(), heat=HEAT)), HERE)
    assert budget.shares[0].key == "temperature"
    assert budget.shares[0].share > 0.9
    assert "+20 K" in budget.shares[0].advice


def test_friction_alone_is_named_with_the_term_that_lacks():
    budget = error_budget(settings(planned(SensorErrors(), friction="viscous-asymmetry")), HERE)
    assert budget.shares[0].key == "friction"
    assert of(budget, "friction").removed > 0.95
    assert "no viscous-asymmetry" in of(budget, "friction").advice


def test_without_noise_nothing_is_left_of_an_error_of_noise_and_a_motion_that_magnifies_it():
    budget = error_budget(settings(planned(SensorErrors(torque_noise=3.0))), HERE)
    noise, conditioning = of(budget, "noise"), of(budget, "conditioning")
    assert noise.removed > 0.95
    assert conditioning.alone < 0.05 < conditioning.share
    assert noise.share + conditioning.share > 0.9


def test_switching_off_what_is_not_there_changes_nothing():
    idle = replace(GAINS, ripples=(Ripple(amplitude=0.0, order=2.0),), lost_run=3.0, torque_drift=0.0)
    again = error_budget(settings(planned(idle), seeds=2), HERE)
    assert again.to_dict() == with_wrong_gains().to_dict()


def test_causes_that_are_not_there_are_told():
    assert CAUSES["elasticity"].title in clean().absent
    assert CAUSES["gains"].title not in with_wrong_gains().absent


def case_of(experiment: PlannedExperiment) -> Case:
    drawn = experiment.settings.sensors.drawn(experiment.robot.n_v, np.random.default_rng(0))
    return Case(experiment=replace(experiment, settings=replace(experiment.settings, sensors=drawn)))


@pytest.mark.parametrize("preset", ["low-cost", "industrial-arm", "cobot"])
def test_with_every_cause_off_none_is_left(preset):
    typical = typical_experiment(ARM)
    encoder = Encoder(side="motor", step=1e-5)
    how = replace(typical.settings, encoder=encoder, sensors=sensor_preset(preset, ARM))
    case = case_of(replace(typical, settings=how))
    keys = [cause.key for cause in causes_of(case)]
    assert len(keys) >= len(CAUSES) - 1
    assert causes_of(switched_off(case, keys)) == ()
    for key in keys:
        left = [cause.key for cause in causes_of(switched_off(case, [key]))]
        assert left == [other for other in keys if other != key]


def test_a_typical_experiment_has_every_cause_but_the_clock():
    assert {cause.key for cause in causes_of(case_of(typical_experiment(ARM)))} == set(CAUSES) - {"clock"}


def test_noise_of_a_velocity_that_differs_from_joint_to_joint_is_noise():
    case = case_of(planned(SensorErrors(velocity_noise=np.array([0.0, 1e-3]))))
    assert "noise" in {cause.key for cause in causes_of(case)}
    assert np.all(switched_off(case, ["noise"]).sensors.velocity_noise == 0.0)


def synthetic(errors: dict[str, FloatArray], floor: FloatArray, seed: int) -> RobotBudget:
    """Return a robot whose error is a sum of vectors, one a cause, so that causes work together in pairs only."""

    def measure(keys: set[str]) -> Measure:
        size = float(np.linalg.norm(floor + sum((errors[key] for key in keys), np.zeros(floor.size))))
        return Measure(size, 2.0 * size, 10.0)

    every = set(errors)
    return RobotBudget(
        seed=seed,
        whole=measure(every),
        clean=measure(set()),
        without={key: measure(every - {key}) for key in errors},
        alone={key: measure({key}) for key in errors},
        cutoff=10.0,
    )


def shapley(errors: dict[str, FloatArray], floor: FloatArray, key: str) -> float:
    """Return the mean of what a cause adds to the squared error over all orders in which the causes could come."""
    added = []
    for order in permutations(errors):
        before = floor + sum((errors[other] for other in order[: order.index(key)]), np.zeros(floor.size))
        added.append(np.sum((before + errors[key]) ** 2) - np.sum(before**2))
    return float(np.mean(added) / np.sum((floor + sum(errors.values(), np.zeros(floor.size))) ** 2))


def test_where_errors_add_up_shares_are_shapley_values_and_make_the_whole():
    rng = np.random.default_rng(4)
    keys = ("noise", "conditioning", "gains", "friction")
    robots = [(dict(zip(keys, rng.normal(size=(4, 20)), strict=True)), 0.3 * rng.normal(size=20)) for _ in range(3)]
    budget = budget_of(settings(planned(GAINS)), [synthetic(*robot, seed) for seed, robot in enumerate(robots)])
    for share in budget.shares:
        expected = [shapley(*robot, share.key) for robot in robots]
        assert share.share == pytest.approx(np.mean(expected), rel=1e-9)
        assert share.on_log == pytest.approx(share.share, rel=1e-9)
        assert share.low <= share.share <= share.high
    assert budget.rest == pytest.approx(0.0, abs=1e-9)
    assert budget.floor + sum(share.share for share in budget.shares) == pytest.approx(1.0, rel=1e-9)
    shares = [share.share for share in budget.shares]
    assert shares == sorted(shares, reverse=True)


def test_robots_without_a_model_are_left_out_and_counted():
    vectors = {"noise": np.ones(3), "conditioning": 2.0 * np.ones(3)}
    good, failed = synthetic(vectors, np.zeros(3), 0), RobotBudget(seed=1, failure="fell over")
    budget = budget_of(settings(planned(GAINS)), [good, failed])
    assert budget.error == good.whole.error
    assert budget.to_dict()["failures"] == ["fell over"]
    with pytest.raises(ModelError, match=r"no robot gave all its models.*fell over"):
        budget_of(settings(planned(GAINS)), [failed])


def test_a_robot_that_cannot_be_run_says_why():
    experiment = planned(SensorErrors())
    broken = replace(experiment, settings=replace(experiment.settings, encoder=Encoder(step=np.full(3, 1e-5))))
    with pytest.raises(ModelError, match="encoder, step"):
        error_budget(settings(broken), HERE)


@pytest.mark.parametrize(
    ("change", "words"),
    [({"seeds": 0}, "robots"), ({"warmer": 200.0}, "temperature"), ({"terms": "magic"}, "magic")],
)
def test_settings_that_make_no_sense_are_refused(change, words):
    with pytest.raises(ModelError, match=words):
        replace(settings(planned(GAINS)), **change)
