"""From a recording to motion on a uniform clock: resampling, gaps, trimming, unwrapping, sources of velocity."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sample_arms import smooth_motion
from tauhat.errors import RecordingError
from tauhat.recordings.processing import (
    Processing,
    Stretch,
    bridged,
    clock_step,
    interpolated,
    moving_joints,
    moving_window,
    stretches,
    unwrapped,
)
from tauhat.recordings.recording import Recording

SETTINGS = Processing(cutoff=10.0, motion_cutoff=30.0)


def moving(t: np.ndarray, **channels) -> Recording:
    q, _, _ = smooth_motion(2, t)
    return Recording(t=t, **({"q": q, "tau": np.cos(q)} | channels))


def whole(recording: Recording, processing: Processing = SETTINGS, *, chunk: int = 4096) -> Stretch:
    parts = list(stretches(recording, processing, chunk=chunk))
    return Stretch(*(np.concatenate(channel, axis=-1) for channel in zip(*parts, strict=True)))


def test_uniform_clock_is_kept_sample_by_sample():
    t = 3.0 + np.arange(1000) * 0.004
    stretch = whole(moving(t))
    assert stretch.t.size == 1000
    assert np.allclose(stretch.t, t, rtol=0, atol=1e-9)
    assert np.allclose(stretch.tau.T, moving(t).tau, rtol=0, atol=1e-9)


def test_motion_is_differentiated_exactly_inside():
    t = np.arange(2000) * 0.005
    _, dq, ddq = smooth_motion(2, t)
    stretch = whole(moving(t))
    inside = slice(100, -100)
    assert np.allclose(stretch.dq.T[inside], dq[inside], atol=1e-3 * np.abs(dq).max())
    assert np.allclose(stretch.ddq.T[inside], ddq[inside], atol=2e-3 * np.abs(ddq).max())


def test_measured_velocity_is_taken_and_differentiated_once():
    t = np.arange(2000) * 0.005
    q, dq, ddq = smooth_motion(2, t)
    settings = Processing(cutoff=10.0, motion_cutoff=30.0, velocity="velocity")
    stretch = whole(moving(t, q=np.zeros_like(q), dq=dq), settings)
    inside = slice(100, -100)
    assert np.array_equal(stretch.q, np.zeros((2, 2000)))
    assert np.allclose(stretch.dq.T[inside], dq[inside], atol=1e-3 * np.abs(dq).max())
    assert np.allclose(stretch.ddq.T[inside], ddq[inside], atol=2e-3 * np.abs(ddq).max())


def test_a_late_position_is_read_that_much_further_on():
    t = np.arange(2000) * 0.005
    late, _, _ = smooth_motion(2, t - 0.02)
    on_time = whole(moving(t))
    mended = whole(moving(t, q=late), Processing(cutoff=10.0, motion_cutoff=30.0, delay=0.02))
    both, theirs, ours = np.intersect1d(np.round(on_time.t, 6), np.round(mended.t, 6), return_indices=True)
    assert both.size > 1900
    assert np.allclose(mended.tau[:, ours], on_time.tau[:, theirs], rtol=0, atol=1e-9)
    assert np.allclose(mended.q[:, ours][:, 100:-100], on_time.q[:, theirs][:, 100:-100], rtol=0, atol=1e-9)


def test_jittered_clock_is_resampled_onto_a_uniform_one():
    rng = np.random.default_rng(0)
    t = np.arange(4000) * 0.002 + rng.uniform(-4e-4, 4e-4, 4000)
    recording = moving(t)
    stretch = whole(recording)
    steps = np.diff(stretch.t)
    assert np.allclose(steps, clock_step(recording), rtol=1e-9)
    q, dq, _ = smooth_motion(2, stretch.t)
    inside = slice(200, -200)
    assert np.allclose(stretch.q.T[inside], q[inside], atol=1e-4)
    assert np.allclose(stretch.dq.T[inside], dq[inside], atol=2e-3 * np.abs(dq).max())


def test_clock_of_a_log_that_loses_every_third_sample_is_that_of_its_whole_parts():
    t = np.delete(np.arange(3000) * 0.001, np.arange(2, 3000, 3))
    recording = moving(t)
    assert clock_step(recording) == pytest.approx(0.001)
    assert whole(recording).t.size == pytest.approx(3000, abs=2)


@given(chunk=st.integers(1, 900))
def test_stretches_are_the_same_whatever_the_chunk(chunk):
    recording = moving(np.arange(800) * 0.005)
    reference, ours = whole(recording), whole(recording, chunk=chunk)
    for first, second in zip(reference, ours, strict=True):
        assert np.allclose(first, second, rtol=0, atol=1e-11 * np.abs(first).max(initial=0.0))


def with_gap(seconds: float) -> Recording:
    t = np.arange(1000) * 0.002
    t[600:] += seconds - 0.002
    return moving(t)


def test_a_gap_is_refused_with_its_row_and_length():
    with pytest.raises(RecordingError, match=r"recording, row 600: the log has a gap .* got 0\.5 s; cut the log there"):
        whole(with_gap(0.5))


@pytest.mark.parametrize("seconds", [0.004, 0.09])
def test_a_few_lost_samples_are_bridged(seconds):
    assert whole(with_gap(seconds)).t[-1] == pytest.approx(0.002 * 998 + seconds, abs=0.002)


def test_a_gap_is_bridged_without_bursts_of_acceleration():
    t = np.arange(2000) * 0.002
    kept = np.ones(t.size, dtype=bool)
    kept[1000:1040] = False
    _, dq, ddq = smooth_motion(2, t)
    stretch = whole(moving(t[kept]))
    inside = slice(200, -200)
    assert np.allclose(stretch.t, t, atol=1e-9)
    assert np.allclose(stretch.dq.T[inside], dq[inside], atol=0.01 * np.abs(dq).max())
    assert np.allclose(stretch.ddq.T[inside], ddq[inside], atol=0.1 * np.abs(ddq).max())


@given(lost=st.integers(1, 20), start=st.integers(0, 60), a=st.floats(-5, 5), b=st.floats(-5, 5))
def test_lost_samples_of_a_parabola_are_put_back_exactly(lost, start, a, b):
    t = np.arange(100) * 0.01
    kept = np.ones(t.size, dtype=bool)
    kept[1 + start + 5 : 1 + start + 5 + lost] = False
    line = (a + b * t + 3.0 * t**2)[:, None]
    times, signals = bridged(t[kept], line[kept], step=0.01)
    assert np.allclose(times, t, rtol=0, atol=1e-12)
    assert np.allclose(signals, line, rtol=0, atol=1e-9)


def test_a_gap_right_at_the_begin_is_bridged_straight():
    t = np.array([0.0, *np.arange(3, 20)])
    times, signals = bridged(t, t[:, None], step=1.0)
    assert np.allclose(times, np.arange(20.0))
    assert np.allclose(signals[:, 0], np.arange(20.0))


def test_a_whole_clock_is_left_alone():
    t = np.arange(50) * 0.01
    assert bridged(t, t[:, None], step=0.01)[0] is t


def test_a_joint_moves_when_it_does_more_than_flicker():
    t = np.arange(4000) * 0.002
    flicker = np.random.default_rng(0).integers(-2, 3, t.size)
    q = 1e-4 * np.column_stack([np.round(100 * np.sin(t)), flicker, 0 * t])
    assert moving_joints(Recording(t=t, q=q)).tolist() == [True, False, False]


def test_a_slow_log_has_no_gap_where_its_steps_are_long():
    assert whole(moving(np.arange(100) * 0.5), Processing(cutoff=0.3, motion_cutoff=0.8)).t.size == 100


def test_a_log_without_torque_is_refused_with_the_channels_it_has():
    t = np.arange(100) * 0.01
    with pytest.raises(RecordingError, match=r"no torque in the log; got q; name the torque or current columns"):
        whole(moving(t, tau=None))


def test_a_log_without_the_velocity_that_is_asked_for_is_refused():
    settings = Processing(cutoff=10.0, motion_cutoff=30.0, velocity="velocity")
    with pytest.raises(RecordingError, match="fitted on measured velocity and the log has none"):
        whole(moving(np.arange(100) * 0.01), settings)


def still_move_still() -> Recording:
    t = np.arange(3000) * 0.002
    phase = np.clip((t - 1.0) / 3.0, 0.0, 1.0)
    return moving(t, q=np.column_stack([np.sin(np.pi * phase) ** 2, 0 * t]))


def test_standstill_at_both_ends_is_left_out():
    begin, end = moving_window(still_move_still())
    assert begin == pytest.approx(1.0, abs=0.06)
    assert end == pytest.approx(4.0, abs=0.06)


def test_a_recording_without_motion_is_kept_whole():
    t = 1.0 + np.arange(500) * 0.01
    assert moving_window(moving(t, q=np.ones((500, 2)))) == (t[0], t[-1])


def test_standstill_is_left_out_though_a_joint_flickers_all_the_time():
    t = np.arange(6000) * 0.002
    q = np.column_stack([np.sin(2 * np.clip(t - 4.0, 0.0, 4.0)), np.zeros(t.size)])
    q[::97, 1] = 1e-4
    assert moving_window(Recording(t=t, q=q)) == pytest.approx((4.0, 8.0), abs=0.06)


def test_a_recording_shorter_than_the_look_ahead_is_kept_whole():
    t = np.arange(20) * 0.001
    assert moving_window(moving(t)) == (t[0], t[-1])


def test_turns_of_an_encoder_are_unwrapped():
    t = np.arange(500) * 0.01
    q = np.column_stack([3.0 * t, -2.0 * t])
    wrapped = (q + np.pi) % (2 * np.pi) - np.pi
    assert np.ptp(wrapped) < 2 * np.pi < np.ptp(q)
    assert np.allclose(unwrapped(wrapped), q, atol=1e-9)


def test_positions_without_turns_are_untouched():
    q = np.random.default_rng(1).uniform(0, 3, (50, 2))
    assert unwrapped(q) is q


def test_interpolation_is_linear_between_samples_and_constant_outside():
    t, signals = np.array([0.0, 1.0, 3.0]), np.array([[0.0, 5.0], [2.0, 5.0], [-2.0, 6.0]])
    ours = interpolated(t, signals, np.array([-1.0, 0.0, 0.25, 1.0, 2.0, 3.0, 9.0]))
    assert np.allclose(ours, [[0, 0, 0.5, 2, 0, -2, -2], [5, 5, 5, 5, 5.5, 6, 6]], rtol=0, atol=1e-14)


def test_rows_are_kept_at_four_times_the_cutoff():
    assert SETTINGS.decimation(1000.0) == 25
    assert SETTINGS.decimation(30.0) == 1
    assert SETTINGS.parallel_filter(1000.0).decimation == 25


@pytest.mark.parametrize("name", ["cutoff", "motion_cutoff"])
@pytest.mark.parametrize("value", [0.0, -1.0, np.inf, np.nan])
def test_a_cutoff_that_is_no_positive_frequency_is_refused(name, value):
    with pytest.raises(RecordingError, match=f"^{name} must be a positive frequency"):
        Processing(**({"cutoff": 1.0, "motion_cutoff": 1.0} | {name: value}))


def test_an_unknown_source_of_velocity_is_refused():
    with pytest.raises(RecordingError, match="expected position or velocity, got guess"):
        Processing(cutoff=1.0, motion_cutoff=1.0, velocity="guess")


def test_a_delay_that_is_no_number_is_refused():
    with pytest.raises(RecordingError, match="delay must be a number"):
        Processing(cutoff=1.0, motion_cutoff=1.0, delay=np.nan)


def test_settings_survive_plain_data():
    settings = Processing(cutoff=1 / 3, motion_cutoff=2.0, velocity="velocity", delay=1e-3)
    assert Processing(**settings.to_dict()) == settings
