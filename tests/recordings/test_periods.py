"""Averaging of periods: noise falls with the square root of their number, the motion stays what it was."""

from __future__ import annotations

import numpy as np
import pytest

from tauhat.errors import RecordingError
from tauhat.recordings import Recording, average_periods

PERIOD, STEP, NOISE = 2.0, 0.01, 0.5


def repeated(periods: int, *, noise: float = NOISE) -> Recording:
    t = 3.0 + STEP * np.arange(round(periods * PERIOD / STEP))
    phase = 2.0 * np.pi * t / PERIOD
    q = np.column_stack([np.sin(phase), 0.5 * np.cos(2 * phase)])
    tau = 4.0 * q + noise * np.random.default_rng(0).normal(size=q.shape)
    return Recording(t=t, q=q, tau=tau)


def test_noise_is_measured_between_periods_and_divided_by_the_root_of_their_number():
    average = average_periods(repeated(26), period=PERIOD)
    one = average.recording
    assert average.periods == 25
    assert one.n_t == 200
    assert average.torque_noise == pytest.approx([NOISE, NOISE], rel=0.1)
    assert np.std(one.tau - 4.0 * one.q) == pytest.approx(NOISE / 5.0, rel=0.15)
    assert average.position_spread.max() < 1e-12


def test_the_average_of_a_clean_motion_is_the_motion():
    clean = repeated(3, noise=0.0)
    one = average_periods(clean, period=PERIOD, skip=0).recording
    assert np.allclose(one.q, clean.q[:200], atol=1e-12)
    assert np.allclose(one.t, clean.t[:200], atol=1e-12)
    assert one.dq is None


def test_less_than_two_periods_are_refused():
    with pytest.raises(RecordingError, match=r"fewer than two whole periods.*expected >= 6 s, got 3.99 s"):
        average_periods(repeated(2), period=PERIOD)
    with pytest.raises(RecordingError, match="period must be positive"):
        average_periods(repeated(2), period=-1.0)
