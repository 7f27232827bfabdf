"""When a motion is where: speeds in the corners, looked ahead, and the courses of speed between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.excitation.waypoints.curves import Curve, Stand
from tauhat.excitation.waypoints.ramps import Ramps
from tauhat.excitation.waypoints.route import Route
from tauhat.excitation.waypoints.time_law import RateLimits, TimeLaw, steady

Place: TypeAlias = Literal["way", "corner", "stand"]
"""Which part of a move: its way, the corner at its target, or standing there."""

_NO_WAY = 1e-12  # part of a way between two corners that is left out


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Piece:
    """A part of a motion: a curve and when it is passed.

    move : whose it is, from 0 on
    """

    curve: Curve
    law: TimeLaw
    move: int
    place: Place


class Tempo(NamedTuple):
    """What slows a route beyond its own limits.

    factors : (n,) of the speed of each way, at most 1
    corner_times : (n - 1,) shortest time of each corner [s]; zero where there is none
    """

    factors: FloatArray
    corner_times: FloatArray


def first_tempo(route: Route) -> Tempo:
    """Return the tempo at which nothing is slowed."""
    least = [0.0 if bend is None else bend.least for bend in route.bends]
    return Tempo(np.ones(len(route.ways)), np.array(least, dtype=np.float64))


def schedule(route: Route, tempo: Tempo, ramps: Ramps) -> tuple[Piece, ...]:
    """Return the pieces of the fastest motion in which each corner is passed at constant pace."""
    limits = [rates.slowed(factor) for rates, factor in zip(route.limits, tempo.factors, strict=True)]
    times = _corner_times(route, limits, tempo, ramps)
    pieces: list[Piece] = []
    for move, way in enumerate(route.ways):
        first, last = _between(route, move)
        rates = _rates(route, times, move)
        if last - first > _NO_WAY:
            law = ramps.law((first, last), rates, limits[move])
            pieces.append(Piece(curve=way, law=law, move=move, place="way"))
        if move < len(times) and (turn := route.bends[move]) is not None:
            pieces.append(Piece(curve=turn.corner, law=steady(times[move]), move=move, place="corner"))
        if route.dwells[move] > 0.0:
            pieces.append(Piece(curve=Stand(q=way.end), law=steady(route.dwells[move]), move=move, place="stand"))
    return tuple(pieces)


def _corner_times(route: Route, limits: list[RateLimits], tempo: Tempo, ramps: Ramps) -> FloatArray:
    """Return how long each corner lasts, (n - 1,) [s].

    A corner is passed as fast as its own limits and both ways allow; then forward, no faster than the way before can
    speed up to, and backward, no faster than the way behind can slow down from.
    """
    times = np.array(tempo.corner_times)
    for k, turn in enumerate(route.bends):
        if turn is not None:
            shape = turn.corner.shape
            fastest = (2.0 * shape.ending / limits[k].speed, 2.0 * shape.beginning / limits[k + 1].speed)
            times[k] = max(times[k], *fastest)
    for move in range(len(route.ways) - 1):
        turn = route.bends[move]
        if turn is not None:
            first, last = _between(route, move)
            begin, end = _rates(route, times, move)
            fastest_end = ramps.reachable(begin, last - first, limits[move])
            times[move] *= max(1.0, end / fastest_end)
    for move in range(len(route.ways) - 1, 0, -1):
        turn = route.bends[move - 1]
        if turn is not None:
            first, last = _between(route, move)
            begin, end = _rates(route, times, move)
            fastest_begin = ramps.reachable(end, last - first, limits[move])
            times[move - 1] *= max(1.0, begin / fastest_begin)
    return times


def _between(route: Route, move: int) -> tuple[float, float]:
    """Return the parts of a way at which the corner before it ends and the one behind it begins."""
    before = route.bends[move - 1] if move > 0 else None
    behind = route.bends[move] if move < len(route.bends) else None
    first = 0.0 if before is None else before.corner.shape.beginning
    return first, 1.0 if behind is None else 1.0 - behind.corner.shape.ending


def _rates(route: Route, times: FloatArray, move: int) -> tuple[float, float]:
    """Return the speeds of a way's fraction after the corner before it and ahead of the one behind it [1/s]."""
    before = route.bends[move - 1] if move > 0 else None
    behind = route.bends[move] if move < len(route.bends) else None
    first = 0.0 if before is None else 2.0 * before.corner.shape.beginning / times[move - 1]
    last = 0.0 if behind is None else 2.0 * behind.corner.shape.ending / times[move]
    return float(first), float(last)
