"""Motion files: where they are written to, in which form, and how they are read back."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tauhat.errors import ExcitationError, TauhatWarning

if TYPE_CHECKING:
    from tauhat.excitation.design import Design
    from tauhat.excitation.sampled import SampledMotion
    from tauhat.robots.robot import Robot

_PROGRAM = ".script"
_ROUNDING = 1e-6  # [rad, rad/s, rad/s^2 or with m] of numbers in a file


def check_motion_output(path: Path, robot: Robot) -> None:
    """Check, before long work begins, that a motion of the robot can be written to `path`.

    Raises
    ------
    OutputError
        an unknown ending, a robot that the ending's program cannot move, or a place that cannot be written.
    """
    from tauhat.export.urscript import check_six_revolute
    from tauhat.files import check_output
    from tauhat.recordings.writing import log_ending

    if path.suffix.lower() == _PROGRAM:
        check_six_revolute(robot)
    else:
        log_ending(path)
    check_output(path)


def write_motion(found: Design, robot: Robot, path: Path, *, rate: float, periods: int) -> None:
    """Write a motion as a robot program (.script), or sampled `rate` times a second (.parquet, .csv, .csv.gz)."""
    from tauhat.export.urscript import ServoSettings, write_urscript
    from tauhat.recordings.writing import write_recording

    if path.suffix.lower() == _PROGRAM:
        write_urscript(path, robot, found.trajectory, settings=ServoSettings(periods=periods))
    else:
        write_recording(found.recording(rate=rate, joint_names=robot.joint_names, periods=periods), path)


def numbered(path: Path, count: int) -> tuple[Path, ...]:
    """Return a path for each motion: `path` itself for one, else `run-1.csv.gz`, `run-2.csv.gz` for `run.csv.gz`."""
    if count == 1:
        return (path,)
    stem, dot, ending = path.name.partition(".")
    return tuple(path.with_name(f"{stem}-{number}{dot}{ending}") for number in range(1, count + 1))


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
    from tauhat.excitation.sampled import sampled_motion
    from tauhat.recordings.reading import read_recording
    from tauhat.robots.fitting import check_joint_order

    if path.suffix.lower() == _PROGRAM:
        raise ExcitationError(
            "a robot program cannot be read back", where=path,
            remedy="run the same tauhat excite with -o MOTION.parquet: the same seed gives the same motion",
        )  # fmt: skip
    recording = read_recording(path)
    check_joint_order(robot, recording.joint_names, where=recording.name)
    if robot.n_v != recording.n_v:
        raise ExcitationError(
            "a motion of another robot", where=path, expected=f"{robot.n_v} joints of {robot.name}", got=recording.n_v,
            remedy="lock the joints it leaves out with --lock",
        )  # fmt: skip
    motion = sampled_motion(recording)
    _warn_beyond_limits(robot, motion, path.name)
    return motion


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
