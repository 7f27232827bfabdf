"""The clocks of the filters that integrate: torque at the time of its motion, and steps no longer than asked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rough_logs import EXPECTED, TRUTH, problem_of
from scipy.integrate import quad

from tauhat.errors import ModelError, TauhatWarning
from tauhat.estimation.filters.adaptive import AdaptiveInputError
from tauhat.estimation.filters.samples import motion_samples
from tauhat.estimation.filters.state_filter import StateKalman
from tauhat.estimation.filters.state_plan import StateNoise, clocked_recording
from tauhat.recordings.recording import Recording


def ramp(rate: float) -> Recording:
    """Return two joints whose position and torque rise with time alike."""
    t = np.arange(0.0, 2.0, 1.0 / rate)
    rising = np.column_stack([t, 2.0 * t])
    return Recording(t=t, q=rising, tau=10.0 * rising, name="ramp")


@pytest.mark.parametrize("rate", [250.0, 500.0, 750.0, 1000.0])
def test_averaged_torque_is_that_at_the_time_of_the_motion(rate):
    log = ramp(rate)
    motion = motion_samples(problem_of(TRUTH.recording(seconds=4.0)), log, rate=250.0)
    np.testing.assert_allclose(np.diff(motion.t), 1.0 / 250.0)
    np.testing.assert_allclose(motion.tau[0], 10.0 * motion.t, atol=1e-9)
    np.testing.assert_allclose(motion.tau, 10.0 * motion.q, atol=1e-6)


def test_the_adaptive_estimate_does_not_depend_on_the_rate_of_the_log():
    method = AdaptiveInputError(time=2.0, passes=2)
    logs = (TRUTH.recording(seconds=8.0, rate=rate) for rate in (250.0, 1000.0))
    slow, fast = (method.fit_problem(problem_of(log)).values for log in logs)
    assert np.abs((fast - slow) / np.maximum(np.abs(EXPECTED), 0.05)).max() < 0.005


@pytest.mark.parametrize(("rate", "steps"), [(30.0, 9), (100.0, 6), (250.0, 5), (1000.0, 5)])
def test_no_step_of_a_state_filter_is_longer_than_asked(rate, steps):
    t = np.arange(0.0, 4.0, 1.0 / rate)
    tau = np.column_stack([np.sin(3.0 * t), np.cos(2.0 * t)])
    clocked = clocked_recording(Recording(t=t, q=tau, tau=tau, name="waves"), 0.0, rate=50.0, longest_step=4e-3)
    assert clocked.tau.shape[1] == steps
    assert clocked.step <= 4e-3 + 1e-12
    assert clocked.step * steps == pytest.approx(clocked.time)
    np.testing.assert_allclose(np.diff(clocked.t), clocked.time)
    begin, end = clocked.t[7], clocked.t[8]
    mean, _ = quad(lambda s: np.interp(s, t, tau[:, 0]), begin, end, points=t[(t > begin) & (t < end)], limit=200)
    assert clocked.tau[7].mean(axis=0)[0] == pytest.approx(mean / (end - begin), abs=1e-3)


def test_a_log_slower_than_the_integration_is_filtered_all_the_same():
    rng = np.random.default_rng(0)
    log = TRUTH.recording(rate=50.0)
    size = log.q.shape
    noisy = replace(log, dq=None, q=log.q + 1e-5 * rng.normal(size=size), tau=log.tau + 0.05 * rng.normal(size=size))
    problem = problem_of(noisy)
    problem = replace(problem, processing=replace(problem.processing, motion_cutoff=20.0))
    solution = StateKalman().fit_problem(problem)
    assert solution.cause == "last sample reached"
    assert np.abs((solution.values - EXPECTED) / np.maximum(np.abs(EXPECTED), 0.2)).max() < 0.1


def test_a_filter_that_runs_away_ends_with_a_cause_and_finite_values():
    log = TRUTH.recording()
    torn = np.array(log.tau)
    torn[2500:] *= -40.0
    with pytest.warns(TauhatWarning, match="diverged at"):
        solution = StateKalman().fit_problem(problem_of(replace(log, tau=torn)))
    assert solution.advice.startswith("do not use these values")
    assert np.isfinite(solution.values).all()
    assert np.isfinite(solution.covariance).all()


def test_noise_without_end_is_refused():
    with pytest.raises(ModelError, match=r"noise of the torque; expected 2 positive values"):
        StateNoise(torque=(1.0, np.inf)).chosen("torque", np.ones(2))
