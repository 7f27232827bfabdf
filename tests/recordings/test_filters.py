"""Zero-phase filters of finite length against SciPy's two-pass filters, and the laws of derivatives and of chunks."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import butter, sosfiltfilt

from tauhat.errors import RecordingError
from tauhat.recordings.filters import FirFilter, differentiators, high_pass, low_pass, with_context

RATE = 200.0


def noise_rows(n_rows: int, n_t: int, *, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(n_rows, n_t))


@pytest.mark.parametrize("cutoff", [0.7, 5.0, 30.0, 80.0])
def test_low_pass_is_the_two_pass_butterworth(cutoff):
    rows = noise_rows(3, 6000)
    kernel = low_pass(cutoff, RATE)
    oracle = sosfiltfilt(butter(4, cutoff, fs=RATE, output="sos"), rows)
    middle = slice(2 * kernel.half, 6000 - 2 * kernel.half)
    ours = kernel.apply(rows)[:, kernel.half : kernel.half + rows[:, middle].shape[1]]
    assert ours.shape[1] > 1000
    assert np.abs(ours - oracle[:, middle]).max() < 1e-3 * oracle.std()


@pytest.mark.parametrize("cutoff", [0.7, 5.0, 30.0])
def test_derivatives_are_those_of_the_two_pass_butterworth(cutoff):
    rng = np.random.default_rng(1)
    t = np.arange(8000) / RATE
    signal = sum(
        a * np.sin(2 * np.pi * f * t + p)
        for a, f, p in zip(rng.normal(size=8), rng.uniform(0, cutoff, 8), rng.uniform(0, 6, 8), strict=True)
    )
    smoothed = sosfiltfilt(butter(4, cutoff, fs=RATE, output="sos"), signal)
    spectrum, frequency = np.fft.rfft(smoothed * np.hanning(8000)), np.fft.rfftfreq(8000, 1 / RATE)
    filters = differentiators(cutoff, RATE)
    half = filters[0].half
    windowed = [kernel.apply(signal[None])[0] for kernel in filters]
    assert np.allclose(windowed[0], smoothed[half:-half], atol=2e-4 * np.abs(smoothed).max())
    speed = np.gradient(smoothed, 1 / RATE, edge_order=2)[half:-half]
    top = 2 * np.pi * frequency[np.abs(spectrum).argmax()]
    step_error = (2 * np.pi * cutoff / RATE) ** 2 / 6
    assert np.abs(windowed[1] - speed).max() <= (step_error + 1e-3) * max(np.abs(speed).max(), top)


@given(
    cutoff=st.floats(0.5, 200.0),
    rate=st.floats(50.0, 2000.0),
    a=st.floats(-3, 3),
    b=st.floats(-3, 3),
    c=st.floats(-3, 3),
)
def test_derivatives_of_a_parabola_are_exact(cutoff, rate, a, b, c):
    filters = differentiators(cutoff, rate)
    half = filters[0].half
    t = (np.arange(2 * half + 5) - half) / rate
    _, first, second = (kernel.apply((a + b * t + c * t**2)[None])[0] for kernel in filters)
    inner = t[half : t.size - half]
    longest = np.abs(t).max()
    assert np.allclose(first, b + 2 * c * inner, atol=1e-7 * (1 + 1 / longest + longest))
    assert np.allclose(second, 2 * c, atol=1e-6 * (1 + 1 / longest**2))


@pytest.mark.parametrize(("cutoff", "frequency"), [(5.0, 1.0), (20.0, 4.0)])
def test_derivatives_of_a_slow_sine_are_its_derivatives(cutoff, frequency):
    omega = 2 * np.pi * frequency
    filters = differentiators(cutoff, RATE)
    half = filters[0].half
    t = np.arange(4000) / RATE
    inner = t[half:-half]
    smooth, first, second = (kernel.apply(np.sin(omega * t)[None])[0] for kernel in filters)
    assert np.allclose(smooth, np.sin(omega * inner), atol=2e-4)
    assert np.allclose(first, omega * np.cos(omega * inner), atol=1e-3 * omega)
    assert np.allclose(second, -(omega**2) * np.sin(omega * inner), atol=1e-3 * omega**2)


@given(cutoff=st.floats(0.3, 500.0), rate=st.floats(20.0, 4000.0))
def test_a_constant_passes_the_low_pass_and_no_derivative(cutoff, rate):
    smooth, first, second = differentiators(cutoff, rate)
    assert low_pass(cutoff, rate).kernel.sum() == pytest.approx(1.0, abs=1e-12)
    assert smooth.kernel.sum() == pytest.approx(1.0, abs=1e-12)
    assert first.kernel.sum() == pytest.approx(0.0, abs=1e-9 * np.abs(first.kernel).sum())
    assert second.kernel.sum() == pytest.approx(0.0, abs=1e-9 * np.abs(second.kernel).sum())


@given(cutoff=st.floats(0.3, 500.0), rate=st.floats(20.0, 4000.0))
def test_kernels_are_symmetric_so_that_no_phase_is_lost(cutoff, rate):
    smooth, first, second = (kernel.kernel for kernel in differentiators(cutoff, rate))
    assert np.allclose(smooth, smooth[::-1], atol=1e-12 * np.abs(smooth).max())
    assert np.allclose(first, -first[::-1], atol=1e-9 * np.abs(first).max())
    assert np.allclose(second, second[::-1], atol=1e-9 * np.abs(second).max())


@pytest.mark.parametrize("cutoff", [0.45 * RATE, 1000.0])
def test_nothing_is_filtered_when_the_cutoff_is_high(cutoff):
    rows = noise_rows(2, 50)
    assert np.array_equal(low_pass(cutoff, RATE).apply(rows), rows)
    smooth, first, second = differentiators(cutoff, RATE)
    assert np.array_equal(smooth.apply(rows), rows[:, 1:-1])
    assert np.allclose(first.apply(rows), (rows[:, 2:] - rows[:, :-2]) * RATE / 2)
    assert np.allclose(second.apply(rows), np.diff(rows, 2, axis=1) * RATE**2)


def test_just_below_that_cutoff_noise_is_filtered():
    assert low_pass(0.449 * RATE, RATE).kernel.size > 1


@given(decimation=st.integers(1, 30), n=st.integers(1, 400), cutoff=st.sampled_from([3.0, 25.0, 1000.0]))
def test_decimated_output_is_every_so_many_of_the_full_one(decimation, n, cutoff):
    full, thinned = low_pass(cutoff, RATE), low_pass(cutoff, RATE, decimation=decimation)
    rows = noise_rows(2, n + 2 * full.half, seed=n)
    expected = full.apply(rows)[:, ::decimation]
    ours = thinned.apply(rows)
    assert ours.shape == expected.shape
    assert np.allclose(ours, expected, rtol=0, atol=1e-13)


def test_output_is_the_convolution_it_claims_to_be():
    kernel = np.array([0.1, 0.5, -0.3, 0.2, 0.7])
    rows = noise_rows(2, 40)
    expected = np.array([np.convolve(row, kernel, mode="valid") for row in rows])
    assert np.allclose(FirFilter(kernel=kernel).apply(rows), expected, rtol=0, atol=1e-14)
    assert np.allclose(FirFilter(kernel=kernel, decimation=3).apply(rows), expected[:, ::3], rtol=0, atol=1e-14)


def test_high_pass_is_what_the_low_pass_takes_away():
    low, high = low_pass(8.0, RATE), high_pass(8.0, RATE)
    rows = noise_rows(2, 500)
    assert np.allclose(low.apply(rows) + high.apply(rows), rows[:, low.half : -low.half], rtol=0, atol=1e-13)


@given(n=st.integers(1, 300), half=st.integers(0, 60), multiple=st.integers(1, 9), data=st.data())
def test_windows_rebuild_the_rows_whatever_the_chunks(n, half, multiple, data):
    cuts = sorted(data.draw(st.sets(st.integers(1, max(1, n - 1)), max_size=8)) - {n})
    rows = noise_rows(2, n, seed=n)
    windows = list(with_context((rows[:, a:b] for a, b in pairwise([0, *cuts, n])), half, multiple=multiple))
    interiors = [window[:, half : window.shape[1] - half] for window in windows]
    assert np.array_equal(np.concatenate(interiors, axis=1), rows)
    assert all(interior.shape[1] % multiple == 0 for interior in interiors[:-1])
    whole = np.concatenate([windows[0][:, :half], rows, windows[-1][:, windows[-1].shape[1] - half :]], axis=1)
    done = 0
    for window in windows:
        assert np.array_equal(window, whole[:, done : done + window.shape[1]])
        done += window.shape[1] - 2 * half


@given(n=st.integers(2, 200), share=st.floats(0.0, 1.0), cut=st.integers(1, 199))
def test_ends_are_reflected_through_the_end_points(n, share, cut):
    half = int(share * (n - 1))
    rows = noise_rows(1, n, seed=n)
    chunks = [rows[:, :cut], rows[:, cut:]] if cut < n else [rows]
    windows = list(with_context(iter(chunks), half))
    before = 2 * rows[:, :1] - rows[:, half:0:-1]
    after = (
        2 * rows[:, -1:] - rows[:, n - 2 : n - 2 - half : -1] if half < n - 1 else 2 * rows[:, -1:] - rows[:, -2::-1]
    )
    assert np.array_equal(windows[0][:, :half], before)
    assert np.array_equal(windows[-1][:, windows[-1].shape[1] - half :], after)


@given(
    cuts=st.sets(st.integers(1, 999), max_size=10), cutoff=st.sampled_from([4.0, 40.0]), decimation=st.integers(1, 12)
)
def test_filtering_is_the_same_whatever_the_chunks(cuts, cutoff, decimation):
    rows = noise_rows(2, 1000)
    kernel = low_pass(cutoff, RATE, decimation=decimation)

    def filtered(bounds):
        chunks = (rows[:, a:b] for a, b in pairwise(bounds))
        windows = with_context(chunks, kernel.half, multiple=decimation)
        return np.concatenate([kernel.apply(window) for window in windows], axis=1)

    whole = filtered([0, 1000])
    assert whole.shape[1] == -(-1000 // decimation)
    assert np.allclose(filtered([0, *sorted(cuts), 1000]), whole, rtol=0, atol=1e-13)


def test_no_chunks_give_no_windows():
    assert list(with_context(iter(()), 5)) == []


@pytest.mark.parametrize("cutoff", [0.0, -3.0, np.nan])
def test_a_cutoff_that_is_not_positive_is_refused(cutoff):
    with pytest.raises(RecordingError, match="cut-off frequency must be positive"):
        low_pass(cutoff, RATE)
