"""Spikes of the torque: single samples far from all their neighbours, to be mended before a low-pass smears them.

A corrupt sample spoils every filtered row whose window it is in; behind the filter no weight can tell it apart.

Source: Hampel, "The influence curve and its role in robust estimation", 1974 (median and deviation from it).
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.recordings.recording import Recording

WINDOW = 9  # samples of the running median: up to four bad ones in a row are outvoted
_NORMAL = 1.4826  # deviation of a normal variable over its median absolute deviation


class Mended(NamedTuple):
    """A recording without spikes of torque, and what part of its torque samples were spikes."""

    recording: Recording
    share: float


def without_spikes(recording: Recording, *, threshold: float) -> Mended:
    """Return the recording with spikes of torque replaced by the running median of nine samples.

    Parameters
    ----------
    threshold : distance from the running median, in deviations of that distance, that makes a spike
    """
    if recording.tau is None or recording.n_t < WINDOW:
        return Mended(recording, 0.0)
    from scipy.ndimage import median_filter

    # Joint by joint: SciPy's filter of one axis takes a fifth of the time of its filter of two.
    columns = [median_filter(np.ascontiguousarray(tau), size=WINDOW, mode="nearest") for tau in recording.tau.T]
    middle = np.column_stack(columns)
    distance = np.abs(recording.tau - middle)
    spikes = distance > threshold * _usual(distance)
    if not spikes.any():
        return Mended(recording, 0.0)
    mended = np.where(spikes, middle, recording.tau)
    return Mended(replace(recording, tau=mended), float(spikes.mean()))


def _usual(distance: FloatArray) -> FloatArray:
    """Return the deviation of each joint's distances, (n_v,); of those that are not zero where most are."""
    usual = _NORMAL * np.median(distance, axis=0)
    for joint in np.flatnonzero(usual <= 0.0):
        own = distance[:, joint]
        usual[joint] = _NORMAL * np.median(own[own > 0.0]) if (own > 0.0).any() else np.inf
    return np.asarray(usual)
