"""Feed from rest to rest: derivatives, bounds and ends."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauhat.control.force import FeedProfile
from tauhat.errors import ControlError

some = st.floats(0.01, 2.0)


@given(half=some, speed=some, acceleration=some)
def test_a_pass_runs_from_end_to_end_within_its_speed_and_acceleration(half: float, speed: float, acceleration: float):
    profile = FeedProfile(half=half, speed=speed, acceleration=acceleration)
    t = np.linspace(0.0, profile.duration, 2001)
    s, ds = np.array([profile.at(float(time)) for time in t]).T
    step = t[1]
    assert [s[0], ds[0]] == pytest.approx([-half, 0.0], abs=1e-12)
    assert [s[-1], ds[-1]] == pytest.approx([half, 0.0], abs=1e-12)
    assert ds.min() >= 0.0
    assert ds.max() <= speed * (1.0 + 1e-12)
    assert np.abs(np.diff(ds)).max() <= acceleration * step * (1.0 + 1e-9)
    jerk = 2.0 * acceleration**2 / ds.max()  # and the error of the trapezoidal rule with it
    np.testing.assert_allclose(np.diff(s), 0.5 * step * (ds[1:] + ds[:-1]), atol=step**3 / 12.0 * jerk * 1.01 + 1e-12)


def test_a_long_pass_reaches_its_speed_with_its_acceleration_and_a_short_one_does_not():
    t, step = np.linspace(0.0, 1.0, 10001), 1e-4
    for half, reached in ((0.15, 0.05), (1e-3, np.sqrt(4e-3 * 0.2 / np.pi))):
        profile = FeedProfile(half=half, speed=0.05, acceleration=0.2)
        ds = np.array([profile.at(float(time))[1] for time in t])
        assert ds.max() == pytest.approx(reached, rel=1e-6)
        assert np.diff(ds).max() / step == pytest.approx(0.2, rel=1e-3)


def test_outside_its_time_a_pass_rests_at_its_ends():
    profile = FeedProfile(half=0.1, speed=0.05, acceleration=0.2)
    assert profile.at(-1.0) == (-0.1, 0.0)
    assert profile.at(profile.duration + 1.0) == (0.1, 0.0)


def test_a_profile_without_length_is_refused():
    with pytest.raises(ControlError, match="feed profile: half is not positive"):
        FeedProfile(half=0.0, speed=0.05, acceleration=0.2)
