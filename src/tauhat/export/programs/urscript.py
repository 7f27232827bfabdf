"""URScript for Universal Robots: movej and movel with blend radii; metres, radians, rotation vectors.

Speed and acceleration of movej are those of the leading axis, the joint with the longest way, so they follow from the
parts of the limits that a move may use and from where it begins.

Source: Universal Robots, "The URScript programming language", motion module (movej, movel, sleep).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ExportError
from tauhat.excitation.waypoints.moves import JointMove, LineMove, Zone
from tauhat.excitation.waypoints.route import joint_rates
from tauhat.export.programs.cell import Cell, Leg
from tauhat.export.programs.digits import METRES, NUMBER, RADIANS, RATE, decimal, decimals, part, values_of
from tauhat.export.programs.program import Program
from tauhat.export.programs.reading import Gathered, passed, rule, scan
from tauhat.robots.kinematics import Pose
from tauhat.robots.transforms import rotation_of_vector, rotation_vector

COMMENT = "#"
UNSAID = (
    "The turning speed of the tool on lines is not stated: the controller has its own.",
    "Lines are those of the tool (TCP) that is set on the controller.",
)
_NUMBERS = r"\[([-\d.,\s]*)\]"
_RATES = rf", a={NUMBER}, v={NUMBER}(?:, r={NUMBER})?"


def write(cell: Cell, legs: Sequence[Leg], head: Sequence[str]) -> Iterator[str]:
    """Yield the lines of a program.

    Raises
    ------
    ExportError
        when a zone is no radius, or zones overlap, which the controller refuses.
    """
    _check_blends(cell, legs)
    settings = cell.settings
    yield f"def {settings.name}():"
    yield from (f"  {COMMENT} {line}" for line in head)
    limits = cell.planned.joint_limits(cell.robot)
    speed, acceleration = (settings.approach * float(values.min()) for values in (limits.velocity, limits.acceleration))
    yield f"  movej({_position(cell.shown(legs[0].begin))}, {_rates(acceleration, speed)})"
    indent = "  "
    if settings.repeats > 1:
        yield "  local done = 0"
        yield f"  while done < {settings.repeats}:"
        indent = "    "
    for leg in legs:
        yield indent + _statement(cell, leg)
        if leg.move.dwell > 0.0:
            yield f"{indent}sleep({decimal(leg.move.dwell, RATE)})"
    if settings.repeats > 1:
        yield "    done = done + 1"
        yield "  end"
    yield "end"


def _statement(cell: Cell, leg: Leg) -> str:
    move = leg.move
    radius = "" if move.zone is None else f", r={decimal(move.zone.radius or 0.0, METRES)}"
    if isinstance(move, JointMove):
        speed, acceleration = _leading(cell, leg.begin, move)
        rates = _rates(move.acceleration * acceleration, move.speed * speed)
        return f"movej({_position(cell.shown(move.target))}, {rates}{radius})"
    tool = cell.planned.tool
    rates = _rates(move.acceleration * tool.acceleration, move.speed * tool.speed)
    return f"movel({_goal(cell, move)}, {rates}{radius})"


def _goal(cell: Cell, move: LineMove) -> str:
    if not isinstance(move.target, Pose):
        return _position(cell.shown(move.target))
    pose = cell.target_pose(move)
    return f"p{_position(np.concatenate([pose.translation, rotation_vector(pose.rotation)]))}"


def _leading(cell: Cell, begin: FloatArray, move: JointMove) -> tuple[float, float]:
    """Return the speed and acceleration of the leading axis at the limits of the joints [rad/s, rad/s^2]."""
    whole = JointMove(target=move.target)
    rates = joint_rates(move.target - begin, cell.planned.joint_limits(cell.robot), whole)
    longest = float(np.abs(cell.shown(move.target) - cell.shown(begin)).max())
    return rates.speed * longest, rates.acceleration * longest


def _check_blends(cell: Cell, legs: Sequence[Leg]) -> None:
    for leg in legs:
        if leg.move.zone is not None and leg.move.zone.radius is None:
            raise ExportError("URScript knows no zone by parts of a way", where=leg.where, remedy="Zone(radius=...)")
    if any(leg.move.zone is not None for leg in legs):
        places = [cell.tool_pose(leg.end).translation for leg in legs]
        for (leg, after), (here, there) in zip(pairwise(legs), pairwise(places), strict=True):
            radii = sum(one.move.zone.radius or 0.0 for one in (leg, after) if one.move.zone is not None)
            distance = float(np.linalg.norm(there - here))
            if leg.move.zone is not None and radii >= distance:
                raise _overlapping(after.where, radii, distance)
        first, distance = legs[0], float(np.linalg.norm(places[0] - cell.tool_pose(legs[0].begin).translation))
        if first.move.zone is not None and (first.move.zone.radius or 0.0) >= distance:
            raise _overlapping(first.where, first.move.zone.radius or 0.0, distance)


def _overlapping(where: str, radii: float, distance: float) -> ExportError:
    return ExportError(
        "blend radii overlap, and the controller leaves out such a target", where=where,
        expected=f"together below the tool's distance, {distance:.4g} m", got=f"{radii:.4g} m", remedy="smaller zones",
    )  # fmt: skip


def _position(values: FloatArray) -> str:
    return f"[{decimals(values, RADIANS)}]"


def _rates(acceleration: float, speed: float) -> str:
    return f"a={decimal(acceleration, RATE)}, v={decimal(speed, RATE)}"


def read(cell: Cell, text: str) -> Program:
    """Return the motion of a program.

    Raises
    ------
    ExportError
        when a line is not among those that `write` writes.
    """
    gathered, here = Gathered(), [np.zeros(0)]

    def joint(match: re.Match[str]) -> None:
        target = cell.meant(_six(match[1]))
        if gathered.start is None:
            gathered.begin(target)
        else:
            whole = _leading(cell, here[0], JointMove(target=target))
            gathered.add(JointMove(target=target, **_parts(match, whole), zone=_zone(match)))
        here[0] = target

    def line(match: re.Match[str]) -> None:
        values, tool = _six(match[2]), cell.planned.tool
        shown = Pose(rotation=rotation_of_vector(values[3:]), translation=values[:3])
        target = cell.meant_pose(shown) if match[1] else cell.meant(values)
        parts = _parts(match, (tool.speed, tool.acceleration), first=3)
        move = LineMove(target=target, **parts, zone=_zone(match))
        gathered.add(move)
        here[0] = cell.line_end(here[0], move)

    def end(_: re.Match[str]) -> None:
        if gathered.looped and not gathered.closed:
            gathered.close()
        else:
            gathered.finish()

    rules = [
        rule(r"def [A-Za-z]\w*\(\):", passed),
        rule(rf"movej\( {_NUMBERS}{_RATES}\)", joint),
        rule(rf"movel\( (p?){_NUMBERS}{_RATES}\)", line),
        rule(rf"sleep\({NUMBER}\)", lambda match: gathered.dwell(float(match[1]))),
        rule(r"local done = 0", passed),
        rule(r"while done < (\d{1,6}):", lambda match: gathered.loop(int(match[1]))),
        rule(r"done = done \+ 1", passed),
        rule(r"end", end),
    ]
    scan(text, rules, language="URScript", comment=COMMENT)
    return gathered.program("URScript")


def _six(text: str) -> FloatArray:
    if not re.fullmatch(rf"\s*{NUMBER}(\s*,\s*{NUMBER}){{5}}\s*", text):
        raise ExportError("a target", expected="six numbers", got=text[:80])
    return values_of(text)


def _parts(match: re.Match[str], whole: tuple[float, float], first: int = 2) -> dict[str, float]:
    speed, acceleration = whole
    return {
        "speed": part(float(match[first + 1]), speed, "the speed"),
        "acceleration": part(float(match[first]), acceleration, "the acceleration"),
    }


def _zone(match: re.Match[str]) -> Zone | None:
    radius = match[match.re.groups]
    return None if radius is None else Zone(radius=float(radius))
