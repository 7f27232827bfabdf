"""TP programs for FANUC as LS text: J in per cent, L in mm/sec, CNT and FINE; positions behind the moves, W, P, R.

CNT tells how much of its speed the arm keeps at a target, not where it turns off. CNT100 is taken for the largest part
of a way that a zone has here, 0.4, and less in proportion.

Source: FANUC Robotics, "SYSTEM R-30iA / R-30iB, HandlingTool, setup and operations manual", program structure.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Sequence

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ExportError
from tauhat.excitation.waypoints.moves import LARGEST_PART, JointMove, LineMove, Zone
from tauhat.export.programs.angles import pose_in_degrees, pose_of_degrees
from tauhat.export.programs.cell import Cell, Leg
from tauhat.export.programs.digits import DEGREES, MILLIMETRES, NUMBER, decimal, part, whole_steps
from tauhat.export.programs.program import Program
from tauhat.export.programs.reading import Gathered, passed, rule, scan
from tauhat.robots.kinematics import Pose

COMMENT = "!"
UNSAID = (
    "CNT is no distance: how near a target is passed depends on the speed.",
    "ACC is a part of the accelerations set up on the controller, on lines too.",
    "The turning speed of the tool on lines is not stated: the controller has its own.",
)
_REMARK = 32  # letters of a remark on the pendant
_CNT = 100.0 / LARGEST_PART
DWELL = 0.01  # [s] step of WAIT
_LEAST_LENGTH = 1e-6  # [m] of a line
_ANGLES = "WPR"


def write(cell: Cell, legs: Sequence[Leg], head: Sequence[str]) -> Iterator[str]:
    """Yield the lines of a program.

    Raises
    ------
    ExportError
        when a speed, an acceleration, a zone or a dwell lies between the steps of the language.
    """
    settings = cell.settings
    yield f"/PROG  {settings.name.upper()}"
    yield "/ATTR"
    yield 'COMMENT = "tauhat motion";'
    yield "DEFAULT_GROUP = 1,*,*,*,*;"
    yield "/MN"
    for number, statement in enumerate(_main(cell, legs, head), 1):
        yield f"{number:4d}:{statement} ;"
    yield "/POS"
    yield from _joints(cell, 1, legs[0].begin)
    for leg in legs:
        yield from _position(cell, leg)
    yield "/END"


def _main(cell: Cell, legs: Sequence[Leg], head: Sequence[str]) -> Iterator[str]:
    settings = cell.settings
    for line in head:
        yield from (f"  {COMMENT}{piece}" for piece in textwrap.wrap(line, _REMARK))
    yield "  UFRAME_NUM=0"
    yield f"  UTOOL_NUM={settings.tool}"
    approach = round(100.0 * settings.approach)
    yield f"J P[1] {approach}% FINE ACC{approach}"
    if settings.repeats > 1:
        yield f"  FOR R[1]=1 TO {settings.repeats}"
    for leg in legs:
        yield _motion(cell, leg)
        if leg.move.dwell > 0.0:
            yield f"  WAIT {DWELL * whole_steps(leg.move.dwell, DWELL, 'dwell [s]', leg.where):.2f}(sec)"
    if settings.repeats > 1:
        yield "  ENDFOR"


def _motion(cell: Cell, leg: Leg) -> str:
    move, place = leg.move, f"P[{leg.number + 1}]"
    ending = (
        f"{_termination(leg)} ACC{whole_steps(100.0 * move.acceleration, 1.0, 'percentage of acceleration', leg.where)}"
    )
    if isinstance(move, JointMove):
        return f"J {place} {whole_steps(100.0 * move.speed, 1.0, 'percentage of speed', leg.where)}% {ending}"
    length = np.linalg.norm(cell.tool_pose(leg.end).translation - cell.tool_pose(leg.begin).translation)
    if length < _LEAST_LENGTH:
        raise ExportError("a turn on the spot has no speed in mm/sec", where=leg.where, remedy="use a joint move")
    speed = whole_steps(1e3 * move.speed * cell.planned.tool.speed, 1.0, "speed [mm/sec]", leg.where)
    return f"L {place} {speed}mm/sec {ending}"


def _termination(leg: Leg) -> str:
    zone = leg.move.zone
    if zone is None:
        return "FINE"
    if zone.part is None:
        raise ExportError("CNT is no radius", where=leg.where, remedy="Zone(part=...)")
    return f"CNT{whole_steps(_CNT * zone.part, 1.0, 'CNT of a zone', leg.where)}"


def _position(cell: Cell, leg: Leg) -> Iterator[str]:
    move = leg.move
    if not isinstance(move.target, Pose):
        yield from _joints(cell, leg.number + 1, move.target)
        return
    pose = pose_in_degrees(cell.shown_pose(move.target))
    x, y, z = (decimal(value, MILLIMETRES) for value in pose[:3])
    r, p, w = (decimal(value, DEGREES) for value in pose[3:])
    yield from (f"P[{leg.number + 1}]{{", "  GP1:")
    yield f"  UF : 0, UT : {cell.settings.tool}, CONFIG : '{cell.settings.configuration}',"
    yield f"  X = {x} mm, Y = {y} mm, Z = {z} mm,"
    yield f"  W = {w} deg, P = {p} deg, R = {r} deg"
    yield "};"


def _joints(cell: Cell, number: int, q: FloatArray) -> Iterator[str]:
    words = [f"J{joint}= {decimal(value, DEGREES)} deg" for joint, value in enumerate(np.rad2deg(cell.shown(q)), 1)]
    yield from (f"P[{number}]{{", "  GP1:", f"  UF : 0, UT : {cell.settings.tool},")
    yield f"  {', '.join(words[:3])},"
    yield f"  {', '.join(words[3:])}"
    yield "};"


class _Positions:
    """Positions by number: numbers as they come, six when complete, and whether they are of joints."""

    def __init__(self) -> None:
        self.values: dict[int, list[float]] = {}
        self.joints: dict[int, bool] = {}
        self.current = 0

    def open(self, match: re.Match[str]) -> None:
        self.current = int(match[1])
        if self.current in self.values:
            raise ExportError(f"P[{self.current}] twice")
        self.values[self.current] = []

    def take_joints(self, match: re.Match[str]) -> None:
        self.joints[self.current] = True
        self.take(match)

    def take(self, match: re.Match[str]) -> None:
        if self.current not in self.values:
            raise ExportError("numbers outside a position")
        self.values[self.current] += [float(text) for text in match.groups()]

    def close(self, _: re.Match[str]) -> None:
        found = self.values.get(self.current, [])
        if len(found) != 6:
            raise ExportError(f"P[{self.current}]", expected="six numbers", got=len(found))

    def target(self, cell: Cell, number: int) -> FloatArray | Pose:
        if number not in self.values:
            raise ExportError(f"P[{number}] is not among the positions")
        values = np.array(self.values[number])
        if self.joints.get(number, False):
            return cell.meant(np.deg2rad(values))
        order = [0, 1, 2, *(3 + _ANGLES.index(letter) for letter in "RPW")]
        return cell.meant_pose(pose_of_degrees(values[order]))


def read(cell: Cell, text: str) -> Program:
    """Return the motion of a program.

    Raises
    ------
    ExportError
        when a line is not among those that `write` writes.
    """
    main, found, positions = text.partition("/POS\n")
    if not found:
        raise ExportError("no positions", where="FANUC program", expected="a line /POS", remedy="is the file whole?")
    gathered, known = Gathered(), _Positions()
    _scan_positions(cell, "\n" * main.count("\n") + "\n" + positions, known, gathered)
    if not gathered.finished:
        raise ExportError("the end is missing", where="FANUC program", remedy="is the file whole?")
    gathered.finished = False
    _scan_main(cell, main, known, gathered)
    gathered.finish()
    return gathered.program("FANUC")


def _scan_positions(cell: Cell, text: str, known: _Positions, gathered: Gathered) -> None:
    tool, configuration = cell.settings.tool, re.escape(cell.settings.configuration).replace(r"\ ", " ")
    rules = [
        rule(r"P\[(\d{1,6})\] \{", known.open),
        rule(rf"GP1 :|UF : 0 , UT : {tool} ,|UF : 0 , UT : {tool} , CONFIG : '{configuration}' ,", passed),
        rule(rf"J1 = {NUMBER} deg , J2 = {NUMBER} deg , J3 = {NUMBER} deg ,", known.take_joints),
        rule(rf"J4 = {NUMBER} deg , J5 = {NUMBER} deg , J6 = {NUMBER} deg", known.take_joints),
        rule(rf"X = {NUMBER} mm , Y = {NUMBER} mm , Z = {NUMBER} mm ,", known.take),
        rule(rf"W = {NUMBER} deg , P = {NUMBER} deg , R = {NUMBER} deg", known.take),
        rule(r"\} ;", known.close),
        rule(r"/END", lambda _: gathered.finish()),
    ]
    scan(text, rules, language="FANUC", comment=COMMENT)


def _scan_main(cell: Cell, text: str, known: _Positions, gathered: Gathered) -> None:
    tool, ending = cell.planned.tool, r"(FINE|CNT\d{1,3}) ACC(\d{1,3}) ;"

    def joint(match: re.Match[str]) -> None:
        target = known.target(cell, int(match[1]))
        if isinstance(target, Pose):
            raise ExportError("a joint move to a pose", expected="J1 to J6 of the position")
        if gathered.start is None:
            gathered.begin(target)
            return
        speed, acceleration = (part(float(match[group]), 100.0, name) for group, name in ((2, "%"), (4, "ACC")))
        gathered.add(JointMove(target=target, speed=speed, acceleration=acceleration, zone=_zone(match[3])))

    def line(match: re.Match[str]) -> None:
        speed = part(float(match[2]) / 1e3, tool.speed, "the speed")
        acceleration, target = part(float(match[4]), 100.0, "ACC"), known.target(cell, int(match[1]))
        gathered.add(LineMove(target=target, speed=speed, acceleration=acceleration, zone=_zone(match[3])))

    numbered = r"\d{1,7} : "
    rules = [
        rule(r"/PROG [A-Za-z]\w*|/ATTR|/MN", passed),
        rule(r'COMMENT = "[^"]*" ;|DEFAULT_GROUP = 1,\*,\*,\*,\* ;', passed),
        rule(rf"{numbered}(?:!.*|UFRAME_NUM = 0|UTOOL_NUM = {cell.settings.tool}) ;", passed),
        rule(rf"{numbered}J P\[(\d{{1,6}})\] (\d{{1,3}})% {ending}", joint),
        rule(rf"{numbered}L P\[(\d{{1,6}})\] (\d{{1,5}})mm/sec {ending}", line),
        rule(rf"{numbered}WAIT {NUMBER}\(sec\) ;", lambda match: gathered.dwell(float(match[1]))),
        rule(rf"{numbered}FOR R\[1\] = 1 TO (\d{{1,6}}) ;", lambda match: gathered.loop(int(match[1]))),
        rule(rf"{numbered}ENDFOR ;", lambda _: gathered.close()),
    ]
    scan(text, rules, language="FANUC", comment=COMMENT)


def _zone(word: str) -> Zone | None:
    return None if word == "FINE" else Zone(part=float(word[3:]) / _CNT)
