"""Stiffness and damping of elastic joints by output error, from several starts, with every optimum reported.

The measured torque drives the simulation of `elastic_arm` from rest; what it says of the encoders is compared with
what they said. A slow drift says nothing of the springs and is taken out of both, as a polynomial in time.

The squared error has many minima: a resonance that is off by more than its width fits no better than none at all. The
search therefore starts from many places. Minima that differ in their parameters and not in their residual, by an
F-test, explain the recording equally well: then the recording cannot tell, and all are returned.

Source: Oaki, Adachi, "Vibration parameter identification of elastic-joint robot arm", 2009.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray, read_only
from tauhat.blas import single_threaded
from tauhat.errors import ModelError
from tauhat.estimation.elastic_arm import ElasticArm, simulate_elastic
from tauhat.recordings.processing import clock_step
from tauhat.recordings.recording import Recording

Side: TypeAlias = Literal["motor", "link"]
Unknown: TypeAlias = Literal["stiffness", "damping", "motor_inertia", "link_inertia"]
UNKNOWNS: tuple[Unknown, ...] = ("stiffness", "damping", "motor_inertia", "link_inertia")
_EXACT = 1e-6  # of the signal: a residual below is rounding


@dataclass(frozen=True, slots=True, kw_only=True)
class ElasticSettings:
    """What is sought, and where.

    side : of the spring on which the encoders sit
    unknowns : per joint; the others are the arm's. The link inertia is a factor on its mass matrix
    band : between which the links' own frequencies `sqrt(k / M) / 2 pi` lie [Hz]
    ratios : between which their damping ratios lie
    factor : how far an unknown inertia may be off the arm's, times or divided by
    starts : number of places the search starts from
    trend : degree of the polynomial in time that is taken out
    significance : of the F-test by which two optima are alike
    apart : smallest relative difference of a parameter that makes two optima distinct
    """

    side: Side = "motor"
    unknowns: tuple[Unknown, ...] = ("stiffness", "damping")
    band: tuple[float, float] = (2.0, 60.0)
    ratios: tuple[float, float] = (0.002, 0.5)
    factor: float = 6.0
    starts: int = 24
    trend: int = 3
    significance: float = 0.05
    apart: float = 0.02

    def __post_init__(self) -> None:
        object.__setattr__(self, "unknowns", tuple(self.unknowns))
        unknown = [name for name in self.unknowns if name not in UNKNOWNS]
        if unknown or not self.unknowns:
            raise ModelError(
                "unknowns of an elastic joint", expected=", ".join(UNKNOWNS), got=", ".join(unknown) or "none"
            )
        if self.side not in {"motor", "link"}:
            raise ModelError("side of the encoders", expected="motor or link", got=self.side)
        ordered = 0.0 < self.band[0] < self.band[1] and 0.0 < self.ratios[0] < self.ratios[1]
        counts = self.starts >= 1 and self.trend >= 0
        if not (ordered and counts and self.factor > 1.0 and self.apart > 0.0 and 0.0 < self.significance < 1.0):
            raise ModelError("search box of elastic joints", expected="rising positive bounds", got=self)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ElasticOptimum:
    """A minimum of the squared error.

    stiffness, damping, motor_inertia, link_inertia : (n_v,); the last a factor on the mass matrix
    rms : of the residual [rad or m]
    relative_errors : (n_free,) relative standard errors of the unknowns, infinite where the recording says nothing
    found : from how many starts
    equal : whether it explains the recording as well as the best one
    on_bound : whether an unknown ended at the edge of the search box
    """

    stiffness: FloatArray
    damping: FloatArray
    motor_inertia: FloatArray
    link_inertia: FloatArray
    rms: float
    relative_errors: FloatArray
    found: int
    equal: bool
    on_bound: bool

    def __post_init__(self) -> None:
        for array in (self.stiffness, self.damping, self.motor_inertia, self.link_inertia, self.relative_errors):
            read_only(array)


@dataclass(frozen=True, slots=True, kw_only=True)
class ElasticFit:
    """All distinct optima, best first.

    signal_rms : of the encoders without their trend [rad or m]
    """

    optima: tuple[ElasticOptimum, ...]
    signal_rms: float
    settings: ElasticSettings = field(default_factory=ElasticSettings)

    @property
    def best(self) -> ElasticOptimum:
        """The optimum of the least residual."""
        return self.optima[0]

    @property
    def equal(self) -> tuple[ElasticOptimum, ...]:
        """The optima among which the recording cannot tell; one when it can."""
        return tuple(optimum for optimum in self.optima if optimum.equal)

    @property
    def ambiguous(self) -> bool:
        """Whether there are several."""
        return len(self.equal) > 1

    def span(self, unknown: Unknown) -> tuple[FloatArray, FloatArray]:
        """Return the least and the largest value of an unknown among the equal optima, (n_v,) each."""
        values = np.array([getattr(optimum, unknown) for optimum in self.equal])
        return values.min(axis=0), values.max(axis=0)


class _Values(NamedTuple):
    stiffness: FloatArray
    damping: FloatArray
    motor_inertia: FloatArray
    link_inertia: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Search:
    """The squared error as a function of the logarithms of the unknowns, joint by joint."""

    arm: ElasticArm
    tau: FloatArray
    measured: FloatArray
    basis: FloatArray
    step: float
    settings: ElasticSettings
    known: _Values

    def values(self, point: FloatArray) -> _Values:
        parts = point.reshape(len(self.settings.unknowns), self.arm.n_v)
        changes = {name: np.exp(part) for name, part in zip(self.settings.unknowns, parts, strict=True)}
        return self.known._replace(**changes)

    def residual(self, point: FloatArray) -> FloatArray:
        values = self.values(point)
        factor = np.sqrt(values.link_inertia)
        mass = self.arm.mass * np.outer(factor, factor)
        arm = replace(self.arm, mass=mass, motor_inertia=values.motor_inertia)
        moved = simulate_elastic(arm, self.tau, step=self.step, stiffness=values.stiffness, damping=values.damping)[
            0 if self.settings.side == "motor" else 1
        ]
        error = moved - self.basis @ (self.basis.T @ moved) - self.measured
        return np.asarray(np.clip(error, -1e6, 1e6).ravel())

    def box(self) -> tuple[FloatArray, FloatArray]:
        """Return lower and upper bounds of the point."""
        low, high = [], []
        inertia = np.diag(self.arm.mass)
        slow, fast = (2.0 * np.pi * frequency for frequency in self.settings.band)
        edges = {
            "stiffness": (inertia * slow**2, inertia * fast**2),
            "damping": (2.0 * self.settings.ratios[0] * slow * inertia, 2.0 * self.settings.ratios[1] * fast * inertia),
            "motor_inertia": (
                self.arm.motor_inertia / self.settings.factor,
                self.arm.motor_inertia * self.settings.factor,
            ),
            "link_inertia": (
                np.full(self.arm.n_v, 1.0 / self.settings.factor),
                np.full(self.arm.n_v, self.settings.factor),
            ),
        }
        for name in self.settings.unknowns:
            low.append(np.log(edges[name][0]))
            high.append(np.log(edges[name][1]))
        return np.concatenate(low), np.concatenate(high)


class _Minimum(NamedTuple):
    point: FloatArray
    rms: float
    relative_errors: FloatArray
    on_bound: bool


@single_threaded
def identify_elastic(
    arm: ElasticArm, recording: Recording, *, rng: np.random.Generator, settings: ElasticSettings | None = None
) -> ElasticFit:
    """Return every distinct optimum of stiffness and damping, with its residual.

    Parameters
    ----------
    recording : from rest at the pose, with torque; its positions are those of the encoders' side
    rng : of the starts

    Raises
    ------
    ModelError
        when the recording does not fit the arm, lacks torque, or its clock is too slow for the band.
    """
    settings = settings or ElasticSettings()
    search = _search(arm, recording, settings)
    low, high = search.box()
    starts = low + (high - low) * _strata(rng, settings.starts, low.size)
    minima = sorted((_descended(search, start, low, high) for start in starts), key=lambda minimum: minimum.rms)
    signal = float(np.sqrt(np.mean(search.measured**2)))
    return ElasticFit(optima=_distinct(search, minima, signal), signal_rms=signal, settings=settings)


def _strata(rng: np.random.Generator, count: int, dimension: int) -> FloatArray:
    """Return a Latin hypercube in the unit cube, (count, dimension)."""
    order = np.array([rng.permutation(count) for _ in range(dimension)]).T
    return np.asarray((order + rng.random((count, dimension))) / count)


def _search(arm: ElasticArm, recording: Recording, settings: ElasticSettings) -> _Search:
    if recording.n_v != arm.n_v or recording.tau is None:
        raise ModelError(
            "the recording does not fit the elastic arm, or has no torque",
            where=recording.name,
            expected=f"{arm.n_v} joints, torque",
            got=f"{recording.n_v} joints, {', '.join(recording.channels())}",
        )
    missing = [
        name for name in ("stiffness", "damping") if name not in settings.unknowns and getattr(arm, name) is None
    ]
    if missing:
        raise ModelError(f"{missing[0]} is neither sought nor known", remedy="give it to the arm, or seek it")
    step = clock_step(recording)
    if settings.band[1] > 0.5 / step:
        raise ModelError(
            "the recording is too slow for the band", where=recording.name,
            expected=f"up to {0.5 / step:.3g} Hz", got=f"{settings.band[1]:g} Hz",
        )  # fmt: skip
    basis, _ = np.linalg.qr(np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, recording.n_t), settings.trend))
    moved = recording.q - recording.q[0]
    measured = moved - basis @ (basis.T @ moved)
    if not np.abs(measured).max() > 0.0:
        raise ModelError("nothing moves in the recording", where=recording.name)
    sought = np.zeros(arm.n_v)
    springs = [sought if own is None else own for own in (arm.stiffness, arm.damping)]
    known = _Values(springs[0], springs[1], arm.motor_inertia, np.ones(arm.n_v))
    return _Search(
        arm=arm, tau=recording.tau, measured=measured, basis=basis, step=step, settings=settings, known=known
    )


def _descended(search: _Search, start: FloatArray, low: FloatArray, high: FloatArray) -> _Minimum:
    from scipy.optimize import least_squares

    scale = float(np.sqrt(np.mean(search.measured**2)))
    found = least_squares(
        lambda point: search.residual(point) / scale, start, bounds=(low, high), x_scale="jac", max_nfev=100,
        xtol=1e-9, ftol=1e-10,
    )  # fmt: skip
    rows = search.measured.size
    variance = 2.0 * found.cost / max(1, rows - found.x.size)
    _, singular, right = np.linalg.svd(found.jac, full_matrices=False)
    seen = singular > 1e-9 * max(singular[0], np.finfo(float).tiny)
    spread = (right[seen].T ** 2) @ (variance / singular[seen] ** 2)
    blind = (np.abs(right[~seen]) > 1e-3).any(axis=0) if (~seen).any() else np.zeros(found.x.size, dtype=np.bool_)
    errors = np.where(blind, np.inf, np.sqrt(spread))
    bound = bool((np.minimum(found.x - low, high - found.x) < 1e-3).any())
    return _Minimum(found.x, scale * float(np.sqrt(2.0 * found.cost / rows)), errors, bound)


def _distinct(search: _Search, minima: list[_Minimum], signal: float) -> tuple[ElasticOptimum, ...]:
    from scipy.special import fdtri

    settings = search.settings
    groups: list[list[_Minimum]] = []
    for minimum in minima:
        near = [g for g in groups if np.abs(g[0].point - minimum.point).max() <= settings.apart]
        if near:
            near[0].append(minimum)
        else:
            groups.append([minimum])
    free, rows = minima[0].point.size, search.measured.size - minima[0].point.size
    limit = 1.0 + free / rows * float(fdtri(free, rows, 1.0 - settings.significance))
    least = max(minima[0].rms, _EXACT * signal)
    optima = []
    for first, *others in groups:
        values = search.values(first.point)
        optima.append(
            ElasticOptimum(
                stiffness=values.stiffness.copy(),
                damping=values.damping.copy(),
                motor_inertia=values.motor_inertia.copy(),
                link_inertia=values.link_inertia.copy(),
                rms=first.rms,
                relative_errors=first.relative_errors,
                found=1 + len(others),
                equal=max(first.rms, _EXACT * signal) ** 2 <= limit * least**2,
                on_bound=first.on_bound,
            )
        )
    return tuple(optima)
