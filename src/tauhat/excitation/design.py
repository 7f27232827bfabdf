"""The best motion for a robot in one call: random start, genetic search, gradient polish, exact limits, a report."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any, Literal, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.blas import single_threaded
from tauhat.dynamics.model import PLAIN_TERMS, TorqueModel, torque_model
from tauhat.dynamics.terms import Coulomb
from tauhat.errors import ExcitationError
from tauhat.excitation.criteria import Criterion, Mixed
from tauhat.excitation.fourier import FourierSeries
from tauhat.excitation.genetic import GeneticSettings, Progress, evolve
from tauhat.excitation.gradient import polish
from tauhat.excitation.information import SMOOTH_SIGN, Information, information
from tauhat.excitation.limits import MotionLimits, motion_limits
from tauhat.excitation.space import FourierSpace, random_points
from tauhat.recordings.recording import Recording
from tauhat.robots.robot import Robot

Method: TypeAlias = Literal["genetic", "gradient", "both"]
METHODS: tuple[Method, ...] = ("genetic", "gradient", "both")

_REPORT_SAMPLES = 2000


def method_named(name: str) -> Method:
    """Return the method of this name.

    Raises
    ------
    ExcitationError
        when there is none.
    """
    for method in METHODS:
        if method == name:
            return method
    raise ExcitationError("unknown method of design", expected=", ".join(METHODS), got=name)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Design:
    """A designed motion and what it is worth.

    trajectory : one period, from rest to rest
    condition : of the regressor with columns scaled by constants, exact sign in the Coulomb columns
    log_det : of the scaled information matrix
    mean_error : root mean variance of the scaled parameters at unit torque noise
    seconds, evaluations : what the search took
    margins : smallest unused part of each limit, over all joints and times
    """

    trajectory: FourierSeries
    condition: float
    log_det: float
    mean_error: float
    seconds: float
    evaluations: int
    margins: dict[str, float]

    def recording(self, *, rate: float, joint_names: tuple[str, ...] = ()) -> Recording:
        """Return the motion sampled `rate` times a second, from rest to rest, without torque."""
        t = np.arange(int(np.floor(self.trajectory.duration * rate + 1e-9)) + 1) / rate
        samples = self.trajectory.sample(t)
        return Recording(
            t=samples.t, q=samples.q, dq=samples.dq, ddq=samples.ddq, joint_names=joint_names, name="motion"
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the figures as plain data."""
        return {
            "condition": self.condition,
            "log_det": self.log_det,
            "mean_error": self.mean_error,
            "seconds": self.seconds,
            "evaluations": self.evaluations,
            "limits": self.margins,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignSettings:
    """What kind of motion is wanted and how it is searched for.

    period : [s]
    harmonics : n_h per joint
    method : "gradient" polishes `starts` random motions and takes the best, "genetic" evolves a population, "both"
        polishes what the genetic search found
    starts : random starts of the gradient method
    margin : part of every limit that is left unused
    genetic : settings of the genetic search
    """

    period: float = 10.0
    harmonics: int = 5
    method: Method = "gradient"
    starts: int = 1
    margin: float = 0.05
    genetic: GeneticSettings = field(default_factory=GeneticSettings)

    def __post_init__(self) -> None:
        method_named(self.method)
        if self.starts < 1:
            raise ExcitationError("at least one start is needed", got=self.starts)


@single_threaded
def design(
    robot: Robot,
    *,
    rng: np.random.Generator,
    criterion: Criterion | None = None,
    settings: DesignSettings | None = None,
    terms: str | Iterable[str] = PLAIN_TERMS,
    progress: Progress | None = None,
) -> Design:
    """Return a motion that identifies the robot's torque model well and keeps its joint limits at all times.

    Parameters
    ----------
    criterion : what is minimised; the mixed criterion by default
    settings : period, harmonics, method, margin
    terms : of the torque model whose columns count
    progress : called by the genetic search after each generation with its number and the best criterion

    Raises
    ------
    ExcitationError, RobotError
        when a limit leaves no room to move, or no column can be excited.
    MissingExtraError
        when the genetic search is asked for and pymoo is not installed.
    """
    wanted, chosen = settings or DesignSettings(), criterion or Mixed()
    began = time.perf_counter()
    limits = motion_limits(robot, margin=wanted.margin)
    space = FourierSpace(limits=limits, period=wanted.period, harmonics=wanted.harmonics)
    facts = information(_smooth(torque_model(robot, terms), limits))
    if wanted.method == "gradient":
        points, evaluations = _polished_starts(facts, space, chosen, wanted, rng)
    else:
        found, evaluations = evolve(facts, space, criterion=chosen, rng=rng, settings=wanted.genetic, progress=progress)
        points = [found]
    if wanted.method == "both":
        found, more = polish(facts, space, points[0], criterion=chosen)
        points, evaluations = [*points, found], evaluations + more
    best = min(points, key=lambda point: _value(facts, space, point, chosen))
    return _design(robot, facts, space, best, seconds=time.perf_counter() - began, evaluations=evaluations)


def _smooth(model: TorqueModel, limits: MotionLimits) -> TorqueModel:
    """Return the model with the sign smoothed for the search, where it has one."""
    if all(term.key != Coulomb.key for term in model.terms):
        return model
    return model.with_term(Coulomb(widths=tuple((SMOOTH_SIGN * limits.velocity).tolist())))


def _polished_starts(
    facts: Information, space: FourierSpace, criterion: Criterion, settings: DesignSettings, rng: np.random.Generator
) -> tuple[list[FloatArray], int]:
    points, evaluations = [], 0
    for start in random_points(space, settings.starts, rng):
        found, count = polish(facts, space, start, criterion=criterion)
        points.append(found)
        evaluations += count
    return points, evaluations


def _value(facts: Information, space: FourierSpace, point: FloatArray, criterion: Criterion) -> float:
    return criterion.evaluate(facts.matrix(space.grid(_REPORT_SAMPLES).motion(point)))[0]


def _design(
    robot: Robot, facts: Information, space: FourierSpace, point: FloatArray, *, seconds: float, evaluations: int
) -> Design:
    model = facts.model
    if any(term.key == Coulomb.key for term in model.terms):
        facts = replace(facts, model=model.with_term(Coulomb()))
    eigenvalues = np.linalg.eigvalsh(facts.matrix(space.grid(_REPORT_SAMPLES).motion(point)))
    if eigenvalues[0] <= 0.0:
        raise ExcitationError("the motion leaves a column of the model without excitation", where=robot.name)
    series = space.series(point)
    return Design(
        trajectory=series,
        condition=float(np.sqrt(eigenvalues[-1] / eigenvalues[0])),
        log_det=float(np.log(eigenvalues).sum()),
        mean_error=float(np.sqrt(np.mean(1.0 / eigenvalues))),
        seconds=seconds,
        evaluations=evaluations,
        margins=limit_margins(series, motion_limits(robot)),
    )


def limit_margins(series: FourierSeries, limits: MotionLimits) -> dict[str, float]:
    """Return the smallest unused part of the position, velocity and acceleration limits, at all times."""
    hull = series.envelope()
    reach = 0.5 * (limits.upper - limits.lower)
    position = np.minimum(hull.lower - limits.lower, limits.upper - hull.upper) / reach
    return {
        "position": float(position.min()),
        "velocity": float((1.0 - hull.velocity / limits.velocity).min()),
        "acceleration": float((1.0 - hull.acceleration / limits.acceleration).min()),
    }
