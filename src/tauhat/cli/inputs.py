"""From the words of the command line to the objects of the library."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from tauhat.errors import TauhatWarning

if TYPE_CHECKING:
    from tauhat.cli.options import Window
    from tauhat.estimation.closed_loop import ClosedLoop
    from tauhat.estimation.estimate import Estimate
    from tauhat.estimation.log_survey import LogFacts
    from tauhat.recordings.log_source import LogSource
    from tauhat.recordings.processing import Processing
    from tauhat.recordings.recording import Recording
    from tauhat.robots.robot import Robot


def read_recordings(logs: Sequence[Path], *, map_file: Path | None, rows: Window | None) -> tuple[Recording, ...]:
    """Return the logs as recordings, all through the same map and window."""
    from tauhat.recordings.reading import read_recording

    return tuple(read_recording(log, map=map_file, rows=rows) for log in logs)


def sources_of(
    logs: Sequence[Path], *, map_file: Path | None, rows: Window | None, period: float | None
) -> tuple[LogSource, ...]:
    """Return how workers read the logs: all through the same map and window."""
    from tauhat.recordings.log_source import LogSource

    return tuple(LogSource(path=log, map=map_file, rows=rows, period=period) for log in logs)


def loop_of(controller: Path | None, robot: Robot, sources: Sequence[LogSource]) -> ClosedLoop | None:
    """Return how the robot was driven in these logs, where the file of its controller is given."""
    from tauhat.simulation.controller_file import load_closed_loop

    return None if controller is None else load_closed_loop(controller, robot, sources)


def averaged(recordings: Sequence[Recording], *, period: float | None) -> tuple[Recording, ...]:
    """Return the recordings, each averaged over its periods of `period` seconds where one is given."""
    from tauhat.recordings.periods import average_periods

    if period is None:
        return tuple(recordings)
    return tuple(average_periods(recording, period=period).recording for recording in recordings)


def robot_of_recordings(
    name: str, recordings: Sequence[Recording] | Sequence[LogFacts], *, locked: Mapping[str, float] | None
) -> Robot:
    """Return the robot, fitted to the joints that the recordings have."""
    from tauhat.robots.fitting import check_joint_order, fit_to_joints
    from tauhat.robots.library import load_robot

    robot = load_robot(name, locked=locked)
    robot = fit_to_joints(robot, recordings[0].joint_names, where=recordings[0].name)
    for recording in recordings:
        check_joint_order(robot, recording.joint_names, where=recording.name)
    return robot


def recordings_of_estimate(
    estimate: Estimate, logs: Sequence[Path], *, map_file: Path | None, rows: Window | None
) -> tuple[Recording, ...]:
    """Return the logs as recordings whose joints are those of the estimate."""
    from tauhat.estimation.estimate import input_log
    from tauhat.robots.fitting import check_joint_order

    recordings = read_recordings(logs, map_file=map_file, rows=rows)
    for recording in recordings:
        check_joint_order(estimate.robot, recording.joint_names, where=recording.name)
        if any(known.overlaps(input_log(recording)) for known in estimate.inputs):
            message = f"{recording.name} is one of the logs the estimate was fitted on: its error there proves little"
            warnings.warn(message, TauhatWarning, stacklevel=2)
    return recordings


def processing_of(estimate: Estimate, *, cutoff: float | None) -> Processing:
    """Return the filters of the estimate, with another cut-off where one is given [Hz]."""
    return estimate.processing if cutoff is None else replace(estimate.processing, cutoff=cutoff)
