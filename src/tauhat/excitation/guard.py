"""Limits of several joints at once while a motion is designed: a way in, a barrier, and limits kept at all times.

The way in is constructed: at rest in a pose inside all limits every margin is positive, so any motion shrunk far enough
towards this pose is inside too.

In the end the limits are held on a grid ten times finer, and between its samples too: a function whose curvature is at
most m'' lies no deeper than `m'' h^2 / 8` below the lower of two samples h apart. The curvature is taken from the
second differences around the interval, doubled because it may grow inside it. Kinks downwards do not occur: margins are
the least of smooth functions, whose kinks point up.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.motion import Motion, MotionGradient, no_gradient
from tauhat.errors import ExcitationError
from tauhat.excitation.limits import MotionLimit
from tauhat.excitation.space import FourierSpace, SampledSpace

FINER = 10  # times as many samples as while optimising: where limits are held exactly
INSIDE = 1e-3  # smallest margin of a pose that motions are grown from
_SWELL = 2.0  # times that a margin's curvature may be larger between samples than at the samples around
_START = 0.03  # margin a start has, if its pose has twice that
_STEPS = np.append(0.8 ** np.arange(24), (1e-3, 1e-4, 1e-5))
_SHRINKS = np.concatenate([[0.0], 1e-4 * 2.0 ** np.arange(13), [0.9, 0.95, 0.98, 0.99, 0.999, 1.0]])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Guard:
    """Keeps motions of a space inside limits of several joints at once.

    limits : at least one
    margin : part of each relative limit that is left unused
    poses : (n, n_v) at rest inside all limits [rad or m]
    samples : of the grid on which limits are held while optimising
    tightening : (n_limits,) what a coarser grid missed so far, in margins
    """

    space: FourierSpace
    limits: tuple[MotionLimit, ...]
    margin: float
    poses: FloatArray
    samples: int
    tightening: tuple[float, ...]

    @property
    def grid(self) -> SampledSpace:
        """The grid of the search."""
        return self.space.grid(self.samples)

    def rooms(self, motion: Motion) -> list[FloatArray]:
        """Return the margins that are left of each limit, (n_c, n_t)."""
        return [self._room(k, limit.margins(motion)) for k, limit in enumerate(self.limits)]

    def barrier(self, motion: Motion) -> tuple[float, MotionGradient]:
        """Return `sum m - 1 - ln m` over all margins m < 1, infinite outside, and its gradient."""
        value, gradient = 0.0, no_gradient(motion)
        for k, limit in enumerate(self.limits):
            margins, pull = limit.evaluate(motion)
            room = self._room(k, margins)
            if room.min() <= 0.0:
                return np.inf, no_gradient(motion)
            near = np.minimum(room, 1.0)
            value += float((near - 1.0 - np.log(near)).sum())
            slopes = pull((1.0 - 1.0 / near) / self._size(k))
            gradient = MotionGradient(*(a + b for a, b in zip(gradient, slopes, strict=True)))
        return value, gradient

    def bend(self, x: FloatArray) -> FloatArray:
        """Return the barrier's Hessian without the bend of the margins themselves, (n, n) with n the size of a point.

        A margin depends on its own sample alone: one pullback gives the slopes of a row at all samples.
        """
        grid = self.grid
        motion, whole = grid.motion(x), np.zeros((x.size, x.size))
        for k, limit in enumerate(self.limits):
            margins, pull = limit.evaluate(motion)
            room = self._room(k, margins)
            steepness = np.where(room < 1.0, 1.0 / (np.maximum(room, INSIDE) * self._size(k)), 0.0)
            for row in np.flatnonzero(steepness.any(axis=1)):
                bars = np.zeros_like(room)
                bars[row] = steepness[row]
                slopes = grid.pull_each(pull(bars))
                whole += slopes.T @ slopes
        return whole

    def violations(self, points: FloatArray) -> FloatArray:
        """Return the sum of what each of several points exceeds, mean over time, (n,); zero inside."""
        motion = self.grid.motion(points)
        excess = [np.maximum(-room, 0.0).sum(axis=0) for room in self.rooms(motion)]
        return np.asarray(np.sum(excess, axis=0).reshape(len(points), -1).mean(axis=1))

    def worst(self, points: FloatArray, samples: int) -> FloatArray:
        """Return the smallest margin left at each of several points (n, n_v, 2 n_h - 1), on a grid, (n,)."""
        motion = self.space.grid(samples).motion(points)
        least = np.min([room.min(axis=0) for room in self.rooms(motion)], axis=0)
        return np.asarray(least.reshape(len(points), -1).min(axis=1))

    def starts(self, x: FloatArray) -> FloatArray:
        """Return the point shrunk towards each pose until it is inside, (n_poses, n_v, 2 n_h - 1)."""
        return np.array([self.one_start(x, index) for index in range(len(self.poses))])

    def one_start(self, x: FloatArray, index: int) -> FloatArray:
        """Return the point shrunk towards one pose, counted round, until it is inside, (n_v, 2 n_h - 1)."""
        rest = self._rests()[index % len(self.poses)]
        enough = min(_START, 0.5 * float(self.worst(rest[None], 1)[0]))
        for steps in np.array_split(_STEPS, len(_STEPS) // 4):  # the longest first: most need no shorter ones
            line = rest + steps[:, None, None] * (x - rest)
            inside = np.flatnonzero(self.worst(line, self.samples) > enough)
            if inside.size:
                return np.asarray(line[inside[0]])
        return np.asarray(rest)

    def settled(self, x: FloatArray) -> FloatArray:
        """Return the point shrunk as little as it takes to be inside at all times."""
        point = self.space.shrunk(x)
        if self.holds(point):
            return point
        rests = self._rests()
        for shrink in _SHRINKS[1:]:
            for rest in rests:
                candidate = rest + (1.0 - shrink) * (point - rest)
                if self.holds(candidate):
                    return np.asarray(candidate)
        raise ExcitationError("no motion inside all limits was found", remedy="state a home pose with more room")

    def tightened(self, x: FloatArray) -> Guard:
        """Return the guard with limits drawn in by what the point exceeds on the fine grid and between its samples."""
        excess = [max(-room * self._size(k), 0.0) for k, room in enumerate(self._lowest(x))]
        return replace(self, tightening=tuple(a + 1.2 * b for a, b in zip(self.tightening, excess, strict=True)))

    def holds(self, x: FloatArray) -> bool:
        """Return whether a point keeps the limits, without tightening, on the fine grid and between its samples."""
        return min(self._lowest(x)) >= 0.0

    def _lowest(self, x: FloatArray) -> list[float]:
        """Return the least margin left of each limit, without tightening, at all times."""
        motion = self.space.grid(FINER * self.samples).motion(x)
        plain = replace(self, tightening=(0.0,) * len(self.limits))
        return [float(lowest_between(room).min()) for room in plain.rooms(motion)]

    def _rests(self) -> FloatArray:
        return np.array([self.space.resting(pose) for pose in self.poses])

    def _size(self, limit: int) -> float:
        return 1.0 - self.margin if self.limits[limit].relative else 1.0

    def _room(self, limit: int, margins: FloatArray) -> FloatArray:
        size = self._size(limit)
        return (margins - (1.0 - size) - self.tightening[limit]) / size


def lowest_between(margins: FloatArray) -> FloatArray:
    """Return how low margins (n_c, n_t) of a periodic motion may be between each sample and the next, (n_c, n_t)."""
    ahead, behind = np.roll(margins, -1, axis=1), np.roll(margins, 1, axis=1)
    bend = np.maximum(ahead - 2.0 * margins + behind, 0.0)
    around = np.max([np.roll(bend, shift, axis=1) for shift in (1, 0, -1, -2)], axis=0)
    return np.asarray(np.minimum(margins, ahead) - _SWELL / 8.0 * around)


def pose_rooms(limits: tuple[MotionLimit, ...], q: FloatArray, *, margin: float) -> FloatArray:
    """Return the smallest margin of each limit left at rest in the poses q (n_v, n), (n_limits, n)."""
    still = np.zeros_like(q)
    motion = Motion(q=q, dq=still, ddq=still)
    reserves = [margin if limit.relative else 0.0 for limit in limits]
    return np.array(
        [(limit.margins(motion).min(axis=0) - r) / (1.0 - r) for limit, r in zip(limits, reserves, strict=True)]
    )
