"""Sensors read sample by sample have the errors that their settings say, and those of a whole log where both can."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy import stats

from tauhat.arrays import FloatArray
from tauhat.errors import SimulationError
from tauhat.robots import load_robot
from tauhat.simulation import Ripple, SensorErrors, Signals, measure, sensor_preset
from tauhat.simulation.contact import LoadCell, LoadCellReader, SensorStream, ShownSample
from tauhat.simulation.contact.sensor_stream import LINK, MOTOR, Sampling

SAMPLE, CONTROL = 0.004, 0.001
SAMPLING = Sampling(sample_period=SAMPLE, control_period=CONTROL)
HOUR = 3600.0


def stream_of(errors: SensorErrors, first: FloatArray, *, seed: int = 0, **changes: Any) -> SensorStream:
    rng = np.random.default_rng(seed)
    return SensorStream(errors, sampling=SAMPLING._replace(**changes), first=first, rng=rng)


def constant(n_v: int, tau: float = 10.0) -> FloatArray:
    return np.array([np.full(n_v, 0.3), np.full(n_v, 0.3), np.full(n_v, tau)])


def shown_of(stream: SensorStream, count: int) -> list[ShownSample]:
    return [stream.show(k * SAMPLE) for k in range(count)]


def swinging(count: int) -> tuple[FloatArray, FloatArray]:
    """Return times (n,) and truth (n, 3, 2) of two joints, at the control periods."""
    t = CONTROL * np.arange(count)
    q = np.column_stack([0.4 * np.sin(3.0 * t), 0.2 * np.cos(5.0 * t)])
    return t, np.stack([q, q + 0.01 * np.sin(7.0 * t)[:, None], 20.0 * np.cos(2.0 * t)[:, None] + 5.0 * q], axis=1)


def passed(stream: SensorStream, truth: FloatArray) -> list[ShownSample]:
    """Return samples at the first row of the truth, and at every fourth behind it."""
    samples = [stream.show(0.0)]
    for k in range(1, len(truth) - 3, 4):
        stream.note(truth[k : k + 4])
        samples.append(stream.show((k + 3) * CONTROL))
    return samples


@pytest.mark.parametrize("delay", [0.0, 0.001, 0.0026, 0.009])
def test_torque_is_exactly_as_late_as_its_delay(delay: float) -> None:
    t = CONTROL * np.arange(401)
    ramp = np.stack([np.zeros((401, 1)), np.zeros((401, 1)), 50.0 * t[:, None]], axis=1)
    samples = passed(stream_of(SensorErrors(torque_delay=delay), ramp[0]), ramp)
    late = np.array([sample.tau[0] for sample in samples]) / 50.0
    ticks = np.array([sample.t for sample in samples])
    np.testing.assert_allclose(late, np.maximum(ticks - delay, 0.0), atol=1e-12)


def test_torque_noted_late_is_read_at_its_own_time() -> None:
    t = CONTROL * np.arange(101)
    ramp = np.stack([np.zeros((101, 1)), np.zeros((101, 1)), 50.0 * (t[:, None] - CONTROL)], axis=1)
    samples = passed(stream_of(SensorErrors(torque_delay=0.003), ramp[0], behind=CONTROL), ramp)
    ticks = np.array([sample.t for sample in samples])[3:]
    shown = np.array([sample.tau[0] for sample in samples])[3:]
    np.testing.assert_allclose(shown, 50.0 * (ticks - 0.003), atol=1e-12)


def test_errors_without_chance_are_those_of_a_whole_log() -> None:
    errors = SensorErrors(
        encoder_step=1e-4, torque_factor=np.array([1.03, 0.98]), torque_offset=np.array([0.5, -0.2]), torque_drift=40.0,
        torque_delay=0.002,
        ripples=(
            Ripple(amplitude=0.7, order=np.array([3.0, 5.0]), turns="motor", gear_ratio=100.0, phase=0.4),
            Ripple(amplitude=0.2, order=2.0, phase=np.array([0.0, 1.0])),
        ),
    )  # fmt: skip
    t, truth = swinging(801)
    signals = Signals(t=t, q=truth[:, 0], dq=np.zeros((801, 2)), tau=truth[:, 2], link=truth[:, 0], motor=truth[:, 1])
    whole = measure(errors, signals, rng=np.random.default_rng(0))
    samples = passed(stream_of(errors, truth[0], side=LINK), truth)
    rows = slice(4, None, 4)
    np.testing.assert_allclose([sample.t for sample in samples[1:]], whole.t[rows], atol=1e-12)
    np.testing.assert_allclose([sample.q for sample in samples[1:]], whole.q[rows], atol=1e-12)
    np.testing.assert_allclose([sample.tau for sample in samples[1:]], whole.tau[rows], atol=1e-9)


def test_encoders_on_motors_show_motors() -> None:
    _, truth = swinging(9)
    shown = passed(stream_of(SensorErrors(), truth[0], side=MOTOR), truth)[-1]
    np.testing.assert_array_equal(shown.q, truth[8, 1])


def test_offsets_and_gains_have_the_spread_of_the_preset_and_stay() -> None:
    robot = load_robot("ur10e")
    preset = sensor_preset("industrial-arm", robot)
    n = 6 * 500
    still = replace(
        preset, torque_offset_spread=np.tile(preset.torque_offset_spread, 500), torque_noise=0.0, torque_walk=0.0,
        torque_drift=0.0, ripples=(), torque_factor_spread=0.03,
    )  # fmt: skip
    stream = stream_of(still, constant(n))
    loaded, again = (sample.tau for sample in shown_of(stream, 2))
    np.testing.assert_array_equal(loaded, again)
    unloaded = stream_of(still, constant(n, 0.0)).show(0.0).tau
    offsets = (unloaded / np.asarray(still.torque_offset_spread)).reshape(500, 6)
    assert stats.kstest(offsets.ravel(), "norm").pvalue > 0.01
    gains = np.log((loaded - unloaded) / 10.0) / 0.03
    assert stats.kstest(gains, "norm").pvalue > 0.01


def test_noise_has_the_deviation_of_the_preset_and_is_white() -> None:
    robot = load_robot("ur10e")
    preset = replace(
        sensor_preset("industrial-arm", robot), torque_offset_spread=0.0, torque_factor_spread=0.0, torque_walk=0.0,
        torque_drift=0.0, ripples=(),
    )  # fmt: skip
    samples = shown_of(stream_of(preset, constant(6)), 3000)
    error = (np.array([sample.tau for sample in samples]) - 10.0) / np.asarray(preset.torque_noise)
    assert stats.kstest(error.ravel(), "norm").pvalue > 0.01
    assert np.abs(np.mean(error[1:] * error[:-1], axis=0)).max() < 4.0 / np.sqrt(3000)


def test_relative_noise_is_a_part_of_the_rms_torque_so_far() -> None:
    samples = shown_of(stream_of(SensorErrors(relative_torque_noise=0.02), constant(2000, -10.0)), 4)
    spread = [float(np.std(sample.tau)) for sample in samples]
    np.testing.assert_allclose(spread, 0.2, rtol=0.08)


def test_a_walk_grows_with_the_root_of_time_also_over_a_break() -> None:
    n = 4000
    stream = stream_of(SensorErrors(torque_walk=2.0), constant(n, 0.0))
    spread = [float(np.std(stream.show(t).tau)) for t in (0.0, 0.25 * HOUR, HOUR)]
    assert spread[0] == 0.0
    np.testing.assert_allclose(spread[1:], [1.0, 2.0], rtol=0.05)


def test_drift_is_what_the_hours_bring() -> None:
    stream = stream_of(SensorErrors(torque_drift=3.0), constant(1, 0.0))
    np.testing.assert_allclose([stream.show(t).tau[0] for t in (0.0, 0.5 * HOUR, 4.0 * HOUR)], [0.0, 1.5, 12.0])


def test_jitter_takes_samples_of_the_past_only_and_stamps_them_as_told() -> None:
    """Shown with a position that is the time itself."""
    t = CONTROL * np.arange(8001)
    clock = np.repeat(t[:, None, None], 3, axis=1)
    jitter = 2e-4
    for stamps in ("instants", "ticks"):
        errors = SensorErrors(sampling_jitter=jitter, stamps=stamps)  # type: ignore[arg-type]
        samples = passed(stream_of(errors, clock[0]), clock)[5:]
        ticks = SAMPLE * (5 + np.arange(len(samples)))
        ago = ticks - np.array([sample.q[0] for sample in samples])
        assert ago.min() >= -1e-12
        assert stats.kstest(ago / (2.0 * np.sqrt(3.0) * jitter), "uniform").pvalue > 0.01
        shown = np.array([sample.t for sample in samples])
        np.testing.assert_allclose(shown, ticks if stamps == "ticks" else ticks - ago, atol=1e-9)
        np.testing.assert_allclose([sample.tau[0] for sample in samples], ticks - ago, atol=1e-9)


def test_stamp_jitter_is_of_the_stamps_alone() -> None:
    t = CONTROL * np.arange(4001)
    clock = np.repeat(t[:, None, None], 3, axis=1)
    samples = passed(stream_of(SensorErrors(stamp_jitter=1e-4), clock[0]), clock)
    off = np.array([sample.t - sample.q[0] for sample in samples])
    assert stats.kstest(off / (np.sqrt(3.0) * 1e-4), "uniform", args=(-1.0, 2.0)).pvalue > 0.01


def test_lost_rows_have_the_share_and_the_runs_of_the_settings_and_repeat_the_last_one() -> None:
    errors = SensorErrors(lost_samples=0.2, lost_run=3.0, torque_noise=1.0)
    samples = shown_of(stream_of(errors, constant(1)), 8000)
    lost = np.array([not sample.fresh for sample in samples])
    starts = np.count_nonzero(lost[1:] & ~lost[:-1])
    assert lost.mean() == pytest.approx(0.2, abs=0.03)
    assert lost.sum() / starts == pytest.approx(3.0, abs=0.3)
    for before, sample in pairwise(samples):
        if not sample.fresh:
            assert (sample.t, sample.tau[0]) == (before.t, before.tau[0])


@pytest.mark.parametrize(
    ("errors", "words"),
    [
        (SensorErrors(torque_delay=-0.001), "torque of the future"),
        (SensorErrors(sampling_jitter=0.002), "overtake each other"),
        (SensorErrors(encoder_step=np.ones(3)), "encoder_step does not fit"),
    ],
)
def test_sensors_that_cannot_be_streamed_are_refused(errors: SensorErrors, words: str) -> None:
    with pytest.raises(SimulationError, match=words):
        stream_of(errors, constant(2))


def test_a_load_cell_has_the_errors_of_its_settings() -> None:
    quiet = LoadCell(noise=0.0, offset=0.3, offset_spread=0.0, drift=0.5, walk=0.0)
    reader = LoadCellReader(quiet, np.random.default_rng(0))
    np.testing.assert_allclose([reader.read(t, 20.0) for t in (0.0, 2.0 * HOUR)], [20.3, 21.3])
    noisy = LoadCellReader(LoadCell(noise=0.4, offset_spread=0.0, drift=0.0, walk=0.0), np.random.default_rng(1))
    assert stats.kstest([noisy.read(0.0, 5.0) / 0.4 - 12.5 for _ in range(3000)], "norm").pvalue > 0.01
    many = [LoadCellReader(LoadCell(noise=0.0, drift=0.0), np.random.default_rng(k)) for k in range(1500)]
    before, after = np.array([[reader.read(t, 0.0) for t in (0.0, HOUR)] for reader in many]).T
    assert stats.kstest(before / 0.5, "norm").pvalue > 0.01
    assert stats.kstest((after - before) / 0.2, "norm").pvalue > 0.01
