"""Spikes of torque are mended, everything else stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sample_arms import planar_truth
from tauhat.recordings.spikes import without_spikes

RECORDING = planar_truth().recording(seconds=10.0, noise=0.2 * np.random.default_rng(0).normal(size=(2000, 2)))


def test_single_bad_samples_are_replaced_by_what_is_around_them():
    bad = np.random.default_rng(1).random(RECORDING.tau.shape) < 0.05
    mended, share = without_spikes(replace(RECORDING, tau=RECORDING.tau + 50.0 * bad), threshold=8.0)
    assert share == bad.mean()
    assert np.array_equal(mended.tau[~bad], RECORDING.tau[~bad])
    assert np.abs(mended.tau[bad] - RECORDING.tau[bad]).max() < 4.0


def test_good_samples_and_steps_stay():
    mended, share = without_spikes(RECORDING, threshold=8.0)
    assert share == 0.0
    assert mended is RECORDING
    stepped = replace(RECORDING, tau=RECORDING.tau + 40.0 * (RECORDING.t > 5.0)[:, None])
    assert without_spikes(stepped, threshold=8.0).share == 0.0


def test_a_torque_that_stands_still_most_of_the_time_has_no_spike_where_it_moves():
    held = replace(RECORDING, tau=np.repeat(RECORDING.tau[::20], 20, axis=0))
    assert without_spikes(held, threshold=8.0).share == 0.0
    flat = replace(RECORDING, tau=np.zeros_like(RECORDING.tau))
    assert without_spikes(flat, threshold=8.0).share == 0.0


def test_a_recording_without_torque_has_no_spikes():
    assert without_spikes(replace(RECORDING, tau=None), threshold=8.0).recording.tau is None
