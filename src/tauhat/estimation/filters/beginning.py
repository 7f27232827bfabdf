"""Where a filter begins: a Gaussian over the base parameters, and the recordings that are left to filter."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.nominal import nominal_standard_parameters
from tauhat.errors import ModelError
from tauhat.estimation.evidence import collect_all
from tauhat.estimation.filters.samples import units_of
from tauhat.estimation.least_squares import WeightedLeastSquares
from tauhat.estimation.physical import consistent
from tauhat.estimation.physical_constraints import PhysicalConstraints
from tauhat.estimation.problem import Problem
from tauhat.recordings.recording import FEWEST_SAMPLES, Recording


class Start(NamedTuple):
    """Mean (n_b,), covariance (n_b, n_b), and the recordings that did not go into them."""

    mean: FloatArray
    covariance: FloatArray
    recordings: tuple[Recording, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Beginning(ABC):
    """A choice of where to begin."""

    @abstractmethod
    def of(self, problem: Problem) -> Start:
        """Return the Gaussian and the recordings left."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Diffuse(Beginning):
    """Zero, with deviations large against any sensible value: the recordings alone decide.

    size : deviation of each parameter, in parts of the value with which its column alone would make the whole torque
    """

    size: float = 1e3

    def __post_init__(self) -> None:
        _check_positive("size", self.size)

    def of(self, problem: Problem) -> Start:
        """Return it, with all recordings left."""
        columns, torques = units_of(problem.evidence)
        deviation = self.size * float(np.linalg.norm(torques)) / columns
        return Start(np.zeros(problem.base.n_b), np.diag(deviation**2), problem.recordings)


@dataclass(frozen=True, slots=True, kw_only=True)
class FirstStretch(Beginning):
    """Weighted least squares on the first part of every recording, physically consistent; the filter sees the rest.

    Only the standard errors are taken from that fit: what a short stretch says of correlations is often a false
    certainty, and a filter never forgets it.

    share : of each recording
    widened : factor on the standard errors of that fit
    """

    share: float = 0.3
    widened: float = 2.0

    def __post_init__(self) -> None:
        _check_positive("widened", self.widened)
        if not 0.0 < self.share < 1.0:
            raise ModelError("share of the recordings to begin with", expected="between 0 and 1", got=self.share)

    def of(self, problem: Problem) -> Start:
        """Return the fit on the first parts, and the second parts."""
        cuts = [int(self.share * recording.n_t) for recording in problem.recordings]
        if min(cuts) < FEWEST_SAMPLES:
            raise ModelError(
                "the first stretch is too short to begin with",
                expected=f">= {FEWEST_SAMPLES} samples",
                got=min(cuts),
                remedy="give longer recordings",
            )
        pairs = list(zip(problem.recordings, cuts, strict=True))
        first = [recording.rows(0, cut) for recording, cut in pairs]
        evidence = collect_all(problem.model, problem.base, first, problem.processing)
        solution = WeightedLeastSquares(power=1.0).fit(evidence)
        rest = tuple(recording.rows(cut, recording.n_t) for recording, cut in pairs)
        found = consistent(
            evidence, problem.model, problem.base, weights=solution.weights, constraints=PhysicalConstraints()
        )
        return Start(found.values, np.diag(self.widened**2 * np.diag(solution.covariance)), rest)


@dataclass(frozen=True, slots=True, kw_only=True)
class Nominal(Beginning):
    """The robot description's masses, inertias and friction.

    relative : standard deviation in parts of each value
    least : standard deviation beside that, in parts of what the column alone would need to make the whole torque
    """

    relative: float = 0.5
    least: float = 0.02

    def __post_init__(self) -> None:
        _check_positive("relative", self.relative)
        _check_positive("least", self.least)

    def of(self, problem: Problem) -> Start:
        """Return the nominal values, with all recordings left."""
        robot = problem.model.robot
        if not robot.has_inertia:
            raise ModelError("the robot's description has no masses to begin with", where=robot.name)
        mean = problem.base.projection @ nominal_standard_parameters(problem.model)
        columns, torques = units_of(problem.evidence)
        deviation = self.relative * np.abs(mean) + self.least * float(np.linalg.norm(torques)) / columns
        return Start(mean, np.diag(deviation**2), problem.recordings)


@dataclass(frozen=True, slots=True, kw_only=True)
class Given(Beginning):
    """Values and standard deviations of the base parameters, (n_b,) each."""

    values: tuple[float, ...] = field(default=())
    deviations: tuple[float, ...] = field(default=())

    def of(self, problem: Problem) -> Start:
        """Return them, with all recordings left."""
        if not len(self.values) == len(self.deviations) == problem.base.n_b:
            raise ModelError(
                "values and deviations to begin with do not fit the base parameters",
                expected=problem.base.n_b,
                got=f"{len(self.values)} and {len(self.deviations)}",
            )
        if not min(self.deviations) > 0.0:
            raise ModelError("a deviation to begin with is not positive", got=min(self.deviations))
        return Start(np.array(self.values), np.diag(np.square(self.deviations)), problem.recordings)


def _check_positive(name: str, value: float) -> None:
    if not 0.0 < value < np.inf:
        raise ModelError(f"beginning: {name} must be positive", got=value)
