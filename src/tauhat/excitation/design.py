"""The best motion for a robot in one call: random start, genetic search, gradient polish, exact limits, a report."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Any, Literal, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.blas import single_threaded
from tauhat.dynamics.model import PLAIN_TERMS, TorqueModel, torque_model
from tauhat.dynamics.motion import Motion
from tauhat.errors import ExcitationError
from tauhat.excitation.criteria import FLOOR, Criterion, Mixed
from tauhat.excitation.excited import excited_spectrum
from tauhat.excitation.fourier import FourierSeries
from tauhat.excitation.genetic import GeneticSettings, Progress, evolve
from tauhat.excitation.gradient import SAMPLES, polish
from tauhat.excitation.guard import FINER, Guard
from tauhat.excitation.information import (
    Information,
    Knowledge,
    after_evidence,
    after_motions,
    information,
    with_exact_sign,
    with_smooth_sign,
)
from tauhat.excitation.limits import LimitSet, MotionLimits
from tauhat.excitation.poses import guard_of, motion_space
from tauhat.excitation.repeated import Repeated
from tauhat.excitation.space import FourierSpace, random_points
from tauhat.recordings.recording import Recording
from tauhat.robots.robot import Robot

Method: TypeAlias = Literal["genetic", "gradient", "both"]
"""How a motion is searched for."""
METHODS: tuple[Method, ...] = ("genetic", "gradient", "both")
"""All of these."""

_REPORT_SAMPLES = FINER * SAMPLES


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
    """A designed motion and what it is worth, together with what was known before it.

    trajectory : one period, from rest to rest
    condition : of the regressor with columns scaled by constants, exact sign in the Coulomb columns
    log_det : of the scaled information matrix
    mean_error : root mean variance of the scaled parameters at unit torque noise
    mean_error_before : the same without this motion, from what was known; infinite where something was not
    seconds, evaluations : what the search took
    margins : smallest unused part of each limit, over all joints and times; of distances, what is beyond the clearance
        in parts of 0.1 m
    """

    trajectory: FourierSeries
    condition: float
    log_det: float
    mean_error: float
    mean_error_before: float
    seconds: float
    evaluations: int
    margins: dict[str, float]

    def recording(self, *, rate: float, joint_names: tuple[str, ...] = (), periods: int = 1) -> Recording:
        """Return the motion, run `periods` times, sampled `rate` times a second, from rest to rest, without torque."""
        motion = Repeated(series=self.trajectory, periods=periods)
        t = np.arange(int(np.floor(motion.duration * rate + 1e-9)) + 1) / rate
        samples = motion.sample(t)
        return Recording(
            t=samples.t, q=samples.q, dq=samples.dq, ddq=samples.ddq, joint_names=joint_names, name="motion"
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the figures as plain data."""
        return {
            "condition": self.condition,
            "log_det": self.log_det,
            "mean_error": self.mean_error,
            "mean_error_before": self.mean_error_before,
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
    limits : further limits than the robot's own, or others
    after : what is already known: the motion is then designed for what is still uncertain
    earlier : motions of the same period that will be run as well: the motion is designed for what they leave uncertain
    counted : gives the columns that count for a model, such as `payload_information`; all by default
    """

    period: float = 10.0
    harmonics: int = 5
    method: Method = "gradient"
    starts: int = 1
    margin: float = 0.05
    genetic: GeneticSettings = field(default_factory=GeneticSettings)
    limits: LimitSet | None = None
    after: Knowledge | None = None
    earlier: tuple[FourierSeries, ...] = ()
    counted: Callable[[TorqueModel], Information] = information

    def __post_init__(self) -> None:
        method_named(self.method)
        if self.starts < 1:
            raise ExcitationError("at least one start is needed", got=self.starts)
        other = next((series.period for series in self.earlier if series.period != self.period), None)
        if other is not None:
            raise ExcitationError("an earlier motion has another period", expected=f"{self.period:g} s", got=other)


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
    limits = wanted.limits or LimitSet(robot=robot)
    limits.check_robot(robot)
    space = motion_space(limits, margin=wanted.margin, period=wanted.period, harmonics=wanted.harmonics)
    known = wanted.counted(with_smooth_sign(torque_model(limits.robot, terms), space.limits))
    if wanted.after is not None:
        known = after_evidence(known, wanted.after, seconds=wanted.period)
    facts = after_motions(known, [_run_of(series) for series in wanted.earlier])
    guard = None
    if limits.others:
        guard = guard_of(space, limits, margin=wanted.margin, samples=SAMPLES, rng=rng)
    search = _Search(facts=facts, space=space, criterion=chosen, settings=wanted, guard=guard)
    best, evaluations = search.run(rng, progress)
    exact = after_motions(
        replace(known, model=with_exact_sign(known.model)), [_run_of(series) for series in wanted.earlier]
    )
    return _design(limits, exact, space, best, seconds=time.perf_counter() - began, evaluations=evaluations)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Search:
    facts: Information
    space: FourierSpace
    criterion: Criterion
    settings: DesignSettings
    guard: Guard | None

    def run(self, rng: np.random.Generator, progress: Progress | None) -> tuple[FloatArray, int]:
        """Return the best point and the number of evaluations."""
        if self.settings.method == "gradient":
            points, evaluations = self._polished(random_points(self.space, self.settings.starts, rng))
        else:
            found, evaluations = evolve(
                self.facts,
                self.guard or self.space,
                criterion=self.criterion,
                rng=rng,
                settings=self.settings.genetic,
                progress=progress,
            )
            points = [found]
        if self.settings.method == "both":
            better, more = self._polished(points[0][None])
            points, evaluations = [*points, *better], evaluations + more
        return min(points, key=self._value), evaluations

    def _polished(self, starts: FloatArray) -> tuple[list[FloatArray], int]:
        points, evaluations = [], 0
        for start in starts:
            found, count = polish(self.facts, self.space, start, criterion=self.criterion, guard=self.guard)
            points.append(found)
            evaluations += count
        return points, evaluations

    def _value(self, point: FloatArray) -> float:
        grid = self.space.grid(_REPORT_SAMPLES)
        return self.criterion.evaluate(self.facts.matrix(grid.motion(point)))[0]


def _run_of(series: FourierSeries) -> Motion:
    """Return one run of a motion on the fine grid."""
    t = np.arange(_REPORT_SAMPLES, dtype=np.float64) * (series.period / _REPORT_SAMPLES)
    samples = series.sample(t)
    q, dq, ddq = (np.ascontiguousarray(part.T) for part in (samples.q, samples.dq, samples.ddq))
    return Motion(q=q, dq=dq, ddq=ddq)


def _mean_error(eigenvalues: FloatArray) -> float:
    """Return the root mean variance of scaled parameters whose information has these eigenvalues, smallest first."""
    if eigenvalues[0] <= FLOOR * eigenvalues[-1]:
        return float("inf")
    return float(np.sqrt(np.mean(1.0 / eigenvalues)))


def _design(
    limits: LimitSet, facts: Information, space: FourierSpace, point: FloatArray, *, seconds: float, evaluations: int
) -> Design:
    eigenvalues = excited_spectrum(facts, facts.matrix(space.grid(_REPORT_SAMPLES).motion(point)))
    series = space.series(point)
    return Design(
        trajectory=series,
        condition=float(np.sqrt(eigenvalues[-1] / eigenvalues[0])),
        log_det=float(np.log(eigenvalues).sum()),
        mean_error=float(np.sqrt(np.mean(1.0 / eigenvalues))),
        mean_error_before=_mean_error(np.asarray(np.linalg.eigvalsh(facts.prior))),
        seconds=seconds,
        evaluations=evaluations,
        margins=limit_margins(series, limits.of_joints()) | _further_margins(space, point, limits),
    )


def limit_margins(series: FourierSeries, limits: MotionLimits) -> dict[str, float]:
    """Return the smallest unused part of the position, velocity, acceleration and jerk limits, at all times."""
    hull = series.envelope()
    reach = 0.5 * (limits.upper - limits.lower)
    position = np.minimum(hull.lower - limits.lower, limits.upper - hull.upper) / reach
    margins = {
        "position": float(position.min()),
        "velocity": float((1.0 - hull.velocity / limits.velocity).min()),
        "acceleration": float((1.0 - hull.acceleration / limits.acceleration).min()),
    }
    if limits.jerk is not None:
        margins["jerk"] = float((1.0 - series.largest_jerk() / limits.jerk).min())
    return margins


def _further_margins(space: FourierSpace, point: FloatArray, limits: LimitSet) -> dict[str, float]:
    motion = space.grid(_REPORT_SAMPLES).motion(point)
    return {limit.name: float(limit.margins(motion).min()) for limit in limits.others}
