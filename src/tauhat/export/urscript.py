"""A designed motion as a program for Universal Robots: the controller itself evaluates the Fourier series.

The program moves to the start pose, waits, and then computes the target of every control step from the coefficients,
so a motion of any length is a page of text and the step is the controller's own. Time is counted from the begin of each
period, because numbers on the controller may have single precision: a clock that ran on for minutes would lose digits.

Source: Universal Robots, "The URScript programming language", motion module (movej, servoj, stopj).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import OutputError
from tauhat.excitation.fourier import FourierSeries
from tauhat.export.controller_arms import SIX_JOINTS, harmless_name, has_six_revolute_joints, kinds_of_joints
from tauhat.files import write_text
from tauhat.robots.robot import Robot

_DECIMALS = 15  # of coefficients [rad]: far finer than any encoder; URScript is not promised to know exponents
_LOOKAHEAD = (0.03, 0.2)  # [s] what servoj accepts
_GAIN = (100.0, 2000.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoSettings:
    """How the program runs a motion; lookahead and gain are the manufacturer's defaults.

    periods : how often the motion is repeated
    lookahead : over which servoj smooths the targets, 0.03 to 0.2 [s]
    gain : of servoj on the distance to the target, 100 to 2000
    approach_speed, approach_acceleration : of the fastest joint on the way to the start pose [rad/s, rad/s^2]
    pause : standstill before the motion; the start pose is held as long after it [s]
    """

    periods: int = 1
    lookahead: float = 0.1
    gain: float = 300.0
    approach_speed: float = 0.3
    approach_acceleration: float = 0.5
    pause: float = 1.0

    def __post_init__(self) -> None:
        if self.periods < 1:
            raise OutputError("at least one period is run", where="UR program", got=self.periods)
        for name, (low, high) in (("lookahead", _LOOKAHEAD), ("gain", _GAIN)):
            value = getattr(self, name)
            if not low <= value <= high:
                raise OutputError(f"{name} of servoj", where="UR program", expected=f"{low:g} to {high:g}", got=value)
        for name in ("approach_speed", "approach_acceleration", "pause"):
            value = getattr(self, name)
            if not 0.0 < value < np.inf:
                raise OutputError(name.replace("_", " "), where="UR program", expected="a positive number", got=value)


def write_urscript(
    path: str | Path, robot: Robot, series: FourierSeries, *, settings: ServoSettings | None = None
) -> Path:
    """Write the program that runs a motion and return its path; the file appears whole or not at all.

    Raises
    ------
    OutputError
        when the robot has not six revolute joints, or the file cannot be written.
    """
    write_text(path, urscript(robot, series, settings=settings))
    return Path(path)


def urscript(robot: Robot, series: FourierSeries, *, settings: ServoSettings | None = None) -> str:
    """Return the program that runs a motion on a Universal Robots controller, from rest to rest.

    `q_j(t) = offset_j + sum_k a_jk sin(k w t) + b_jk cos(k w t)` is evaluated at every control step; the path to the
    start pose is a plain movej.

    Parameters
    ----------
    series : of six joints, base to wrist

    Raises
    ------
    OutputError
        when the robot has not six revolute joints, or the motion is of another number of joints.
    """
    check_six_revolute(robot)
    if series.n_v != SIX_JOINTS:
        raise OutputError(
            "a motion of another robot", where=robot.name, expected=f"{SIX_JOINTS} joints", got=series.n_v
        )
    chosen = settings or ServoSettings()
    lines = [*_heading(robot, series, chosen), *_approach(series, chosen), *_loop(series, chosen), *_ending(chosen)]
    return "\n".join(["def excitation_motion():", *(f"  {line}" for line in lines), "end", ""])


def check_six_revolute(robot: Robot) -> None:
    """Check that a robot has the joints of a Universal Robots arm.

    Raises
    ------
    OutputError
        when it has not six revolute joints.
    """
    if not has_six_revolute_joints(robot):
        raise OutputError(
            "a UR program moves six revolute joints",
            where=robot.name,
            expected=f"{SIX_JOINTS} revolute",
            got=kinds_of_joints(robot),
            remedy="write the motion as .parquet or .csv, or lock joints with --lock",
        )


def _heading(robot: Robot, series: FourierSeries, settings: ServoSettings) -> Iterator[str]:
    yield f"# Identification motion of {harmless_name(robot)}: {series.n_h} harmonics of {series.period:g} s,"
    yield f"# run {settings.periods} times, from rest to rest. The way to the start pose is not checked for collisions."


def _approach(series: FourierSeries, settings: ServoSettings) -> Iterator[str]:
    yield f"local start = [{', '.join(_number(value) for value in _start(series))}]"
    yield f"movej(start, a={settings.approach_acceleration:g}, v={settings.approach_speed:g})"
    yield f"sleep({settings.pause:g})"


def _loop(series: FourierSeries, settings: ServoSettings) -> Iterator[str]:
    """Yield the loop over all steps; `first` is the time within its period of the first step of a run."""
    joints = range(1, SIX_JOINTS + 1)
    yield "local dt = get_steptime()"
    yield f"local period = {_number(series.period)}"
    yield f"local w = {_number(2.0 * np.pi / series.period)}"
    for name in ("first", "t", "x", "s", "c", *(f"q{joint}" for joint in joints)):
        yield f"local {name} = 0.0"
    yield "local done = 0"
    yield "local step = 0"
    yield f"while done < {settings.periods}:"
    yield "  t = first + step * dt"
    yield "  if t >= period:"
    yield "    first = t - period"
    yield "    step = 0"
    yield "    done = done + 1"
    yield "  else:"
    yield from (f"    {line}" for line in _targets(series))
    yield f"    servoj([{', '.join(f'q{joint}' for joint in joints)}], t=dt, {_servo(settings)})"
    yield "    step = step + 1"
    yield "  end"
    yield "end"


def _targets(series: FourierSeries) -> Iterator[str]:
    n_h = series.n_h
    for joint in range(SIX_JOINTS):
        yield f"q{joint + 1} = {_number(series.offset[joint])}"
    for k in range(1, n_h + 1):
        yield f"x = {k} * w * t"
        yield "s = sin(x)"
        yield "c = cos(x)"
        for joint in range(SIX_JOINTS):
            sine, cosine = series.coefficients[joint, k - 1], series.coefficients[joint, n_h + k - 1]
            yield f"q{joint + 1} = q{joint + 1} + {_number(sine)} * s + {_number(cosine)} * c"


def _ending(settings: ServoSettings) -> Iterator[str]:
    """Yield the hold in the start pose, until the arm has caught up with its last target, and the stop."""
    yield "t = 0.0"
    yield f"while t < {settings.pause:g}:"
    yield f"  servoj(start, t=dt, {_servo(settings)})"
    yield "  t = t + dt"
    yield "end"
    yield f"stopj({settings.approach_acceleration:g})"


def _servo(settings: ServoSettings) -> str:
    return f"lookahead_time={settings.lookahead:g}, gain={settings.gain:g}"


def _start(series: FourierSeries) -> FloatArray:
    return np.asarray(series.offset + series.coefficients[:, series.n_h :].sum(axis=1))


def _number(value: float) -> str:
    """Return a number without exponent; negative ones in brackets, so that they may stand after any operator."""
    text = f"{value:.{_DECIMALS}f}"
    return f"({text})" if value < 0.0 else text
