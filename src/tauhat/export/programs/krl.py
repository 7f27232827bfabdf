"""KRL for KUKA: PTP in per cent of axis speeds, LIN in metres per second, C_PTP and C_DIS; angles A, B, C.

$APO.CPTP = 100 begins a corner in the middle of a way, so a zone's part p is 200 p per cent.

Source: KUKA Roboter, "KUKA System Software, operating and programming instructions for system integrators", KRL syntax.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ExportError
from tauhat.excitation.waypoints.moves import JointMove, LineMove, Zone
from tauhat.export.programs.angles import pose_in_degrees, pose_of_degrees
from tauhat.export.programs.cell import Cell, Leg
from tauhat.export.programs.digits import DEGREES, MILLIMETRES, NUMBER, RATE, decimal, part, whole_steps
from tauhat.export.programs.program import Program
from tauhat.export.programs.reading import Gathered, Registers, passed, rule, scan

COMMENT = ";"
UNSAID = (
    "Accelerations of joint moves are parts of those set up on the controller.",
    "Lines are those of the tool data named in BAS(#TOOL, n).",
)
_AXES = tuple(f"A{joint}" for joint in range(1, 7))
_PLACES = ("X", "Y", "Z", "A", "B", "C")
_CP = ("VEL.CP", "VEL.ORI1", "VEL.ORI2", "ACC.CP", "ACC.ORI1", "ACC.ORI2")
_SAME = 1e-9


def write(cell: Cell, legs: Sequence[Leg], head: Sequence[str]) -> Iterator[str]:
    """Yield the lines of a program.

    Raises
    ------
    ExportError
        when an override of a joint move is no whole percentage, or a zone has no word in KRL.
    """
    _check_zones(legs)
    settings = cell.settings
    yield f"DEF {settings.name}()"
    yield from (f"{COMMENT} {line}" for line in head)
    if settings.repeats > 1:
        yield "DECL INT i"
    yield "BAS(#INITMOV, 0)"
    yield f"BAS(#TOOL, {settings.tool})"
    yield "BAS(#BASE, 0)"
    yield "$ADVANCE = 3"
    yield from _percentages(round(100.0 * settings.approach), round(100.0 * settings.approach))
    yield _ptp(cell, legs[0].begin)
    if settings.repeats > 1:
        yield f"FOR i = 1 TO {settings.repeats}"
    for leg in legs:
        yield from _statements(cell, leg)
    if settings.repeats > 1:
        yield "ENDFOR"
    yield "END"


def _statements(cell: Cell, leg: Leg) -> Iterator[str]:
    move = leg.move
    if isinstance(move, JointMove):
        speed, acceleration = (
            whole_steps(100.0 * value, 1.0, f"percentage of {name}", leg.where)
            for name, value in (("speed", move.speed), ("acceleration", move.acceleration))
        )
        yield from _percentages(speed, acceleration)
        if move.zone is not None:
            yield f"$APO.CPTP = {whole_steps(200.0 * (move.zone.part or 0.0), 1.0, 'percentage of a zone', leg.where)}"
        yield _ptp(cell, move.target) + (" C_PTP" if move.zone is not None else "")
    else:
        yield from (
            f"${name} = {decimal(value, RATE)}" for name, value in zip(_CP, _line_rates(cell, move), strict=True)
        )
        if move.zone is not None:
            yield f"$APO.CDIS = {decimal(1e3 * (move.zone.radius or 0.0), MILLIMETRES)}"
        values = zip(_PLACES, pose_in_degrees(cell.target_pose(move)), strict=True)
        words = ", ".join(f"{name} {decimal(value, DEGREES)}" for name, value in values)
        yield f"LIN {{{words}}}" + (" C_DIS" if move.zone is not None else "")
    if move.dwell > 0.0:
        yield f"WAIT SEC {decimal(move.dwell, RATE)}"


def _percentages(speed: int, acceleration: int) -> tuple[str, str]:
    return f"BAS(#VEL_PTP, {speed})", f"BAS(#ACC_PTP, {acceleration})"


def _ptp(cell: Cell, target: FloatArray) -> str:
    values = zip(_AXES, np.rad2deg(cell.shown(target)), strict=True)
    return f"PTP {{{', '.join(f'{name} {decimal(value, DEGREES)}' for name, value in values)}}}"


def _line_rates(cell: Cell, move: LineMove) -> tuple[float, ...]:
    """Return speeds and accelerations of a line in the order of `_CP` [m/s, deg/s, m/s^2, deg/s^2]."""
    tool, (speed, acceleration) = cell.planned.tool, (move.speed, move.acceleration)
    turn, turn_up = np.rad2deg(speed * tool.turn_speed), np.rad2deg(acceleration * tool.turn_acceleration)
    return (speed * tool.speed, turn, turn, acceleration * tool.acceleration, turn_up, turn_up)


def _check_zones(legs: Sequence[Leg]) -> None:
    for leg, after in pairwise(legs):
        zone, line = leg.move.zone, isinstance(leg.move, LineMove)
        if zone is None:
            continue
        if line != isinstance(after.move, LineMove):
            message = "KRL sizes a zone between a joint move and a line twice, in per cent and in millimetres"
            raise ExportError(message, where=leg.where, remedy="stop there, or make both moves of one kind")
        if (zone.radius is None) == line:
            expected = "Zone(radius=...) between lines, Zone(part=...) between joint moves"
            raise ExportError("KRL has no word for this zone", where=leg.where, expected=expected)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Reader:
    """Takes the moves, with what holds for them."""

    cell: Cell
    gathered: Gathered
    held: Registers

    def ptp(self, match: re.Match[str]) -> None:
        target = self.cell.meant(np.deg2rad([float(match[joint]) for joint in range(1, 7)]))
        if self.gathered.start is None:
            self.gathered.begin(target)
            return
        zone = Zone(part=self.held.value("APO.CPTP") / 200.0) if match[7] else None
        speed, acceleration = self.held.value("VEL_PTP") / 100.0, self.held.value("ACC_PTP") / 100.0
        self.gathered.add(JointMove(target=target, speed=speed, acceleration=acceleration, zone=zone))

    def lin(self, match: re.Match[str]) -> None:
        pose = pose_of_degrees(np.array([float(match[place]) for place in range(1, 7)]))
        tool, zone = self.cell.planned.tool, Zone(radius=self.held.value("APO.CDIS") / 1e3) if match[7] else None
        move = LineMove(
            target=self.cell.meant_pose(pose),
            speed=part(self.held.value("VEL.CP"), tool.speed, "the speed"),
            acceleration=part(self.held.value("ACC.CP"), tool.acceleration, "the acceleration"),
            zone=zone,
        )
        self.check_turns(move)
        self.gathered.add(move)

    def check_turns(self, move: LineMove) -> None:
        for name, expected in zip(_CP, _line_rates(self.cell, move), strict=True):
            if abs(self.held.value(name) / expected - 1.0) > 1e3 * _SAME:
                message = f"${name} is another part of its limit than the speed of the tool"
                raise ExportError(message, expected=f"{expected:g}", got=f"{self.held.value(name):g}")


def read(cell: Cell, text: str) -> Program:
    """Return the motion of a program.

    Raises
    ------
    ExportError
        when a line is not among those that `write` writes.
    """
    gathered, held = Gathered(), Registers()
    reader = _Reader(cell=cell, gathered=gathered, held=held)
    axes = ", ".join(rf"{name} {NUMBER}" for name in _AXES)
    places = ", ".join(rf"{name} {NUMBER}" for name in _PLACES)
    tool = cell.settings.tool
    rules = [
        rule(r"DEF [A-Za-z]\w*\( \)", passed),
        rule(r"DECL INT i", passed),
        rule(rf"BAS\( #INITMOV, 0 \)|BAS\( #TOOL, {tool} \)|BAS\( #BASE, 0 \)|\$ADVANCE = 3", passed),
        rule(r"BAS\( #(VEL_PTP|ACC_PTP), (\d{1,3}) \)", held.put),
        rule(rf"\$({'|'.join(map(re.escape, (*_CP, 'APO.CPTP', 'APO.CDIS')))}) = {NUMBER}", held.put),
        rule(rf"PTP \{{ {axes} \}}( C_PTP)?", reader.ptp),
        rule(rf"LIN \{{ {places} \}}( C_DIS)?", reader.lin),
        rule(rf"WAIT SEC {NUMBER}", lambda match: gathered.dwell(float(match[1]))),
        rule(r"FOR i = 1 TO (\d{1,6})", lambda match: gathered.loop(int(match[1]))),
        rule(r"ENDFOR", lambda _: gathered.close()),
        rule(r"END", lambda _: gathered.finish()),
    ]
    scan(text, rules, language="KRL", comment=COMMENT)
    return gathered.program("KRL")
