"""Motion files: where they are written to, in which form, and how they are read back."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tauhat.excitation.motion_file import motion_for

if TYPE_CHECKING:
    from tauhat.excitation.design import Design
    from tauhat.robots.robot import Robot

__all__ = ["check_motion_output", "motion_for", "named", "numbered", "write_motion"]

_PROGRAM = ".script"


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
    return named(path, tuple(str(number) for number in range(1, count + 1)))


def named(path: Path, names: tuple[str, ...]) -> tuple[Path, ...]:
    """Return a path for each name: `path` itself for one, else `run-fast.csv.gz`, .. for `run.csv.gz`."""
    if len(names) == 1:
        return (path,)
    stem, dot, ending = path.name.partition(".")
    return tuple(path.with_name(f"{stem}-{name}{dot}{ending}") for name in names)
