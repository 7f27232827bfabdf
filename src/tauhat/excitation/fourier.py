"""Fourier motions: finite sums of harmonics that start and end at rest, linear in their free coefficients."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import ExcitationError
from tauhat.excitation.limits import motion_limits
from tauhat.excitation.trajectory import MotionSamples
from tauhat.robots.robot import Robot

FEWEST_HARMONICS = 2  # with one harmonic, rest at the start leaves no motion
_REST = 1e-9  # initial velocity and acceleration, relative to the sum of the amplitudes, that counts as rest
_ENVELOPE_POINTS = 128  # grid points per period of the fastest harmonic
_SLACK = 1e-12  # rounding errors of an envelope, relative
_WIDEN = float((1.0 + _SLACK) / np.cos(np.pi / _ENVELOPE_POINTS))  # from a maximum over the points to one of all times


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Envelope:
    """What a motion never leaves at any time, (n_v,) each.

    lower, upper : position [rad or m]
    velocity, acceleration : largest magnitudes [rad/s, rad/s^2] or [m/s, m/s^2]
    """

    lower: FloatArray
    upper: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FourierSeries:
    """A periodic motion `q(t) = offset + sum_k a_k sin(k w t) + b_k cos(k w t)`, w = 2 pi / period.

    It is at rest (dq = ddq = 0) at t = 0, period, 2 period, ...

    period : length of one period [s]
    coefficients : (n_v, 2 n_h) `a_1 .. a_nh, b_1 .. b_nh` of each joint [rad or m]
    offset : (n_v,) mean position [rad or m]

    Source: Swevers et al., "Optimal robot excitation and identification", 1997; the boundary conditions are eliminated.
    """

    period: float
    coefficients: FloatArray
    offset: FloatArray

    def __post_init__(self) -> None:
        if not (np.isfinite(self.period) and self.period > 0.0):
            raise ExcitationError("period of a Fourier series", expected="a positive time", got=self.period)
        offset = frozen("offset", self.offset, (None,), where="Fourier series")
        object.__setattr__(self, "offset", offset)
        shape = (offset.size, None)
        object.__setattr__(
            self, "coefficients", frozen("coefficients", self.coefficients, shape, where="Fourier series")
        )
        _harmonics_of(self.coefficients)
        self._check_rest()

    def _check_rest(self) -> None:
        k = np.arange(1, self.n_h + 1)
        for weights, half in ((k, self.coefficients[:, : self.n_h]), (k**2, self.coefficients[:, self.n_h :])):
            moving = np.abs(half @ weights) > _REST * (np.abs(half) @ weights)
            if moving.any():
                raise ExcitationError(
                    "a Fourier series does not start at rest",
                    where=f"joint {int(np.argmax(moving)) + 1}",
                    expected="sum k a_k = 0 and sum k^2 b_k = 0",
                    remedy="build it with FourierSeries.from_free",
                )

    @classmethod
    def from_free(cls, free: FloatArray, *, offset: FloatArray, period: float) -> FourierSeries:
        """Return the series at rest that `free` selects; q, dq and ddq are linear in `free` and `offset`.

        Parameters
        ----------
        free : (n_v, 2 n_h - 2) [rad or m]
        offset : (n_v,) [rad or m]
        period : [s]
        """
        free = frozen("free coefficients", free, (np.size(offset), None))
        harmonics, odd = divmod(free.shape[1] + 2, 2)
        if odd:
            raise ExcitationError("free coefficients come in pairs", expected="2 n_h - 2 columns", got=free.shape[1])
        return cls(period=period, coefficients=free @ rest_basis(harmonics).T, offset=offset)

    @classmethod
    def from_start(cls, free: FloatArray, *, start: FloatArray, period: float) -> FourierSeries:
        """Return the series at rest that starts and ends at a pose: `offset = start - sum_k b_k`.

        Parameters
        ----------
        free : (n_v, 2 n_h - 2) as for `from_free`
        start : (n_v,) [rad or m]
        period : [s]
        """
        shape = cls.from_free(free, offset=np.zeros(np.size(start)), period=period)
        return replace(shape, offset=start - shape.coefficients[:, shape.n_h :].sum(axis=1))

    @property
    def free(self) -> FloatArray:
        """The coefficients without the two that rest at the ends determines, (n_v, 2 n_h - 2)."""
        return np.asarray(self.coefficients @ rest_basis(self.n_h))

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return int(self.coefficients.shape[0])

    @property
    def n_h(self) -> int:
        """Number of harmonics."""
        return int(self.coefficients.shape[1] // 2)

    @property
    def base_frequency(self) -> float:
        """Frequency of the first harmonic [Hz]."""
        return 1.0 / self.period

    @property
    def duration(self) -> float:
        """One period, from rest to rest [s]."""
        return self.period

    def sample(self, t: FloatArray) -> MotionSamples:
        """Return the motion at the times t, (n_t,) [s]; beyond the period it repeats."""
        t = frozen("t", t, (None,))
        position, velocity, acceleration = fourier_basis(t, period=self.period, harmonics=self.n_h)
        columns = self.coefficients.T
        return MotionSamples(t=t, q=self.offset + position @ columns, dq=velocity @ columns, ddq=acceleration @ columns)

    def envelope(self) -> Envelope:
        """Return bounds that hold between all samples too, at most 0.04 % wider than the motion itself.

        A trigonometric polynomial p of degree n obeys `max |p| <= max over N points of |p| / cos(pi n / N)` on N
        equally spaced points of a period, because around its maximum it stays above the cosine of degree n.

        Source: M. Riesz, "Eine trigonometrische Interpolationsformel ...", 1914.
        """
        grid, widen = self.sample(self._fine_times()), _WIDEN
        highest, lowest = grid.q.max(axis=0), grid.q.min(axis=0)
        middle, reach = 0.5 * (highest + lowest), 0.5 * widen * (highest - lowest)
        return Envelope(
            lower=middle - reach,
            upper=middle + reach,
            velocity=widen * np.abs(grid.dq).max(axis=0),
            acceleration=widen * np.abs(grid.ddq).max(axis=0),
        )

    def largest_jerk(self) -> FloatArray:
        """Return a bound of each joint's change of acceleration at all times, (n_v,) [rad/s^3 or m/s^3]."""
        basis = jerk_basis(self._fine_times(), period=self.period, harmonics=self.n_h)
        return np.asarray(_WIDEN * np.abs(basis @ self.coefficients.T).max(axis=0))

    def _fine_times(self) -> FloatArray:
        return np.linspace(0.0, self.period, _ENVELOPE_POINTS * self.n_h, endpoint=False, dtype=np.float64)


def jerk_basis(t: FloatArray, *, period: float, harmonics: int) -> FloatArray:
    """Return the functions whose sums are the change of acceleration, (n_t, 2 n_h)."""
    speed = np.tile(2.0 * np.pi / period * np.arange(1, harmonics + 1), 2)
    return -(speed**2) * fourier_basis(t, period=period, harmonics=harmonics)[1]


def fourier_basis(t: FloatArray, *, period: float, harmonics: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the functions whose sums are q - offset, dq and ddq, (n_t, 2 n_h) each: sines first, then cosines.

    Parameters
    ----------
    t : (n_t,) [s]
    period : [s]
    """
    k = np.arange(1, harmonics + 1)
    angle = (2.0 * np.pi / period) * t[:, None] * k
    sine, cosine = np.sin(angle), np.cos(angle)
    speed = np.tile(2.0 * np.pi / period * k, 2)
    position = np.hstack([sine, cosine])
    return position, speed * np.hstack([cosine, -sine]), -(speed**2) * position


def rest_basis(harmonics: int) -> FloatArray:
    """Return the orthonormal basis (2 n_h, 2 n_h - 2) of all coefficients at rest at t = 0.

    Null space of `sum k a_k = 0` (velocity) and `sum k^2 b_k = 0` (acceleration).
    """
    k = np.arange(1, harmonics + 1)
    conditions = np.zeros((2 * harmonics, 2))
    conditions[:harmonics, 0] = k
    conditions[harmonics:, 1] = k**2
    complete = np.linalg.qr(conditions, mode="complete").Q
    return np.ascontiguousarray(complete[:, 2:])


def random_fourier(
    robot: Robot, *, period: float, harmonics: int, rng: np.random.Generator, margin: float = 0.05
) -> FourierSeries:
    """Return a random motion inside the robot's position, velocity and acceleration limits at all times.

    Feasible by construction: each joint's random shape is scaled until the tightest limit holds, then moved to a random
    place within the position limits. Limits the robot does not state are those of `motion_limits`.

    Parameters
    ----------
    period : [s]
    harmonics : n_h, at least 2
    margin : fraction of each limit left unused, in [0, 1)
    """
    _check_harmonics(harmonics)
    limits = motion_limits(robot, margin=margin)
    # Amplitudes fall with the harmonic so that no single one decides speed and acceleration.
    decay = np.tile(1.0 / np.arange(1, harmonics + 1), 2)
    free = (rng.standard_normal((robot.n_v, 2 * harmonics)) * decay) @ rest_basis(harmonics)
    shape = FourierSeries.from_free(free, offset=np.zeros(robot.n_v), period=period).envelope()
    room = np.array([limits.upper - limits.lower, limits.velocity, limits.acceleration])
    need = np.array([shape.upper - shape.lower, shape.velocity, shape.acceleration])
    scale = (1.0 - 4.0 * _SLACK) * (room / need).min(axis=0)
    lowest, highest = limits.lower - scale * shape.lower, limits.upper - scale * shape.upper
    offset = lowest + rng.uniform(size=robot.n_v) * (highest - lowest)
    return FourierSeries.from_free(scale[:, None] * free, offset=offset, period=period)


def _harmonics_of(coefficients: FloatArray) -> None:
    harmonics, odd = divmod(coefficients.shape[1], 2)
    if odd:
        raise ExcitationError("Fourier coefficients come in pairs", expected="2 n_h columns", got=coefficients.shape[1])
    _check_harmonics(harmonics)


def _check_harmonics(harmonics: int) -> None:
    if harmonics < FEWEST_HARMONICS:
        raise ExcitationError(
            "too few harmonics to move from rest to rest", expected=f">= {FEWEST_HARMONICS}", got=harmonics
        )
