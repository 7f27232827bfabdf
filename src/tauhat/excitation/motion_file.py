"""A motion read from a file for a robot, with what the robot refuses."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from tauhat.errors import ExcitationError, MapError, RecordingError, TauhatWarning
from tauhat.excitation.sampled import SampledMotion, sampled_motion
from tauhat.files import existing_file
from tauhat.recordings.logmap import LogMap
from tauhat.recordings.reading import read_recording
from tauhat.recordings.recognising import recognise
from tauhat.recordings.tables import open_table
from tauhat.robots.fitting import check_joint_order
from tauhat.robots.robot import Robot

_PROGRAM = ".script"
_ROUNDING = 1e-6  # [rad, rad/s, rad/s^2 or with m] of numbers in a file


def motion_for(robot: Robot, path: Path) -> SampledMotion:
    """Return the motion in a file.

    Raises
    ------
    ExcitationError
        when the motion is of another number of joints than the robot, or lacks velocities or accelerations.
    RecordingError
        when its joints are the robot's in another order, or the file cannot be read.

    Warns
    -----
    TauhatWarning
        when the motion leaves a limit that the robot states.
    """
    if path.suffix.lower() == _PROGRAM:
        raise ExcitationError(
            "a robot program cannot be read back", where=path,
            remedy="run the same tauhat excite with -o MOTION.parquet: the same seed gives the same motion",
        )  # fmt: skip
    recording = read_recording(path, map=_own_names(path))
    check_joint_order(robot, recording.joint_names, where=recording.name)
    if robot.n_v != recording.n_v:
        raise ExcitationError(
            "a motion of another robot", where=path, expected=f"{robot.n_v} joints of {robot.name}", got=recording.n_v,
            remedy="lock the joints it leaves out with --lock",
        )  # fmt: skip
    motion = sampled_motion(recording)
    _warn_beyond_limits(robot, motion, path.name)
    return motion


def _own_names(path: Path) -> LogMap | None:
    """Return the map that the motion's own column names make: a map beside it is that of the logs in its folder."""
    try:
        named = recognise(open_table(existing_file(path, error=RecordingError)))
    except MapError:
        return None
    return named if named.acceleration is not None else None


def _warn_beyond_limits(robot: Robot, motion: SampledMotion, name: str) -> None:
    samples = motion.samples
    for joint, q, dq, ddq in zip(robot.joints, samples.q.T, samples.dq.T, samples.ddq.T, strict=True):
        limits = joint.limits
        excess = {
            "position": max(limits.lower - q.min(), q.max() - limits.upper),
            "velocity": np.abs(dq).max() - limits.velocity,
            "acceleration": np.abs(ddq).max() - limits.acceleration,
        }
        broken = [limit for limit, value in excess.items() if value > _ROUNDING]
        if broken:
            message = (
                f"{name}: leaves the {' and '.join(broken)} limit of {joint.name}; `tauhat view` shows by how much"
            )
            warnings.warn(message, TauhatWarning, stacklevel=3)
