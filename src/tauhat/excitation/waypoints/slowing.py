"""Moves that ask too much of a joint are slowed until every limit holds, and say so."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ExcitationError
from tauhat.excitation.limits.joint_limits import MotionLimits
from tauhat.excitation.waypoints.ramps import Ramps
from tauhat.excitation.waypoints.route import Route
from tauhat.excitation.waypoints.schedule import Piece, Place, Tempo, first_tempo, schedule

_PARTS = 16  # of a phase, at whose ends limits are looked at
_MOST_PARTS = 1024
_ROUNDING = 1e-9  # part of a limit
_RESERVE = 2e-4  # part of a limit kept for what lies between the parts on curves that are no polynomials
_DOUBTFUL = 4.0 * _RESERVE  # what half the samples may miss: peaks of parabolas err by the third power of the step
_NEAR = 0.9  # of a limit: what uses less need not be known exactly
_MOST_ROUNDS = 100
_PUSH = 1.0 + 1e-4  # slowed a little more than asked, since speeds at the ends of a way follow in the next round
_REPORTED = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class Slowed:
    """A move that a limit of a joint made slower than its overrides ask for.

    move : from 1 on
    place : "way" for the whole of the move, "corner" for the zone at its target
    factor : of the speed, below 1
    limit : which, and of which joint
    """

    move: int
    place: Place
    factor: float
    limit: str

    def __str__(self) -> str:
        """Return it in words."""
        return f"move {self.move}: {self.place} slowed to {self.factor:.1%}, {self.limit}"


class _Excess(NamedTuple):
    """How much longer a piece must take, and for which limit."""

    stretch: float
    limit: str


def slow_down(
    route: Route, ramps: Ramps, limits: MotionLimits, joint_names: tuple[str, ...]
) -> tuple[tuple[Piece, ...], tuple[Slowed, ...]]:
    """Return the pieces of the motion with every limit kept, and what had to be slowed for it.

    Raises
    ------
    ExcitationError
        when a line or a corner leaves the range of a joint: slowing does not help there.
    """
    tempo, reasons = first_tempo(route), dict[tuple[int, Place], str]()
    unhurried = tempo
    for _ in range(_MOST_ROUNDS):
        pieces = schedule(route, tempo, ramps)
        factors, times = np.array(tempo.factors), np.array(tempo.corner_times)
        for piece in pieces:
            excess = _excess(piece, limits, joint_names)
            if excess is None:
                continue
            reasons[piece.move, piece.place] = excess.limit
            if piece.place == "way":
                factors[piece.move] /= excess.stretch * _PUSH
            else:
                times[piece.move] = piece.law.duration * excess.stretch * _PUSH
        if np.array_equal(factors, tempo.factors) and np.array_equal(times, tempo.corner_times):
            return pieces, _report(unhurried, tempo, reasons)
        tempo = Tempo(factors, times)
    raise ExcitationError("no tempo keeps the limits of the joints", where="waypoints", remedy="smaller zones, or none")


def _report(first: Tempo, last: Tempo, reasons: dict[tuple[int, Place], str]) -> tuple[Slowed, ...]:
    found = []
    for (move, place), limit in sorted(reasons.items()):
        factor = last.factors[move] if place == "way" else first.corner_times[move] / last.corner_times[move]
        if factor < 1.0 - _REPORTED:
            found.append(Slowed(move=move + 1, place=place, factor=float(factor), limit=limit))
    return tuple(found)


def _excess(piece: Piece, limits: MotionLimits, joint_names: tuple[str, ...]) -> _Excess | None:
    """Return what a piece exceeds; None where it keeps the limits."""
    reserve = _ROUNDING if piece.curve.polynomial else -_RESERVE
    used = np.zeros((3, len(joint_names)))
    for phase in range(piece.law.begin.size):
        used = np.maximum(used, _used(piece, phase, limits, joint_names))
    stretches = np.maximum(used, 0.0) ** np.array([[1.0], [0.5], [1.0 / 3.0]])
    if used.max() <= 1.0 + reserve:
        return None
    order, joint = np.unravel_index(int(stretches.argmax()), stretches.shape)
    name = ("speed", "acceleration", "jerk")[order]
    allowed = (1.0 + reserve) ** (1.0 / (order + 1.0))
    return _Excess(float(stretches.max() / allowed), f"{name} of {joint_names[joint]}")


def _used(piece: Piece, phase: int, limits: MotionLimits, joint_names: tuple[str, ...]) -> FloatArray:
    """Return how much of speed, acceleration and jerk one phase uses, (3, n_v).

    The grid is refined while it and its every second sample disagree on what comes near a limit.
    """
    parts = _PARTS
    while True:
        t, course = piece.law.within(phase, np.linspace(0.0, 1.0, parts + 1))
        state = piece.curve.state(course)
        _check_range(piece, state.q, limits, joint_names)
        used = np.zeros((3, len(joint_names)))
        used[:2] = _peak(state.dq) / limits.velocity, _peak(state.ddq) / limits.acceleration
        if limits.jerk is not None:
            used[2] = _peak_slope(state.ddq, float(t[1] - t[0])) / limits.jerk
        coarse = np.array([_peak(state.dq[::2]) / limits.velocity, _peak(state.ddq[::2]) / limits.acceleration])
        doubtful = (np.abs(used[:2] - coarse) > _DOUBTFUL) & (used[:2] > _NEAR)
        if piece.curve.polynomial or parts >= _MOST_PARTS or not doubtful.any():
            return used
        parts *= 2


def _check_range(piece: Piece, q: FloatArray, limits: MotionLimits, joint_names: tuple[str, ...]) -> None:
    highest, lowest = _peak(q, signs=(1.0,)), -_peak(q, signs=(-1.0,))
    outside = np.maximum(highest - limits.upper, limits.lower - lowest)
    joint = int(outside.argmax())
    if outside[joint] > _ROUNDING:
        raise ExcitationError(
            f"the {piece.place} of move {piece.move + 1} leaves the range of {joint_names[joint]}",
            expected=f"{limits.lower[joint]:g} to {limits.upper[joint]:g}",
            got=f"{lowest[joint]:.4g} to {highest[joint]:.4g}",
            remedy="another target, a smaller zone, or a joint move",
        )  # fmt: skip


def _peak(values: FloatArray, signs: tuple[float, ...] = (1.0, -1.0)) -> FloatArray:
    """Return the largest value of each column between its samples too, (n_v,): that of the parabola through three."""
    found = []
    for sign in signs:
        f = sign * values
        before, middle, after = f[:-2], f[1:-1], f[2:]
        bend = before - 2.0 * middle + after
        slope = 0.5 * (after - before)
        arched = (bend < 0.0) & (np.abs(slope) <= -bend)
        safe = np.where(arched, bend, -1.0)
        top = np.where(arched, middle - 0.5 * slope**2 / safe, middle)
        found.append(np.maximum(f.max(axis=0), top.max(axis=0)))
    return np.asarray(np.max(found, axis=0))


def _peak_slope(values: FloatArray, step: float) -> FloatArray:
    """Return a bound of the largest slope of each column, (n_v,): that of a step, and half the next change more."""
    slopes = np.diff(values, axis=0) / step
    change = np.abs(np.diff(slopes, axis=0))
    more = 0.5 * np.maximum(np.pad(change, ((1, 0), (0, 0))), np.pad(change, ((0, 1), (0, 0))))
    return np.asarray((np.abs(slopes) + more).max(axis=0))
