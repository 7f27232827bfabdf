"""The space that motions are searched in: free Fourier coefficients and offsets, in which joint limits are linear.

A point is `x` (n_v, 2 n_h - 1): the free coefficients of each joint and how far its offset is from the middle of its
range. Position, velocity, acceleration and jerk over their limits are linear in x, so every joint limit is `|r| <= 1`,
`r = R x`. The gauge of a joint is the largest |r| along its motion: a point divided by its gauge lies on the limits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.motion import Motion, MotionGradient
from tauhat.excitation.fourier import FourierSeries, fourier_basis, jerk_basis, rest_basis
from tauhat.excitation.limits import MotionLimits


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FourierSpace:
    """Motions of a fixed period and number of harmonics inside joint limits.

    limits : position, velocity, acceleration
    period : [s]
    harmonics : n_h
    """

    limits: MotionLimits
    period: float
    harmonics: int

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return int(self.limits.lower.size)

    @property
    def shape(self) -> tuple[int, int]:
        """Shape of a point: (n_v, 2 n_h - 1)."""
        return self.n_v, 2 * self.harmonics - 1

    @property
    def middle(self) -> FloatArray:
        """Middle of each joint's range, (n_v,)."""
        return np.asarray(0.5 * (self.limits.lower + self.limits.upper))

    @property
    def reach(self) -> FloatArray:
        """Half of each joint's range, (n_v,)."""
        return np.asarray(0.5 * (self.limits.upper - self.limits.lower))

    def series(self, x: FloatArray) -> FourierSeries:
        """Return the motion at a point."""
        point = x.reshape(self.shape)
        return FourierSeries.from_free(point[:, :-1], offset=point[:, -1] + self.middle, period=self.period)

    def point(self, series: FourierSeries) -> FloatArray:
        """Return the point of a motion."""
        return np.column_stack([series.free, series.offset - self.middle])

    def gauge(self, x: FloatArray) -> FloatArray:
        """Return how much of its limits each joint uses at any time, (n_v,); above one they are exceeded."""
        series = self.series(x)
        hull = series.envelope()
        parts = [
            np.maximum(hull.upper - self.middle, self.middle - hull.lower) / self.reach,
            hull.velocity / self.limits.velocity,
            hull.acceleration / self.limits.acceleration,
        ]
        if self.limits.jerk is not None:
            parts.append(series.largest_jerk() / self.limits.jerk)
        return np.asarray(np.max(parts, axis=0))

    def shrunk(self, x: FloatArray) -> FloatArray:
        """Return the point with the joints that exceed a limit scaled back onto it, exactly and at all times."""
        return np.asarray(x.reshape(self.shape) / np.maximum(self.gauge(x), 1.0)[:, None])

    def grid(self, samples: int) -> SampledSpace:
        """Return the linear maps from a point to its motion at equally spaced times."""
        t = np.arange(samples, dtype=np.float64) * (self.period / samples)
        free = rest_basis(self.harmonics)
        position, velocity, acceleration = (
            basis @ free for basis in fourier_basis(t, period=self.period, harmonics=self.harmonics)
        )
        jerk = jerk_basis(t, period=self.period, harmonics=self.harmonics) @ free
        return SampledSpace(space=self, position=position, velocity=velocity, acceleration=acceleration, jerk=jerk)


def random_points(space: FourierSpace, count: int, rng: np.random.Generator) -> FloatArray:
    """Return random points that touch their limits, (count, n_v, 2 n_h - 1): feasible by construction.

    Each joint's random shape takes 0.3 to 1 of the room, and its offset moves within what is left of the range.
    """
    decay = np.tile(1.0 / np.arange(1, space.harmonics + 1), 2)
    points = []
    for _ in range(count):
        free = (rng.standard_normal((space.n_v, 2 * space.harmonics)) * decay) @ rest_basis(space.harmonics)
        point = np.column_stack([free, np.zeros(space.n_v)])
        point *= (rng.uniform(0.3, 1.0, space.n_v) / space.gauge(point))[:, None]
        hull = space.series(point).envelope()
        room = np.array([space.limits.lower - hull.lower, space.limits.upper - hull.upper])
        point[:, -1] = room[0] + rng.uniform(size=space.n_v) * (room[1] - room[0])
        points.append(space.shrunk(point))
    return np.array(points)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SampledSpace:
    """A space on a grid of times: `(n_t, 2 n_h - 2)` maps from free coefficients to q, dq, ddq and jerk."""

    space: FourierSpace
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray

    @property
    def n_t(self) -> int:
        """Number of samples."""
        return int(self.position.shape[0])

    def motion(self, points: FloatArray) -> Motion:
        """Return the motion at one point, or at several (n, n_v, 2 n_h - 1) one after the other."""
        stack = points.reshape(-1, *self.space.shape)
        free, offset = stack[:, :, :-1], stack[:, :, -1:] + self.space.middle[:, None]
        parts = (free @ self.position.T + offset, free @ self.velocity.T, free @ self.acceleration.T)
        rows = [np.ascontiguousarray(part.transpose(1, 0, 2)).reshape(self.space.n_v, -1) for part in parts]
        return Motion(q=rows[0], dq=rows[1], ddq=rows[2])

    def pull(self, gradient: MotionGradient) -> FloatArray:
        """Return the gradient with respect to a point, (n_v, 2 n_h - 1), from that with respect to its motion."""
        free = gradient.q @ self.position + gradient.dq @ self.velocity + gradient.ddq @ self.acceleration
        return np.column_stack([free, gradient.q.sum(axis=1)])

    def pull_each(self, gradient: MotionGradient) -> FloatArray:
        """Return the same sample by sample, (n_t, n_v (2 n_h - 1))."""
        parts = zip(gradient, (self.position, self.velocity, self.acceleration), strict=True)
        free = np.sum([np.einsum("jt,tk->tjk", bars, basis) for bars, basis in parts], axis=0)
        return np.concatenate([free, gradient.q.T[:, :, None]], axis=2).reshape(self.n_t, -1)

    def rows(self) -> FloatArray:
        """Return R, (n_v, n_r, 2 n_h - 1): position, velocity, acceleration, jerk of each joint over their limits."""
        ones, zeros = np.ones((self.n_t, 1)), np.zeros((self.n_t, 1))
        limits = self.space.limits
        parts = [
            (np.hstack([self.position, ones]), self.space.reach),
            (np.hstack([self.velocity, zeros]), limits.velocity),
            (np.hstack([self.acceleration, zeros]), limits.acceleration),
        ]
        if limits.jerk is not None:
            parts.append((np.hstack([self.jerk, zeros]), limits.jerk))
        return np.concatenate([rows / size[:, None, None] for rows, size in parts], axis=1)
