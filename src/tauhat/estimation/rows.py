"""From a recording to rows of the least-squares problem: regressor columns and torque through one parallel filter."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.model import Layout, TermStates, TorqueModel
from tauhat.dynamics.motion import Motion
from tauhat.errors import ModelError, RecordingError
from tauhat.recordings.filters import HIGHEST_CUTOFF, with_context
from tauhat.recordings.processing import (
    CHUNK,
    Processing,
    Stretch,
    clock_step,
    moving_window,
    stretches,
    uniform_clock,
)
from tauhat.recordings.recording import Recording

_LARGEST_MARGIN = 0.1  # of the recording, left out at each end


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
    model: TorqueModel,
    layout: Layout,
    recording: Recording,
    processing: Processing,
    *,
    chunk: int = CHUNK,
    motion: Iterable[Stretch] | None = None,
) -> Iterator[Rows]:
    """Yield the rows of a recording; the same whatever the chunk.

    Standstill at both ends is left out, and where the log begins or ends in motion the time that the filters take to
    forget how they were continued there, `1 / cutoff`.

    Parameters
    ----------
    motion : `stretches` of the recording through this processing, where they are at hand

    Raises
    ------
    RecordingError
        when the recording does not fit the robot or cannot be processed.
    """
    check_joints(model, recording)
    clock = uniform_clock(recording, processing.delay)
    begin, end = _trusted_window(recording, processing)
    processed = stretches(recording, processing, chunk=chunk) if motion is None else motion
    for rows in rows_of_stretches(model, layout, processed, processing, step=clock.step):
        kept = (rows.t >= begin) & (rows.t <= end)
        if kept.any():
            yield Rows(rows.t[kept], rows.columns[:, kept], rows.tau[:, kept], rows.dq[:, kept])


def _trusted_window(recording: Recording, processing: Processing) -> tuple[float, float]:
    begin, end = moving_window(recording)
    if processing.cutoff >= HIGHEST_CUTOFF / clock_step(recording):
        return begin, end
    margin = min(1.0 / processing.cutoff, _LARGEST_MARGIN * recording.duration)
    return max(begin, float(recording.t[0]) + margin), min(end, float(recording.t[-1]) - margin)


def rows_of_stretches(
    model: TorqueModel, layout: Layout, motion: Iterable[Stretch], processing: Processing, *, step: float
) -> Iterator[Rows]:
    """Yield the rows of consecutive stretches of motion: columns and torque through the parallel filter.

    Parameters
    ----------
    step : time between the samples of the stretches [s]
    """
    low_pass = processing.parallel_filter(1.0 / step)
    n_v, n_rows = model.robot.n_v, layout.parameters.size
    times: list[float] = []
    done = 0
    stacked = _stacked(model, layout, motion, step, times)
    for window in with_context(stacked, low_pass.half, multiple=low_pass.decimation):
        part = low_pass.apply(window)
        ticks = np.arange(done, done + part.shape[1], dtype=np.float64)
        t = times[0] + ticks * (low_pass.decimation * step)
        done += part.shape[1]
        yield Rows(t, part[:n_rows], part[n_rows : n_rows + n_v], part[n_rows + n_v :])


def _stacked(
    model: TorqueModel, layout: Layout, motion: Iterable[Stretch], step: float, times: list[float]
) -> Iterator[FloatArray]:
    """Yield columns, torque and velocity stacked by rows; note the first time in `times`."""
    states: TermStates | None = None
    for stretch in motion:
        if not times:
            times.append(float(stretch.t[0]))
        q, dq, ddq = stretch.q, stretch.dq, stretch.ddq
        temperature = stretch.temperature if stretch.temperature.size else None
        block = Motion(q=q, dq=dq, ddq=ddq, step=step, temperature=temperature)
        columns, states = model.columns(block, layout, states)
        yield np.concatenate([columns, stretch.tau, stretch.dq])


def check_recordings(model: TorqueModel, recordings: Sequence[Recording]) -> None:
    """Refuse no recording at all, and recordings whose number of joints is not the robot's."""
    if not recordings:
        raise ModelError("no recording to identify from")
    for recording in recordings:
        check_joints(model, recording)


def check_joints(model: TorqueModel, recording: Recording) -> None:
    """Refuse a recording whose number of joints is not the robot's, and one without what a term needs."""
    if recording.n_v != model.robot.n_v:
        raise RecordingError(
            "the log does not fit the robot",
            where=recording.name,
            expected=f"{model.robot.n_v} joints ({', '.join(model.robot.joint_names)})",
            got=recording.n_v,
            remedy="lock the robot's other joints, or name the right columns in the map",
        )
    for term in model.terms:
        missing = [name for name in term.needs if getattr(recording, name) is None]
        if missing:
            raise RecordingError(
                f"term {term.key} needs what the log has not", where=recording.name, expected=", ".join(missing),
                got=", ".join(recording.channels()), remedy="name its columns in the map, or leave the term out",
            )  # fmt: skip
