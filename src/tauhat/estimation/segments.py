"""Segments of a recording in which friction shows by itself: runs at constant speed, and reversals.

Forwards and backwards at the same speed and pose a joint needs `gravity + friction` and `gravity - friction`: half the
sum is gravity, half the difference friction. Where a joint turns back, inertia and gravity go on smoothly and friction
jumps to its other side.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray
from tauhat.errors import ModelError
from tauhat.estimation.problem import Problem
from tauhat.estimation.rows import filtered_rows
from tauhat.recordings.processing import STANDSTILL, interpolated, unwrapped

_STILL = 1e-3  # [rad/s or m/s] a joint slower than this stands, whatever its top speed
_PER_BIN = 8  # places at which two runs are compared in each bin of position
_FEWEST = 6  # rows of a reversal


@dataclass(frozen=True, slots=True, kw_only=True)
class SegmentRules:
    """What counts as a segment.

    shortest : of a run at constant speed [s]
    change : largest change of speed in that time, in parts of the speed
    alike : largest difference of two runs' speeds, in parts of their mean
    pose : how far other joints may be apart in two runs [rad or m]
    bins : of position, over the range of each joint
    window : half the time about a reversal [s]
    """

    shortest: float = 0.3
    change: float = 0.05
    alike: float = 0.1
    pose: float = 0.03
    bins: int = 8
    window: float = 0.2

    def __post_init__(self) -> None:
        positive = (self.shortest, self.change, self.alike, self.pose, self.window)
        if not (all(value > 0.0 for value in positive) and self.bins >= 1):
            raise ModelError("rules of segments", expected="positive numbers, at least one bin", got=self)


class Track(NamedTuple):
    """The filtered rows of one recording: times (n,), position, speed, torque (n, n_v), columns (n, n_v, n_b)."""

    t: FloatArray
    q: FloatArray
    dq: FloatArray
    tau: FloatArray
    columns: FloatArray


class ConstantRun(NamedTuple):
    """Rows `rows` of a track in which `joint` alone moves, at constant signed `speed` [rad/s or m/s]."""

    track: Track
    joint: int
    rows: slice
    speed: float


class Reversal(NamedTuple):
    """Rows `rows` of a track about the time `t` at which `joint` turns back [s]."""

    track: Track
    joint: int
    rows: slice
    t: float


class Contrast(NamedTuple):
    """Two runs in one bin of position.

    speed, position : [rad/s or m/s, rad or m]
    friction, gravity : half the difference and half the sum of the torques [Nm or N]
    columns : (n_b,) half the difference of the regressor's columns
    rows : number of rows of the recordings behind it
    """

    joint: int
    speed: float
    position: float
    friction: float
    gravity: float
    columns: FloatArray
    rows: float


def tracks(problem: Problem) -> tuple[Track, ...]:
    """Return the filtered rows of every recording, with positions."""
    layout = problem.model.layout(problem.base.independent)
    found = []
    for recording in problem.recordings:
        rows = list(filtered_rows(problem.model, layout, recording, problem.processing))
        if not rows:
            continue
        t = np.concatenate([part.t for part in rows])
        flat = np.concatenate([part.columns for part in rows], axis=1)
        columns = np.zeros((t.size, problem.model.robot.n_v, problem.base.n_b))
        for joint, support in enumerate(problem.evidence.supports):
            columns[:, joint, support] = flat[layout.of_joint(joint)].T
        q = interpolated(recording.t, unwrapped(recording.q), t + problem.processing.delay).T
        dq, tau = (np.concatenate([part[k] for part in rows], axis=1).T for k in (3, 2))
        found.append(Track(t, q, dq, tau, columns))
    return tuple(found)


def constant_runs(track: Track, tops: FloatArray, cutoff: float, *, rules: SegmentRules) -> list[ConstantRun]:
    """Return the runs of one joint at constant speed while the others stand, with both ends left out.

    Parameters
    ----------
    tops : (n_v,) top speed of each joint in all recordings
    cutoff : of the rows [Hz]; for half its period at both ends the filter still sees the acceleration
    """
    half = 0.5 * rules.shortest
    ahead, behind = (np.array([np.interp(track.t + lag, track.t, dq) for dq in track.dq.T]).T for lag in (half, -half))
    change = np.abs(ahead - behind)
    still = np.abs(track.dq) <= np.maximum(STANDSTILL * tops, _STILL)
    runs = []
    for joint in range(tops.size):
        others = np.delete(still, joint, axis=1).all(axis=1)
        even = change[:, joint] <= rules.change * np.abs(track.dq[:, joint])
        for rows in _stretches(others & even & ~still[:, joint]):
            inner = (track.t >= track.t[rows.start] + 0.5 / cutoff) & (track.t <= track.t[rows.stop - 1] - 0.5 / cutoff)
            kept = np.flatnonzero(inner)
            if kept.size and track.t[kept[-1]] - track.t[kept[0]] >= rules.shortest:
                own = slice(int(kept[0]), int(kept[-1]) + 1)
                runs.append(ConstantRun(track, joint, own, float(track.dq[own, joint].mean())))
    return runs


def reversals(track: Track, tops: FloatArray, *, rules: SegmentRules) -> list[Reversal]:
    """Return the times at which a joint turns back and leaves at more than a creep on both sides."""
    found = []
    for joint in range(tops.size):
        dq = track.dq[:, joint]
        for row in np.flatnonzero(dq[1:] * dq[:-1] < 0.0):
            share = dq[row] / (dq[row] - dq[row + 1])
            t = float(track.t[row] + share * (track.t[row + 1] - track.t[row]))
            near = np.flatnonzero(np.abs(track.t - t) <= rules.window)
            if near.size < _FEWEST:
                continue
            rows = slice(int(near[0]), int(near[-1]) + 1)
            before, after = dq[rows.start : row + 1], dq[row + 1 : rows.stop]
            swept = min(np.abs(before).max(), np.abs(after).max()) > max(STANDSTILL * tops[joint], _STILL)
            once = (before * before[-1] > 0.0).all() and (after * after[0] > 0.0).all()
            if swept and once:
                found.append(Reversal(track, joint, rows, t))
    return found


def contrasts(runs: list[ConstantRun], *, rules: SegmentRules) -> Iterator[tuple[Contrast, ...]]:
    """Yield the contrasts of every two runs of a joint that differ in direction alone, bin by bin."""
    for joint in sorted({run.joint for run in runs}):
        own = [run for run in runs if run.joint == joint]
        places = np.concatenate([run.track.q[run.rows, joint] for run in own])
        edges = np.linspace(places.min(), places.max(), rules.bins + 1)
        forwards, backwards = [run for run in own if run.speed > 0], [run for run in own if run.speed < 0]
        pairs = [pair for pair in product(forwards, backwards) if _alike(*pair, rules=rules)]
        yield from (found for found in (tuple(_binned(*pair, edges)) for pair in pairs) if found)


def _alike(forward: ConstantRun, backward: ConstantRun, *, rules: SegmentRules) -> bool:
    mean = 0.5 * (forward.speed - backward.speed)
    poses = [np.delete(run.track.q[run.rows].mean(axis=0), run.joint) for run in (forward, backward)]
    near = bool((np.abs(poses[0] - poses[1]) <= rules.pose).all())
    return near and abs(forward.speed + backward.speed) <= rules.alike * mean


def _binned(forward: ConstantRun, backward: ConstantRun, edges: FloatArray) -> Iterator[Contrast]:
    joint, width = forward.joint, edges[1] - edges[0]
    ranges = [run.track.q[run.rows, joint] for run in (forward, backward)]
    low, high = max(q.min() for q in ranges), min(q.max() for q in ranges)
    speed = 0.5 * (forward.speed - backward.speed)
    for begin, end in pairwise(edges):
        first, last = max(begin, low), min(end, high)
        if last - first < 0.5 * width:
            continue
        places = np.linspace(first, last, _PER_BIN)
        ahead, back = _read(forward, places), _read(backward, places)
        half, mean = 0.5 * (ahead - back), 0.5 * (ahead + back)
        rows = sum(int(((q >= first) & (q <= last)).sum()) for q in ranges)
        yield Contrast(joint, speed, 0.5 * (first + last), half[-1], mean[-1], half[:-1], float(max(1, rows)))


def _read(run: ConstantRun, places: FloatArray) -> FloatArray:
    """Return the joint's columns and torque, averaged over the places, (n_b + 1,)."""
    q = run.track.q[run.rows, run.joint]
    order = np.argsort(q)
    table = np.column_stack([run.track.columns[run.rows, run.joint], run.track.tau[run.rows, run.joint]])[order]
    return np.array([np.interp(places, q[order], column).mean() for column in table.T])


def _stretches(flags: NDArray[np.bool_]) -> Iterator[slice]:
    """Yield the stretches in which the flags are up."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        yield slice(int(start), int(stop))
