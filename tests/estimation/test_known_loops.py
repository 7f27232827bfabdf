"""A loop that is known: what its law adds ahead, which clock its reference is on, and when its passes may end."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from simulated_logs import LATE, LAW, RATE, SECONDS, driven, planar_base, problem

from sample_arms import Truth, motion_from_rest, planar_truth
from tauhat.control import PD, PDFeedforward
from tauhat.dynamics.nominal import nominal_standard_parameters
from tauhat.dynamics.simulated_arm import Followed, Gains, Stepping, follow, simulated_arm
from tauhat.errors import ModelError
from tauhat.estimation.closed_loop import ClosedLoop, SampledReference
from tauhat.estimation.didim import DirectInverse
from tauhat.estimation.output_error import ClosedLoopInputError, ClosedLoopOutputError
from tauhat.estimation.simulated_runs import simulated_runs
from tauhat.estimation.simulating import Found, tried_in
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording

HEAVIER = 1.25  # links of the arm over those that its controller knows


@cache
def fed_forward() -> tuple[Recording, ClosedLoop, np.ndarray]:
    """Return the log of an arm heavier than its controller thinks, the loop, and the true base parameters."""
    truth = planar_truth()
    standard = np.concatenate([HEAVIER * truth.standard[:20], truth.standard[20:]])
    known = Truth(truth.model, nominal_standard_parameters(truth.model))
    t = np.arange(0.0, SECONDS, 1.0 / RATE)
    q, dq, ddq = motion_from_rest(2, t, seed=3)
    law = PDFeedforward(kp=LAW.kp, kd=LAW.kd)
    moved = follow(
        simulated_arm(truth.model), standard, Followed(q, dq, known.torque(q, dq, ddq)),
        gains=Gains(law.kp, law.kd, law.integral_gain, law.torque_limit), start=np.array([q[0], dq[0]]),
        stepping=Stepping(1.0 / RATE, 8, 0, "runge-kutta"),
    )  # fmt: skip
    rng = np.random.default_rng(0)
    log = Recording(
        t=t,
        q=moved.q.T + 1e-5 * rng.normal(size=q.shape),
        tau=moved.tau.T + 0.01 * rng.normal(size=q.shape),
        name="fed forward",
    )
    loop = ClosedLoop(law=law, references=(SampledReference(t=t, q=q, dq=dq, ddq=ddq),))
    return log, loop, planar_base().projection @ standard


@pytest.mark.parametrize("method", [ClosedLoopInputError, ClosedLoopOutputError])
def test_a_feedforward_of_the_descriptions_model_does_not_hide_the_arms_own(method):
    log, loop, expected = fed_forward()
    solution = method(loop=loop, threads=1).fit_problem(problem(log))
    assert solution.cause.startswith("converged")
    assert np.abs(solution.values - expected).max() < 0.01 * np.abs(expected).max()
    assert np.abs((solution.values - expected) / np.maximum(np.abs(expected), 0.05)).max() < 0.02


def test_a_delay_of_the_torque_does_not_delay_the_position_against_the_reference():
    arm = driven()
    log = arm.recording(np.random.default_rng(0), position=1e-6, torque=1e-3)
    late = Processing(cutoff=LATE.cutoff, motion_cutoff=LATE.motion_cutoff, delay=2e-3)
    method = ClosedLoopOutputError(loop=arm.loop, threads=1)
    prompt, delayed = (method.fit_problem(problem(log, processing=own)) for own in (LATE, late))
    assert np.abs(prompt.values - arm.values).max() < 0.01 * np.abs(arm.values).max()
    assert np.abs(delayed.values - prompt.values).max() < 0.01 * np.abs(arm.values).max()


def test_a_measured_reference_is_on_the_clock_of_the_position_it_is_made_of():
    arm = driven()
    log = arm.recording(np.random.default_rng(0), position=0.0, torque=1e-3)
    late = Processing(cutoff=LATE.cutoff, motion_cutoff=LATE.motion_cutoff, delay=8e-3)
    run = simulated_runs(problem(log, processing=late), ClosedLoop(reference_cutoff=90.0)).runs[0]
    assert np.abs(run.q - run.q_ref.T).max() < 1e-3 * np.abs(run.q).max()


def test_a_cascade_that_starts_in_motion_starts_at_its_measured_speed():
    arm = driven()
    log = arm.recording(np.random.default_rng(0)).rows(400, 1200)
    given = arm.loop.references[0]
    none = np.zeros_like(given.dq)
    cascade = ClosedLoop(law=PD(kp=LAW.kp, kd=LAW.kd), references=(
        SampledReference(t=given.t, q=given.q, dq=none, ddq=none),
    ))  # fmt: skip
    run = simulated_runs(problem(log), cascade).runs[0]
    assert np.abs(given.dq[400]).max() > 0.5
    np.testing.assert_allclose(run.start[1], arm.moved.dq[:, 400], atol=0.05)


def test_a_logged_reference_is_at_rest_outside_its_time():
    t = np.array([1.0, 2.0])
    reference = SampledReference(t=t, q=[[0.0], [1.0]], dq=[[1.0], [1.0]], ddq=[[0.5], [0.5]])
    asked = reference.sample(np.array([0.9, 1.0, 1.5, 2.0, 2.0 + 1e-12, 2.1]))
    np.testing.assert_array_equal(asked.q[:, 0], [0.0, 0.0, 0.5, 1.0, 1.0, 1.0])
    np.testing.assert_array_equal(asked.dq[:, 0], [0.0, 1.0, 1.0, 1.0, 1.0, 0.0])
    np.testing.assert_array_equal(asked.ddq[:, 0], [0.0, 0.5, 0.5, 0.5, 0.5, 0.0])


def test_a_logged_reference_without_samples_is_refused():
    none = np.zeros((0, 2))
    with pytest.raises(ModelError, match=r"reference: too few samples; expected at least 2, got 0"):
        SampledReference(t=[], q=none, dq=none, ddq=none)


class Refusing(DirectInverse):
    """A method whose steps never lower anything."""

    def accepts(self, runs, before, after) -> bool:  # noqa: ARG002
        return False


class Halving(DirectInverse):
    """A method that asks for the double of its values and gets a sixteenth of the way."""

    def improved(self, runs, tried) -> Found:
        found = super().improved(runs, tried)
        return found._replace(values=tried.values + 0.3 * found.values)

    def accepts(self, runs, before, after) -> bool:  # noqa: ARG002
        return bool(np.linalg.norm(after.values - before.values) < 0.02 * np.linalg.norm(before.values))


def test_a_step_of_which_no_part_is_taken_is_no_convergence():
    arm = driven()
    log = arm.recording(np.random.default_rng(0), position=1e-3)
    solution = Refusing(loop=arm.loop).fit_problem(problem(log))
    assert solution.passes == 1
    assert solution.cause.startswith("stopped in pass 1: no part of its step, ")
    assert solution.advice


def test_a_step_that_is_taken_in_part_is_no_convergence():
    arm = driven()
    given = problem(arm.recording(np.random.default_rng(0)))
    method = Halving(loop=arm.loop, most_passes=2, tolerance=0.9)
    runs = simulated_runs(given, arm.loop)
    tried = tried_in(runs, method.inner.solve(given.evidence).values)
    assert np.linalg.norm(method.improved(runs, tried).values - tried.values) > 0.2 * np.linalg.norm(tried.values)
    assert method.fit_problem(given).cause.startswith("stopped after 2 passes")


def test_a_joint_without_torque_spoils_no_sensitivity():
    log = driven().recording(np.random.default_rng(0))
    silent = Recording(t=log.t, q=log.q, tau=log.tau * [1.0, 0.0], name="one motor logged")
    method = ClosedLoopInputError(threads=1)
    runs = simulated_runs(problem(silent), method.loop)
    found = method.improved(runs, tried_in(runs, driven().values))
    assert np.isfinite(found.values).all()
