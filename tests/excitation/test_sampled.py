"""Motions read back from samples, and motions run several times."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import BPoly

from tauhat.errors import ExcitationError
from tauhat.excitation import MotionSamples, Repeated, SampledMotion, random_fourier, sampled_motion
from tauhat.recordings.recording import Recording
from tauhat.robots import load_robot

ROBOT = load_robot("two_link")
SERIES = random_fourier(ROBOT, period=6.0, harmonics=4, rng=np.random.default_rng(2))


def recorded(rate: float) -> Recording:
    samples = SERIES.sample(np.arange(int(6 * rate) + 1) / rate)
    return Recording(t=samples.t + 100.0, q=samples.q, dq=samples.dq, ddq=samples.ddq)


def test_between_samples_the_motion_is_the_quintic_hermite_interpolant():
    rng = np.random.default_rng(0)
    t = np.concatenate([[0.0], np.cumsum(rng.uniform(0.05, 0.3, 20))])
    q, dq, ddq = rng.normal(size=(3, 21, 2))
    motion = SampledMotion(samples=MotionSamples(t=t, q=q, dq=dq, ddq=ddq))
    oracle = BPoly.from_derivatives(t, np.stack([q, dq, ddq], axis=1))
    found = motion.sample(times := np.linspace(0.0, t[-1], 500))
    for order, values in enumerate((found.q, found.dq, found.ddq)):
        expected = oracle.derivative(order)(times) if order else oracle(times)
        assert np.allclose(values, expected, rtol=1e-8, atol=1e-9 * np.abs(expected).max())


def test_a_motion_read_from_a_file_is_the_motion_written_to_sixth_order():
    times = np.linspace(0.0, 6.0, 1234)
    exact = SERIES.sample(times).q
    errors = [np.abs(sampled_motion(recorded(rate)).sample(times).q - exact).max() for rate in (25.0, 50.0)]
    assert errors[1] < 1e-7
    assert 40 < errors[0] / errors[1] < 90  # 2^6
    assert sampled_motion(recorded(25.0)).duration == pytest.approx(6.0)


def test_a_file_without_velocities_is_refused():
    with pytest.raises(ExcitationError, match=r"velocities and accelerations.*q, dq; write it with tauhat excite"):
        sampled_motion(replace(recorded(25.0), ddq=None))


@pytest.mark.parametrize("t", [[0.0], [1.0, 2.0], [0.0, 1.0, 1.0]])
def test_samples_that_are_no_motion_are_refused(t):
    zeros = np.zeros((len(t), 1))
    with pytest.raises(ExcitationError, match="increasing times from 0"):
        SampledMotion(samples=MotionSamples(t=np.array(t), q=zeros, dq=zeros, ddq=zeros))


def test_a_repeated_motion_runs_on_without_a_jump():
    whole = Repeated(series=SERIES, periods=3)
    assert (whole.n_v, whole.duration) == (2, 18.0)
    near = whole.sample(np.array([6.0 - 1e-6, 6.0 + 1e-6, 18.0]))
    assert np.abs(near.q - SERIES.sample(np.zeros(1)).q).max() < 1e-9
    assert np.abs(near.ddq).max() < 1e-2
    with pytest.raises(ExcitationError, match="at least once"):
        Repeated(series=SERIES, periods=0)
