"""Where a recording holds still, or passes slowly, and from which side each joint came."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray
from tauhat.recordings.processing import unwrapped
from tauhat.recordings.recording import Recording
from tauhat.verification.prediction import LogPrediction
from tauhat.verification.whiteness import correlated_rows

SAME = 0.01  # [rad or m] poses closer than that are one
_LEAST_HOLD = 0.3  # [s] after settling
_SETTLING = 0.2  # [s] at both ends of a hold, which are left out: the joints still creep there
_SPAN = 0.05  # [s] over which speed is measured
_STILL = 0.003  # of the top speed
_SLOW = 0.1  # of the top speed
_STEADY = 0.05  # of the top acceleration: where a joint turns round, both ways have the same inertia torque
_CLEAR = 0.05  # [rad or m] from where a joint turns round: friction has built up, and no filter reaches across
_FEWEST_ROWS = 3


class Stand(NamedTuple):
    """A pose, the torque in it, and how it was reached.

    q : (n_v,) [rad or m]
    tau, error : mean torque and its standard error, (n_v,) [Nm or N]
    side : (n_v,) 1 where the joint came from below, -1 from above, 0 where it did not move
    speed : (n_v,) of the approach [rad/s or m/s]
    """

    q: FloatArray
    tau: FloatArray
    error: FloatArray
    side: FloatArray
    speed: FloatArray


def holds(recording: Recording, tau: FloatArray) -> Iterator[Stand]:
    """Yield the poses in which all joints stand still.

    Parameters
    ----------
    tau : (n_t, n_v) of the recording [Nm or N]
    """
    q, t = unwrapped(recording.q), recording.t
    span = max(1, round(_SPAN * recording.rate))
    if recording.n_t <= 2 * span:
        return
    speed = np.abs(q[span:] - q[:-span]) / (t[span:] - t[:-span])[:, None]
    never = np.ptp(q, axis=0) < SAME
    still = (never | (speed <= _STILL * speed.max(axis=0))).all(axis=1)
    for begin, last in _runs(still):
        first, end = (int(np.searchsorted(t, moment)) for moment in (t[begin] + _SETTLING, t[last] - _SETTLING))
        if first >= end or t[end] - t[first] < _LEAST_HOLD:
            continue
        pose = q[first:end].mean(axis=0)
        side, pace = _approach(q[:first], speed[:first], pose)
        yield Stand(pose, tau[first:end].mean(axis=0), _mean_error(tau[first:end]), side, pace)


def passes(log: LogPrediction) -> Iterator[Stand]:
    """Yield the poses through which one joint passes slowly while the others stand, cell by cell of its range."""
    top, hardest = np.abs(log.dq).max(axis=0), np.abs(log.ddq).max(axis=0)
    still = (np.ptp(log.q, axis=0) < SAME) | (np.abs(log.dq) <= _STILL * top)
    for joint in range(log.dq.shape[1]):
        others = np.delete(still, joint, axis=1).all(axis=1)
        slow = others & ~still[:, joint] & (np.abs(log.dq[:, joint]) <= _SLOW * top[joint])
        slow &= np.abs(log.ddq[:, joint]) <= _STEADY * hardest[joint]
        slow &= _clear_of_turns(log.q[:, joint], log.dq[:, joint])
        for sign in (1.0, -1.0):
            way = slow & (np.sign(log.dq[:, joint]) == sign)
            yield from (_passed(log, rows, joint) for rows in _cells(log.q[:, joint], way))


def _clear_of_turns(q: FloatArray, dq: FloatArray) -> NDArray[np.bool_]:
    """Return which rows are far from where the joint turns round, before and after, (n,)."""
    starts = np.concatenate([[0], np.flatnonzero(np.diff(np.sign(dq)) != 0) + 1, [q.size]])
    way = np.repeat(np.arange(starts.size - 1), np.diff(starts))
    begin, end = q[starts[:-1]][way], q[starts[1:] - 1][way]
    return np.asarray((np.abs(q - begin) > _CLEAR) & (np.abs(q - end) > _CLEAR))


def _cells(q: FloatArray, way: NDArray[np.bool_]) -> Iterator[NDArray[np.intp]]:
    """Yield the rows of a way that are in the same cell of the joint's range, where they are enough."""
    cell = np.floor(q / SAME).astype(np.intp)
    for number in np.unique(cell[way]):
        rows = np.flatnonzero(way & (cell == number))
        if rows.size >= _FEWEST_ROWS:
            yield rows


def _passed(log: LogPrediction, rows: NDArray[np.intp], joint: int) -> Stand:
    alone = np.arange(log.dq.shape[1]) == joint
    pace = np.abs(log.dq[rows]).mean(axis=0)
    side = np.where(alone, np.sign(log.dq[rows[0]]), 0.0)
    tau = log.tau[rows]
    return Stand(log.q[rows].mean(axis=0), tau.mean(axis=0), _mean_error(tau), side, np.where(alone, pace, 0.0))


def _runs(still: NDArray[np.bool_]) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(np.int8)))
    return [(int(begin), int(end) - 1) for begin, end in zip(edges[::2], edges[1::2], strict=True)]


def _approach(q: FloatArray, speed: FloatArray, pose: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return from which side each joint came to the pose, and its largest speed on the last bit of way, (n_v,) each."""
    n_v = pose.size
    side, pace = np.zeros(n_v), np.zeros(n_v)
    for joint in range(n_v):
        away = np.flatnonzero(np.abs(q[:, joint] - pose[joint]) > SAME)
        if not away.size:
            continue
        side[joint] = np.sign(pose[joint] - q[away[-1], joint])
        way = speed[away[-1] :, joint]
        pace[joint] = float(way.max(initial=0.0))
    return side, pace


def _mean_error(tau: FloatArray) -> FloatArray:
    """Return the standard error of the mean of correlated rows (n, n_v), (n_v,)."""
    centred = tau - tau.mean(axis=0)
    redundancy = np.array([correlated_rows(column) for column in centred.T])
    return np.asarray(np.sqrt(np.var(tau, axis=0, ddof=1) * redundancy / len(tau)))
