"""Samples as lines of text, as another program pipes them: JSON objects, or CSV behind a header.

    {"t": 0.004, "q": [0.1, -1.2], "tau": [3.1, 20.4]}        t,q_1,q_2,tau_1,tau_2
                                                              0.004,0.1,-1.2,3.1,20.4
Seconds, rad or m, Nm or N on the joint side. A line that is no sample is None, whatever is in it.
"""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable, Iterator, Sequence
from typing import IO, Any, NamedTuple, TypeAlias

from tauhat.errors import SensingError
from tauhat.robots.robot import Robot

_LONGEST = 100_000  # [bytes] of a line; a longer one is no sample
_MOST_UNKNOWN = 10  # lines before the format has to be clear
_COLUMN = re.compile(r"(q|tau)_([1-9][0-9]?)")


class Sample(NamedTuple):
    """A line's time stamp, positions and torques, of any number of joints and perhaps not finite."""

    t: float
    q: list[float]
    tau: list[float]


_Reader: TypeAlias = Callable[[str], Sample | None]


def read_samples(lines: IO[bytes], robot: Robot) -> Iterator[Sample | None]:
    """Yield the sample of each line as soon as it is there, None for one that is none; empty lines are passed over.

    Raises
    ------
    SensingError
        when the first ten lines are neither JSON objects nor a header with `t, q_1 .., tau_1 ..`, or what they hold is
        of another robot.
    """
    reader: _Reader | None = None
    unknown = 0
    for text in _lines(lines):
        if text is not None and not text.strip():
            continue
        if reader is None and text is not None:
            reader, is_header = _reader_for(text, robot)
            if is_header:
                continue
        if reader is None:
            unknown += 1
            if unknown >= _MOST_UNKNOWN:
                raise SensingError(
                    "neither JSON lines nor CSV with a header", where="standard input", got=str(text)[:60],
                    expected='{"t": ..., "q": [...], "tau": [...]} or t,q_1,..,tau_1,..',
                )  # fmt: skip
        yield reader(text) if reader is not None and text is not None else None


def _lines(stream: IO[bytes]) -> Iterator[str | None]:
    """Yield lines as text, None for those that are too long or no UTF-8."""
    while line := stream.readline(_LONGEST):
        if not line.endswith(b"\n") and len(line) == _LONGEST:
            while line and not line.endswith(b"\n"):
                line = stream.readline(_LONGEST)
            yield None
            continue
        try:
            yield line.decode("utf-8-sig")
        except UnicodeDecodeError:
            yield None


def _reader_for(text: str, robot: Robot) -> tuple[_Reader | None, bool]:
    """Return what reads the lines of a stream, and whether this one was the header."""
    if text.lstrip().startswith("{"):
        return lambda line: _from_json(line, robot), False
    names = [name.strip() for name in next(csv.reader([text]), [])]
    if "t" not in names or "q_1" not in names:
        return None, False
    places = _places(names, robot)
    return lambda line: _from_csv(line, places, len(names)), True


def _places(names: Sequence[str], robot: Robot) -> list[int]:
    """Return where in a row time, positions and torques are."""
    found = {name for name in names if _COLUMN.fullmatch(name)}
    wanted = [f"{kind}_{joint + 1}" for kind in ("q", "tau") for joint in range(robot.n_v)]
    if found != set(wanted):
        raise SensingError(
            "columns of another robot", where="standard input", expected=f"t, {', '.join(wanted)}",
            got=", ".join(sorted(found, key=names.index)),
        )  # fmt: skip
    return [names.index(name) for name in ("t", *wanted)]


def _from_csv(line: str, places: Sequence[int], width: int) -> Sample | None:
    try:
        cells = next(csv.reader([line]))
        if len(cells) != width:
            return None
        t, *rest = (float(cells[place]) for place in places)
    except (ValueError, StopIteration, csv.Error):
        return None
    half = len(rest) // 2
    return Sample(t, rest[:half], rest[half:])


def _from_json(line: str, robot: Robot) -> Sample | None:
    try:
        data = json.loads(line)
    except (ValueError, RecursionError):
        return None
    return sample_of(data, robot, where="standard input")


def sample_of(data: object, robot: Robot, *, where: str) -> Sample | None:
    """Return the sample that decoded JSON holds, None where it holds none.

    Raises
    ------
    SensingError
        when it names the joints of another robot.
    """
    if not isinstance(data, dict):
        return None
    names = data.get("joints")
    if names is not None and names != list(robot.joint_names):
        raise SensingError(
            "samples of another robot", where=where, expected=", ".join(robot.joint_names), got=str(names)[:200]
        )
    t, q, tau = _numbers([data.get("t")]), _numbers(data.get("q")), _numbers(data.get("tau"))
    return None if t is None or q is None or tau is None else Sample(t[0], q, tau)


def _numbers(values: Any) -> list[float] | None:
    if not isinstance(values, list) or any(isinstance(value, bool) for value in values):
        return None
    if not all(isinstance(value, int | float) for value in values):
        return None
    try:
        return [float(value) for value in values]
    except OverflowError:
        return None
