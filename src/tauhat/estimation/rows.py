"""From a recording to rows of the least-squares problem: regressor columns and torque through one parallel filter."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.model import Layout, TermStates, TorqueModel
from tauhat.dynamics.motion import Motion
from tauhat.errors import RecordingError
from tauhat.recordings.filters import with_context
from tauhat.recordings.processing import CHUNK, Processing, Stretch, moving_window, stretches, uniform_clock
from tauhat.recordings.recording import Recording


class Rows(NamedTuple):
    """Consecutive filtered, decimated rows.

    t : (n,) [s]
    columns : (n_rows, n) regressor entries in the order of the layout
    tau : (n_v, n) filtered torque [Nm or N]
    dq : (n_v, n) filtered velocity [rad/s or m/s]
    """

    t: FloatArray
    columns: FloatArray
    tau: FloatArray
    dq: FloatArray


def filtered_rows(
    model: TorqueModel, layout: Layout, recording: Recording, processing: Processing, *, chunk: int = CHUNK
) -> Iterator[Rows]:
    """Yield the rows of a recording, standstill at both ends left out; the same whatever the chunk.

    Raises
    ------
    RecordingError
        when the recording does not fit the robot or cannot be processed.
    """
    check_joints(model, recording)
    clock = uniform_clock(recording, processing.delay)
    low_pass = processing.parallel_filter(1.0 / clock.step)
    n_v, n_rows = model.robot.n_v, layout.parameters.size
    begin, end = moving_window(recording)
    done = 0
    stacked = _stacked(model, layout, stretches(recording, processing, chunk=chunk), clock.step)
    for window in with_context(stacked, low_pass.half, multiple=low_pass.decimation):
        filtered = low_pass.apply(window)
        t = clock.start + (done + np.arange(filtered.shape[1])) * low_pass.decimation * clock.step
        done += filtered.shape[1]
        kept = (t >= begin) & (t <= end)
        if kept.any():
            part = filtered[:, kept]
            yield Rows(t[kept], part[:n_rows], part[n_rows : n_rows + n_v], part[n_rows + n_v :])


def _stacked(model: TorqueModel, layout: Layout, motion: Iterator[Stretch], step: float) -> Iterator[FloatArray]:
    states: TermStates | None = None
    for stretch in motion:
        block = Motion(q=stretch.q, dq=stretch.dq, ddq=stretch.ddq, step=step)
        columns, states = model.columns(block, layout, states)
        yield np.concatenate([columns, stretch.tau, stretch.dq])


def check_joints(model: TorqueModel, recording: Recording) -> None:
    """Refuse a recording whose number of joints is not the robot's."""
    if recording.n_v != model.robot.n_v:
        raise RecordingError(
            "the log does not fit the robot",
            where=recording.name,
            expected=f"{model.robot.n_v} joints ({', '.join(model.robot.joint_names)})",
            got=recording.n_v,
            remedy="lock the robot's other joints, or name the right columns in the map",
        )
