"""The space that motions are searched in: free Fourier coefficients and offsets, in which joint limits are linear.

A point is `x` (n_v, n_x): the free coefficients of each joint and how far its offset is from the middle of its range,
n_x = 2 n_h - 1. Where the motion has to start at a given pose the offset follows from the coefficients,
`q(t) = start + sum (p(t) - p(0)) x`, and n_x = 2 n_h - 2. The motion at x = 0 rests at the origin: the middle, or the
start.

Position, velocity, acceleration and jerk over their limits are `r0 + R x` with r0 their value at the origin, and every
joint limit is `|r0 + R x| <= 1`. The gauge of a joint is the factor by which a point is too long: a point divided by
its gauge lies on the limits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.dynamics.motion import Motion, MotionGradient
from tauhat.excitation.fourier import FourierSeries, fourier_basis, jerk_basis, rest_basis
from tauhat.excitation.limits import MotionLimits

_LEANS = np.array([0.0, 0.5, -0.5, 1.0, -1.0, 2.0, -2.0, 4.0, -4.0])  # bumps added to a random shape, in its height


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FourierSpace:
    """Motions of a fixed period and number of harmonics inside joint limits.

    limits : position, velocity, acceleration
    period : [s]
    harmonics : n_h
    start : (n_v,) pose strictly inside the limits at which motions start and end, None where it is free [rad or m]
    """

    limits: MotionLimits
    period: float
    harmonics: int
    start: FloatArray | None = None

    def __post_init__(self) -> None:
        if self.start is not None:
            object.__setattr__(self, "start", frozen("start", self.start, (self.n_v,), where="Fourier space"))

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return int(self.limits.lower.size)

    @property
    def shape(self) -> tuple[int, int]:
        """Shape of a point: (n_v, 2 n_h - 1), one less where the start is given."""
        return self.n_v, 2 * self.harmonics - (1 if self.start is None else 2)

    @property
    def middle(self) -> FloatArray:
        """Middle of each joint's range, (n_v,)."""
        return np.asarray(0.5 * (self.limits.lower + self.limits.upper))

    @property
    def reach(self) -> FloatArray:
        """Half of each joint's range, (n_v,)."""
        return np.asarray(0.5 * (self.limits.upper - self.limits.lower))

    @property
    def origin(self) -> FloatArray:
        """Where the motion at x = 0 rests, (n_v,): the start, or the middle."""
        return self.middle if self.start is None else self.start

    def series(self, x: FloatArray) -> FourierSeries:
        """Return the motion at a point."""
        point = x.reshape(self.shape)
        if self.start is not None:
            return FourierSeries.from_start(point, start=self.start, period=self.period)
        return FourierSeries.from_free(point[:, :-1], offset=point[:, -1] + self.middle, period=self.period)

    def point(self, series: FourierSeries) -> FloatArray:
        """Return the point of a motion, which must have the start where one is given."""
        return series.free if self.start is not None else np.column_stack([series.free, series.offset - self.middle])

    def resting(self, pose: FloatArray) -> FloatArray:
        """Return the point that stands still at a pose (n_v,); where the start is given there is no other than that."""
        point = np.zeros(self.shape)
        if self.start is None:
            point[:, -1] = pose - self.middle
        return point

    def gauge(self, x: FloatArray) -> FloatArray:
        """Return how much of its limits each joint uses at any time, (n_v,); above one they are exceeded."""
        series = self.series(x)
        hull = series.envelope()
        parts = [
            (hull.upper - self.origin) / (self.limits.upper - self.origin),
            (self.origin - hull.lower) / (self.origin - self.limits.lower),
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
        maps = [position - position[:1], velocity, acceleration, jerk]
        if self.start is None:
            ones, zeros = np.ones((samples, 1)), np.zeros((samples, 1))
            maps = [
                np.hstack([part, last]) for part, last in zip((position, *maps[1:]), (ones, *3 * [zeros]), strict=True)
            ]
        return SampledSpace(space=self, position=maps[0], velocity=maps[1], acceleration=maps[2], jerk=maps[3])


def random_points(space: FourierSpace, count: int, rng: np.random.Generator) -> FloatArray:
    """Return random points that touch their limits, (count, n_v, n_x): feasible by construction.

    Each joint's random shape takes 0.3 to 1 of the room. Where the start is free its offset moves within what is left
    of the range; where it is given the shape leans to the side that has more room.
    """
    decay = np.tile(1.0 / np.arange(1, space.harmonics + 1), 2)
    points = []
    for _ in range(count):
        free = (rng.standard_normal((space.n_v, 2 * space.harmonics)) * decay) @ rest_basis(space.harmonics)
        parts = rng.uniform(0.3, 1.0, space.n_v)
        if space.start is not None:
            free = _leaning(space, free)
            points.append(space.shrunk(free * (parts / space.gauge(free))[:, None]))
            continue
        point = np.column_stack([free, np.zeros(space.n_v)])
        point *= (parts / space.gauge(point))[:, None]
        hull = space.series(point).envelope()
        room = np.array([space.limits.lower - hull.lower, space.limits.upper - hull.upper])
        point[:, -1] = room[0] + rng.uniform(size=space.n_v) * (room[1] - room[0])
        points.append(space.shrunk(point))
    return np.array(points)


def _leaning(space: FourierSpace, free: FloatArray) -> FloatArray:
    """Return shapes with as much of the bump `(1 - cos w t)^2` added as lets each joint move farthest.

    A start near a limit leaves room on one side only, and few random shapes stay on one side. The bump starts at rest:
    with b_1 = -4/3 and b_2 = 1/3, `sum k^2 b_k = 0`.
    """
    bump = np.zeros(2 * space.harmonics)
    bump[space.harmonics : space.harmonics + 2] = (-4.0 / 3.0, 1.0 / 3.0)
    size = np.linalg.norm(free, axis=1)
    shapes = [free + np.outer(lean * size, bump @ rest_basis(space.harmonics)) for lean in _LEANS]
    reaches = []
    for shape in shapes:
        hull = space.series(shape).envelope()
        reaches.append((hull.upper - hull.lower) / space.gauge(shape))
    best = np.argmax(reaches, axis=0)
    return np.array([shapes[lean][joint] for joint, lean in enumerate(best)])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SampledSpace:
    """A space on a grid of times: (n_t, n_x) maps from a point to q less the origin, dq, ddq and jerk."""

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
        """Return the motion at one point, or at several (n, n_v, n_x) one after the other."""
        stack = points.reshape(-1, *self.space.shape)
        parts = (
            stack @ self.position.T + self.space.origin[:, None],
            stack @ self.velocity.T,
            stack @ self.acceleration.T,
        )
        rows = [np.ascontiguousarray(part.transpose(1, 0, 2)).reshape(self.space.n_v, -1) for part in parts]
        return Motion(q=rows[0], dq=rows[1], ddq=rows[2])

    def pull(self, gradient: MotionGradient) -> FloatArray:
        """Return the gradient with respect to a point, (n_v, n_x), from that with respect to its motion."""
        return np.asarray(gradient.q @ self.position + gradient.dq @ self.velocity + gradient.ddq @ self.acceleration)

    def pull_each(self, gradient: MotionGradient) -> FloatArray:
        """Return the same sample by sample, (n_t, n_v n_x)."""
        parts = zip(gradient, (self.position, self.velocity, self.acceleration), strict=True)
        each = np.sum([np.einsum("jt,tk->tjk", bars, basis) for bars, basis in parts], axis=0)
        return np.asarray(each.reshape(self.n_t, -1))

    def rows(self) -> FloatArray:
        """Return R, (n_v, n_r, n_x): position, velocity, acceleration, jerk of each joint over their limits."""
        limits = self.space.limits
        parts = [
            (self.position, self.space.reach),
            (self.velocity, limits.velocity),
            (self.acceleration, limits.acceleration),
        ]
        if limits.jerk is not None:
            parts.append((self.jerk, limits.jerk))
        return np.concatenate([rows / size[:, None, None] for rows, size in parts], axis=1)

    def rest(self) -> FloatArray:
        """Return r0, (n_v, n_r): what the origin alone uses of the limits, zero but for positions at a given start."""
        kinds = 3 if self.space.limits.jerk is None else 4
        used = np.zeros((self.space.n_v, kinds, self.n_t))
        used[:, 0] = ((self.space.origin - self.space.middle) / self.space.reach)[:, None]
        return used.reshape(self.space.n_v, -1)
