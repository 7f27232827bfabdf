"""The error budget of a rehearsed experiment: which share of the squared error each cause makes, ranked.

To first order the errors that causes make add up, so that the squared error is a sum over causes and pairs of causes:
    E^2 = E0^2 + sum_i a_i + sum_(i<j) b_ij
Switched on alone, a cause adds a_i; switched off alone, it takes a_i + sum_j b_ij with it. The mean of the two halves
what a pair makes together between its causes (the Shapley value of such a sum), so that shares, what is left without
any cause (E0^2), and the rest of higher interactions add up to one.

Source: Shapley, "A value for n-person games", 1953.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.dynamics.model import known_terms
from tauhat.errors import ModelError
from tauhat.estimation.estimators import estimator_named
from tauhat.simulation.planned_experiment import MotionPlan, PlannedExperiment
from tauhat.verification.error_budget.advice import WORTH, Facts, advice_on
from tauhat.verification.error_budget.causes import CAUSES
from tauhat.verification.error_budget.trial import (
    BudgetMotions,
    BudgetTrial,
    Measure,
    RobotBudget,
    robot_budget,
    whole_case,
)
from tauhat.workers import Workers

_SPREAD = (0.1, 0.9)  # quantiles over the robots


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BudgetSettings:
    """What a budget is made of.

    experiment : what is rehearsed; its own motion is left aside
    motions : that are fitted and judged on
    terms, estimator : of the models
    seeds : true robots, each with sensors and noise of its own
    warmer : how much warmer the joints are on the unseen motion, where the experiment has heat [K]
    """

    experiment: PlannedExperiment
    motions: BudgetMotions
    terms: str = "robust"
    estimator: str = "wls"
    seeds: int = 5
    warmer: float = 0.0

    def __post_init__(self) -> None:
        if self.seeds < 1:
            raise ModelError("error budget: robots", expected="at least 1", got=self.seeds)
        if not abs(self.warmer) <= 100.0:
            raise ModelError("error budget: change of temperature", expected="-100 to 100 K", got=f"{self.warmer:g} K")
        known_terms(self.terms)
        estimator_named(self.estimator)

    def trials(self) -> tuple[BudgetTrial, ...]:
        """Return a piece of work for every robot."""
        light = MotionPlan()  # limits have done their work, and need not travel to the workers
        make = partial(BudgetTrial, motions=self.motions, terms=self.terms, estimator=self.estimator)
        experiment = replace(self.experiment, motion=light)
        return tuple(make(experiment=experiment, warmer=self.warmer, seed=seed) for seed in range(self.seeds))


@dataclass(frozen=True, slots=True, kw_only=True)
class CauseShare:
    """What one cause makes.

    share : of the squared error, mean over the robots
    low, high : what a tenth and nine tenths of the robots have
    removed : share that goes when only this cause is switched off
    alone : share that it makes as the only cause
    on_log, log_low, log_high : share of the squared error that `tauhat verify` shows on a log, likewise
    error_without : error when only this cause is switched off, median
    advice : what to do about it
    """

    key: str
    title: str
    share: float
    low: float
    high: float
    removed: float
    alone: float
    on_log: float
    log_low: float
    log_high: float
    error_without: float
    advice: str

    @property
    def worth(self) -> bool:
        """Whether something should be done about it."""
        return max(self.share, self.on_log) >= WORTH


@dataclass(frozen=True, slots=True, kw_only=True)
class ErrorBudget:
    """Where the error of a rehearsed experiment comes from.

    error, on_log : of the torque on an unseen motion with every cause, against the truth and as `tauhat verify` shows
        it on a log, as fractions of the torque; medians over the robots
    shares : of every cause that the experiment has, the largest first
    floor, log_floor : share of the squared errors that is left without any cause
    rest, log_rest : share that is of no pair of causes, but of more together; below zero where they hide each other
    absent : titles of causes that the experiment does not have
    robots : every robot's errors
    """

    error: float
    on_log: float
    shares: tuple[CauseShare, ...]
    floor: float
    rest: float
    log_floor: float
    log_rest: float
    absent: tuple[str, ...]
    robots: tuple[RobotBudget, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the figures as plain data."""
        return {
            "error": self.error, "on_log": self.on_log, "shares": [asdict(share) for share in self.shares],
            "floor": self.floor, "rest": self.rest, "log_floor": self.log_floor, "log_rest": self.log_rest,
            "absent": list(self.absent), "robots": len(self.robots),
            "failures": [robot.failure for robot in self.robots if robot.failure],
        }  # fmt: skip


def error_budget(
    settings: BudgetSettings, workers: Workers, *, tell: Callable[[str], None] = lambda _: None
) -> ErrorBudget:
    """Return which share of the squared error every cause makes, from experiments with causes switched on and off.

    Robots that give no model in one of their cases are counted and left out.

    Raises
    ------
    ModelError
        when no robot gives models in all cases.
    """
    trials = settings.trials()
    robots: list[RobotBudget] = []
    for number, robot in enumerate(workers.map(robot_budget, trials), start=1):
        robots.append(robot)
        tell(f"{number} of {len(trials)} robots")
    return budget_of(settings, robots)


def budget_of(settings: BudgetSettings, robots: Sequence[RobotBudget]) -> ErrorBudget:
    """Return the budget that the errors of some robots make; errors as `error_budget`."""
    solved = [robot for robot in robots if not robot.failure]
    if not solved:
        raise ModelError("error budget: no robot gave all its models", got=robots[0].failure)
    facts = _facts(settings, solved)
    shares = [_share(key, solved, facts) for key in solved[0].without]
    floor, log_floor = (float(np.mean(_squares(solved, field, _clean))) for field in ("error", "on_log"))
    return ErrorBudget(
        error=_median([robot.whole.error for robot in solved]),
        on_log=_median([robot.whole.on_log for robot in solved]),
        shares=tuple(sorted(shares, key=lambda share: -share.share)),
        floor=floor,
        rest=1.0 - floor - sum(share.share for share in shares),
        log_floor=log_floor,
        log_rest=1.0 - log_floor - sum(share.on_log for share in shares),
        absent=tuple(cause.title for key, cause in CAUSES.items() if key not in solved[0].without),
        robots=tuple(robots),
    )


def _share(key: str, robots: Sequence[RobotBudget], facts: Facts) -> CauseShare:
    removed, alone = _removed(key, robots, "error"), _alone(key, robots, "error")
    log_both = 0.5 * (_removed(key, robots, "on_log") + _alone(key, robots, "on_log"))
    share, low, high = _summary(0.5 * (removed + alone))
    on_log, log_low, log_high = _summary(log_both)
    without = _median([robot.without[key].error for robot in robots])
    return CauseShare(
        key=key,
        title=CAUSES[key].title,
        share=share,
        low=low,
        high=high,
        removed=float(removed.mean()),
        alone=float(alone.mean()),
        on_log=on_log,
        log_low=log_low,
        log_high=log_high,
        error_without=without,
        advice=advice_on(key, facts),
    )


def _removed(key: str, robots: Sequence[RobotBudget], field: str) -> FloatArray:
    """Return the share of each robot's squared error that goes without a cause, (n,)."""
    return 1.0 - _squares(robots, field, lambda robot: robot.without[key])


def _alone(key: str, robots: Sequence[RobotBudget], field: str) -> FloatArray:
    """Return the share that the cause makes alone, (n,)."""
    return _squares(robots, field, lambda robot: robot.alone[key]) - _squares(robots, field, _clean)


def _squares(robots: Sequence[RobotBudget], field: str, pick: Callable[[RobotBudget], Measure]) -> FloatArray:
    """Return squared errors over those with every cause, (n,); nothing where there is no error at all."""
    whole = np.array([getattr(robot.whole, field) for robot in robots])
    part = np.array([getattr(pick(robot), field) for robot in robots])
    return np.asarray((part / np.where(whole > 0.0, whole, 1.0)) ** 2)


def _clean(robot: RobotBudget) -> Measure:
    return robot.clean


def _summary(values: FloatArray) -> tuple[float, float, float]:
    """Return the mean over robots, and the quantiles about it."""
    mean, (low, high) = float(values.mean()), np.quantile(values, _SPREAD)
    return mean, min(float(low), mean), max(float(high), mean)


def _facts(settings: BudgetSettings, robots: Sequence[RobotBudget]) -> Facts:
    return Facts(
        case=whole_case(settings.trials()[0]),
        terms=settings.terms,
        seconds=settings.motions.fitted.duration,
        condition=_median([robot.whole.condition for robot in robots]),
        further_condition=_median([robot.without["conditioning"].condition for robot in robots]),
        cutoff=_median([robot.cutoff for robot in robots]),
    )


def _median(values: Sequence[float]) -> float:
    return float(np.median(values))
