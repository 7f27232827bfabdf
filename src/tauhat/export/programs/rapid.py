"""RAPID for ABB: MoveAbsJ and MoveL with speed data and zone data; quaternions w, x, y, z.

Speed data are those of the tool, on joint moves too; parts of the joint limits are said with VelSet and AccSet on vmax.

Source: ABB Robotics, "Technical reference manual: RAPID instructions, functions and data types".
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ExportError
from tauhat.excitation.waypoints.moves import JointMove, LineMove, Zone
from tauhat.export.programs.angles import rotation_of_quaternion
from tauhat.export.programs.cell import Cell, Leg
from tauhat.export.programs.digits import (
    DEGREES,
    MILLIMETRES,
    NUMBER,
    RADIANS,
    RATE,
    decimal,
    decimals,
    part,
    values_of,
)
from tauhat.export.programs.program import Program
from tauhat.export.programs.reading import Gathered, Registers, passed, rule, scan
from tauhat.robots.kinematics import Pose
from tauhat.robots.transforms import quaternion

COMMENT = "!"
UNSAID = (
    "Speeds of joint moves are parts of vmax of the tool (VelSet): the controller may make more or less of the joints.",
    "Accelerations of joint moves are parts of those set up on the controller (AccSet).",
    "Lines are those of the tool data named at the end of each move.",
)
LEAST_ACCELERATION = 0.2  # below which AccSet makes 20 per cent of it
LEAST_PATH = 0.1  # of PathAccLim [m/s^2]
_NO_AXES = "[9E9,9E9,9E9,9E9,9E9,9E9]"
_KNOWN_ZONES = (1, 5, 10, 15, 20, 30, 40, 50, 60, 80, 100, 150, 200)  # [mm] of the zone data z1 to z200
_MOST_TOOL_SPEED = 7000  # [mm/s] to which VelSet bounds it: above what robots reach
_SAME = 1e-6


def write(cell: Cell, legs: Sequence[Leg], head: Sequence[str]) -> Iterator[str]:
    """Yield the lines of a program.

    Raises
    ------
    ExportError
        when a zone is no radius, or an acceleration is below what can be said.
    """
    settings = cell.settings
    yield f"MODULE {settings.name}_module"
    yield f"  PROC {settings.name}()"
    yield from (f"    {COMMENT} {line}" for line in head)
    yield r"    ConfL \Off;"
    yield "    PathAccLim FALSE, FALSE;"
    yield f"    VelSet {decimal(100.0 * settings.approach, RATE)}, {_MOST_TOOL_SPEED};"
    yield "    AccSet 20, 100;"
    yield f"    {_joint_move(cell, legs[0].begin, 'fine')}"
    indent = "    "
    if settings.repeats > 1:
        yield f"    FOR i FROM 1 TO {settings.repeats} DO"
        indent = "      "
    for leg in legs:
        yield from (indent + statement for statement in _statements(cell, leg))
    if settings.repeats > 1:
        yield "    ENDFOR"
    yield "    PathAccLim FALSE, FALSE;"  # these settings stay in force for the next program otherwise
    yield f"    VelSet 100, {_MOST_TOOL_SPEED};"
    yield "    AccSet 100, 100;"
    yield r"    ConfL \On;"
    yield "  ENDPROC"
    yield "ENDMODULE"


def _statements(cell: Cell, leg: Leg) -> Iterator[str]:
    move, zone = leg.move, _zone_word(leg)
    if isinstance(move, JointMove):
        if move.acceleration < LEAST_ACCELERATION:
            raise ExportError(
                "RAPID knows no acceleration this low", where=leg.where,
                expected=f"at least {LEAST_ACCELERATION:g}", got=f"{move.acceleration:g}",
            )  # fmt: skip
        yield "PathAccLim FALSE, FALSE;"
        yield f"VelSet {decimal(100.0 * move.speed, RATE)}, {_MOST_TOOL_SPEED};"
        yield f"AccSet {decimal(100.0 * move.acceleration, RATE)}, 100;"
        yield _joint_move(cell, move.target, zone)
    else:
        acceleration = move.acceleration * cell.planned.tool.acceleration
        if acceleration < LEAST_PATH:
            expected = f"at least {LEAST_PATH:g} m/s^2"
            raise ExportError(
                "RAPID knows no acceleration this low", where=leg.where, expected=expected, got=f"{acceleration:g}"
            )
        bound = decimal(acceleration, RATE)
        yield f"VelSet 100, {_MOST_TOOL_SPEED};"
        yield "AccSet 100, 100;"
        yield rf"PathAccLim TRUE \AccMax:={bound}, TRUE \DecelMax:={bound};"
        yield _line_move(cell, move, zone)
    if move.dwell > 0.0:
        yield f"WaitTime {decimal(move.dwell, RATE)};"


def _joint_move(cell: Cell, target: FloatArray, zone: str) -> str:
    values = decimals(np.rad2deg(cell.shown(target)), DEGREES)
    return rf"MoveAbsJ [[{values}],{_NO_AXES}] \NoEOffs, vmax, {zone}, tool{cell.settings.tool} \WObj:=wobj0;"


def _line_move(cell: Cell, move: LineMove, zone: str) -> str:
    pose, tool = cell.target_pose(move), cell.planned.tool
    place, turn = decimals(1e3 * pose.translation, MILLIMETRES), decimals(quaternion(pose.rotation), RADIANS)
    speed, turn_speed = 1e3 * move.speed * tool.speed, float(np.rad2deg(move.speed * tool.turn_speed))
    data = decimals([speed, turn_speed, speed, turn_speed], RATE)
    goal = f"[[{place}],[{turn}],[0,0,0,0],{_NO_AXES}]"
    return rf"MoveL {goal}, [{data}], {zone}, tool{cell.settings.tool} \WObj:=wobj0;"


def _zone_word(leg: Leg) -> str:
    """Return the zone data of a target; those that are no known ones in the proportions of the known."""
    zone = leg.move.zone
    if zone is None:
        return "fine"
    if zone.radius is None:
        raise ExportError("RAPID knows no zone by parts of a way", where=leg.where, remedy="Zone(radius=...)")
    radius = 1e3 * zone.radius
    if round(radius) in _KNOWN_ZONES and abs(radius - round(radius)) < _SAME:
        return f"z{round(radius)}"
    turn = 0.15 * radius
    return f"[FALSE,{decimals([radius, 1.5 * radius, 1.5 * radius, turn, 1.5 * radius, turn], MILLIMETRES)}]"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Reader:
    """Takes the moves, with what holds for them."""

    cell: Cell
    gathered: Gathered
    held: Registers

    def limit(self, match: re.Match[str]) -> None:
        if match[1] != match[2]:
            raise ExportError("PathAccLim with two values", got=f"{match[1]} and {match[2]}")
        self.held.values["PathAccLim"] = float(match[1])

    def unlimit(self, _: re.Match[str]) -> None:
        self.held.values.pop("PathAccLim", None)

    def joint(self, match: re.Match[str]) -> None:
        target = self.cell.meant(np.deg2rad(values_of(match[1])))
        if self.gathered.start is None:
            self.gathered.begin(target)
            return
        speed = part(self.held.value("VelSet"), 100.0, "VelSet")
        acceleration = part(self.held.value("AccSet"), 100.0, "AccSet")
        self.gathered.add(JointMove(target=target, speed=speed, acceleration=acceleration, zone=_zone(match[2])))

    def line(self, match: re.Match[str]) -> None:
        tool, data = self.cell.planned.tool, values_of(match[3])
        shown = Pose(rotation=rotation_of_quaternion(values_of(match[2])), translation=values_of(match[1]) / 1e3)
        speed = part(data[0] / 1e3, tool.speed, "the speed")
        expected = np.array([1e3 * tool.speed, np.rad2deg(tool.turn_speed)] * 2) * speed
        if not np.allclose(data, expected, rtol=_SAME, atol=0.0):
            raise ExportError("speed data of which turns are another part of their limit", expected=expected, got=data)
        if self.held.value("VelSet") != 100.0 or self.held.value("AccSet") != 100.0:
            raise ExportError("a line under VelSet or AccSet", expected="both 100")
        acceleration = part(self.held.value("PathAccLim"), tool.acceleration, "PathAccLim")
        target = self.cell.meant_pose(shown)
        self.gathered.add(LineMove(target=target, speed=speed, acceleration=acceleration, zone=_zone(match[4])))


def _zone(word: str) -> Zone | None:
    if word == "fine":
        return None
    if word.startswith("z"):
        if int(word[1:]) not in _KNOWN_ZONES:
            raise ExportError("unknown zone data", expected=", ".join(f"z{size}" for size in _KNOWN_ZONES), got=word)
        return Zone(radius=int(word[1:]) / 1e3)
    return Zone(radius=float(word.strip("[]").split(",")[1]) / 1e3)


def read(cell: Cell, text: str) -> Program:
    """Return the motion of a program.

    Raises
    ------
    ExportError
        when a line is not among those that `write` writes.
    """
    gathered, held = Gathered(), Registers()
    reader = _Reader(cell=cell, gathered=gathered, held=held)
    ending = rf"tool{cell.settings.tool} \\WObj:=wobj0;"
    zone = rf"(fine|z\d{{1,3}}|\[FALSE{f',{_plain()}' * 6}\])"
    pose = rf"\[{_list(3)}\],\[{_list(4)}\]"
    rules = [
        rule(r"MODULE [A-Za-z]\w*|PROC [A-Za-z]\w*\(\)|ConfL \\(?:On|Off);", passed),
        rule(rf"(VelSet) {NUMBER}, {_MOST_TOOL_SPEED};", held.put),
        rule(rf"(AccSet) {NUMBER}, 100;", held.put),
        rule(r"PathAccLim FALSE, FALSE;", reader.unlimit),
        rule(rf"PathAccLim TRUE \\AccMax:={NUMBER}, TRUE \\DecelMax:={NUMBER};", reader.limit),
        rule(rf"MoveAbsJ \[\[{_list(6)}\],{re.escape(_NO_AXES)}\] \\NoEOffs, vmax, {zone}, {ending}", reader.joint),
        rule(rf"MoveL \[{pose},\[0,0,0,0\],{re.escape(_NO_AXES)}\], \[{_list(4)}\], {zone}, {ending}", reader.line),
        rule(rf"WaitTime {NUMBER};", lambda match: gathered.dwell(float(match[1]))),
        rule(r"FOR i FROM 1 TO (\d{1,6}) DO", lambda match: gathered.loop(int(match[1]))),
        rule(r"ENDFOR", lambda _: gathered.close()),
        rule(r"ENDPROC", passed),
        rule(r"ENDMODULE", lambda _: gathered.finish()),
    ]
    scan(text, rules, language="RAPID", comment=COMMENT)
    return gathered.program("RAPID")


def _plain() -> str:
    return NUMBER.replace("(-?", "(?:-?")


def _list(count: int) -> str:
    return f"({','.join([_plain()] * count)})"
