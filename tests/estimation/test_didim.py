"""DIDIM: no bias from position noise or filters, stops with a reason, and what it needs to know."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace

import numpy as np
import pytest
from simulated_logs import LATE, LAW, SEEDS, driven, errors_of, problem, relative_bias

from tauhat.control import PD, PID
from tauhat.errors import ModelError, SimulationError
from tauhat.estimation import (
    OrdinaryLeastSquares,
    PhysicalConstraints,
    WeightedLeastSquares,
    identify,
    load_estimate,
)
from tauhat.estimation.closed_loop import ClosedLoop, SampledReference
from tauhat.estimation.didim import DirectInverse
from tauhat.estimation.simulated_runs import simulated_runs
from tauhat.estimation.simulating import tried_in
from tauhat.recordings.processing import Processing


def test_twenty_seeds_of_position_noise_bias_least_squares_and_not_didim():
    plain, _ = errors_of(OrdinaryLeastSquares())
    assert np.abs(relative_bias(plain)).max() > 0.5
    errors, inside = errors_of(DirectInverse(loop=driven().loop))
    assert np.abs(relative_bias(errors)).max() < 5e-3
    score = errors.mean(axis=0) / (errors.std(axis=0, ddof=1) / np.sqrt(SEEDS))
    assert np.abs(score).max() < 4.0
    assert 0.9 < inside.mean() <= 1.0


def test_a_low_pass_of_the_position_that_is_far_too_low_biases_least_squares_and_not_didim():
    slow = Processing(cutoff=20.0, motion_cutoff=1.0)
    plain, _ = errors_of(OrdinaryLeastSquares(), position=0.0, torque=0.01, processing=slow, seeds=4)
    assert np.abs(relative_bias(plain)).max() > 0.1
    errors, _ = errors_of(DirectInverse(loop=driven().loop), position=0.0, torque=0.01, processing=slow, seeds=4)
    assert np.abs(relative_bias(errors)).max() < 2e-2


def test_it_says_why_it_ended():
    log = driven().recording(np.random.default_rng(0), position=1e-4)
    solution = DirectInverse(loop=driven().loop).fit_problem(problem(log))
    assert solution.cause.startswith(f"converged after {solution.passes} passes: the last pass moved the torque by")
    assert solution.advice == ""
    short = DirectInverse(loop=driven().loop, most_passes=1, tolerance=1e-9).fit_problem(problem(log))
    assert short.cause.startswith("stopped after 1 pass:")
    assert "law, gains and reference" in short.advice


def test_without_law_and_reference_the_measured_motion_is_followed():
    arm = driven()
    solution = DirectInverse().fit_problem(problem(arm.recording(np.random.default_rng(0))))
    assert np.abs(solution.values - arm.values).max() < 0.1 * np.abs(arm.values).max()


def test_an_unstable_controller_stops_with_a_reason():
    log = driven().recording(np.random.default_rng(0))
    law = PID(kp=LAW.kp, kd=np.full(2, 0.1), ki=np.full(2, 1e5))
    with pytest.raises(SimulationError, match=r"joint j\d, t = .*: the simulated robot went unstable"):
        DirectInverse(loop=ClosedLoop(law=law)).fit_problem(problem(log))


def test_a_law_that_does_not_follow_the_log_stops_with_a_reason():
    log = driven().recording(np.random.default_rng(0))
    weak = PD(kp=np.full(2, 0.1), kd=np.full(2, 0.1))
    with pytest.raises(SimulationError, match=r"driven: the simulated robot does not follow.*check the law's gains"):
        DirectInverse(loop=ClosedLoop(law=weak)).fit_problem(problem(log))


def test_first_values_that_move_no_robot_are_replaced_by_those_of_consistent_bodies():
    arm = driven()
    noisy = problem(arm.recording(np.random.default_rng(0), position=5e-3))
    runs = simulated_runs(noisy, arm.loop)
    with pytest.raises((ModelError, SimulationError)):
        tried_in(runs, WeightedLeastSquares().solve(noisy.evidence).values)
    solution = DirectInverse(loop=arm.loop).fit_problem(noisy)
    assert np.abs(solution.values - arm.values).max() < 0.02 * np.abs(arm.values).max()


@dataclass(frozen=True, slots=True, kw_only=True)
class Misled(DirectInverse):
    """Passes that lead to no robot from wherever the first values are those of least squares."""

    def improved(self, runs, tried):
        found = super(Misled, self).improved(runs, tried)
        misled = np.array_equal(tried.values, self.inner.solve(runs.problem.evidence).values)
        return found._replace(values=-1e3 * found.values) if misled else found


@dataclass(frozen=True, slots=True, kw_only=True)
class Lost(Misled):
    """The same, and no consistent bodies fit either."""

    def linear_problem(self, runs, found):  # noqa: ARG002
        raise ModelError("no bodies")


def test_values_that_move_no_robot_give_way_to_those_of_consistent_bodies():
    arm = driven()
    log = arm.recording(np.random.default_rng(0), position=1e-4)
    solution = Misled(loop=arm.loop, most_passes=1).fit_problem(problem(log))
    assert solution.cause.endswith("values of consistent bodies, because the free ones move no robot")
    assert np.abs(solution.values - arm.values).max() < 0.01 * np.abs(arm.values).max()
    assert solution.passes == 1


def test_passes_that_lead_to_no_robot_begin_again_at_the_nominal_one():
    arm = driven()
    log = arm.recording(np.random.default_rng(0), position=1e-4)
    solution = Lost(loop=arm.loop).fit_problem(problem(log))
    assert solution.cause.startswith("converged after")
    assert np.abs(solution.values - arm.values).max() < 0.01 * np.abs(arm.values).max()


def test_a_physically_consistent_form_is_one_more_constraint_on_the_last_pass():
    arm = driven()
    log = arm.recording(np.random.default_rng(0), position=1e-4)
    model = arm.truth.model
    estimate = identify(
        model, [log], estimator=DirectInverse(loop=arm.loop), processing=LATE, constraints=PhysicalConstraints()
    )
    assert min(estimate.physical["margins"]) > 0.0
    assert np.abs(estimate.base.projection @ estimate.standard - estimate.values).max() < 1e-9
    assert np.abs(estimate.values - arm.values).max() < 0.01 * np.abs(arm.values).max()


def test_the_estimate_file_tells_law_and_reference(tmp_path):
    arm = driven()
    log = arm.recording(np.random.default_rng(0))
    estimate = identify(arm.truth.model, [log], estimator=DirectInverse(loop=arm.loop), processing=LATE)
    estimate.save(tmp_path / "estimate.json")
    told = load_estimate(tmp_path / "estimate.json").estimator
    assert told["name"] == "didim"
    gains = {"kp": [500.0, 200.0], "kd": [40.0, 15.0], "ki": [0.0, 0.0]}
    assert told["loop"]["law"] == {"law": "pd-gravity", **gains, "torque_limit": [None, None]}
    assert told["loop"]["file"] is None
    assert told["loop"]["references"] == ["SampledReference"]
    assert json.loads(json.dumps(told["inner"]))["name"] == "wls"


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"bandwidth": 0.0}, "bandwidth must be positive"),
        ({"longest_step": -1.0}, "longest_step must be positive"),
        ({"integrator": "euler"}, "unknown integrator; expected leapfrog or runge-kutta"),
    ],
)
def test_an_impossible_loop_is_refused(settings, message):
    with pytest.raises(ModelError, match=message):
        ClosedLoop(**settings)


def test_laws_and_references_that_do_not_fit_are_refused():
    arm = driven()
    given = problem(arm.recording(np.random.default_rng(0)))
    reference = arm.loop.references[0]
    two = ClosedLoop(references=(reference, reference))
    with pytest.raises(ModelError, match=r"one reference a recording is needed; expected 1, got 2"):
        DirectInverse(loop=two).fit_problem(given)
    one_joint = SampledReference(t=reference.t, q=reference.q[:, :1], dq=reference.dq[:, :1], ddq=reference.ddq[:, :1])
    with pytest.raises(ModelError, match=r"a reference does not fit the log"):
        DirectInverse(loop=ClosedLoop(references=(one_joint,))).fit_problem(given)
    with pytest.raises(ModelError, match=r"the law does not fit the robot; expected 2 joints, got 1"):
        DirectInverse(loop=ClosedLoop(law=PD(kp=[1.0], kd=[1.0]))).fit_problem(given)
    with pytest.raises(ModelError, match=r"time does not increase"):
        replace(reference, t=reference.t[::-1])


@pytest.mark.parametrize("settings", [{"tolerance": 0.0}, {"most_passes": 0}, {"ridge": -1.0}])
def test_impossible_settings_are_refused(settings):
    with pytest.raises(ModelError):
        DirectInverse(**settings)
