"""Gains of a tracking law by Bayesian optimisation on a rehearsed plant, against gains set by hand.

The search is for the logarithms of factors on the gains set by hand: one factor on each kind of gain for all joints,
and a smaller one for each joint. The cost is the tracking error in parts of that of the hand-set gains, plus a small
price of torque and of its chatter, which noise, delay and high gains make:

    cost = mean_j e_j / e0_j + p_effort mean_j tau_j / tau0_j + p_chatter mean_j dtau_j / dtau0_j

The first trial is the hand-set gains, so that the result is never worse on the plant it was tuned on; what it is worth
shows on another motion with other noise. A trial whose robot runs away, strays too far from its reference or rattles
between its torque limits is stopped there and counted; its cost is infinite, and the search keeps away from it. The
gains are as safe as the plant is true: what it lacks, as the elasticity of gears, cannot make them unstable there.

Source: Bergstra, Bardenet, Bengio, Kégl, "Algorithms for hyper-parameter optimization", 2011 (tree-structured Parzen
estimators); Akiba et al., "Optuna", 2019.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray, read_only
from tauhat.blas import single_threaded
from tauhat.control.controller import Controller, TrackingController
from tauhat.control.laws import PID, TrackingLaw
from tauhat.errors import MissingExtraError, ModelError, SimulationError
from tauhat.plain_data import without_infinities
from tauhat.studies.gain_rehearsal import Judged, Price, Rehearsal, joint_gains

_ALL = "all joints"
Equipped = Callable[[TrackingLaw], Controller]


@dataclass(frozen=True, slots=True, kw_only=True)
class GainSearch:
    """How gains are searched.

    trials : runs of the plant, the one with hand-set gains among them
    span, joint_span : largest factor on a gain of all joints, and of each joint beside that; at least one
    price : of effort and chatter
    seed : of the search
    """

    trials: int = 60
    span: float = 10.0
    joint_span: float = 2.0
    price: Price = field(default_factory=Price)
    seed: int = 0

    def __post_init__(self) -> None:
        if self.trials < 2:
            raise ModelError("trials of a search for gains", expected="at least 2", got=self.trials)
        for name in ("span", "joint_span"):
            if not 1.0 <= getattr(self, name) < np.inf:
                raise ModelError(f"{name} of a search for gains", expected="a factor >= 1", got=getattr(self, name))
        if min(self.price) < 0.0:
            raise ModelError("price of effort and chatter", expected="numbers >= 0", got=self.price)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TunedGains:
    """The best gains found, and what they are worth.

    by_hand, tuned : laws
    costs : (n_trials,) of every trial in order; infinite where the robot went unstable
    before, after : of both laws on the plant and motion they were tuned on
    unseen_before, unseen_after : on a motion and with noise that the search did not see
    """

    by_hand: TrackingLaw
    tuned: TrackingLaw
    costs: FloatArray
    before: Judged
    after: Judged
    unseen_before: Judged
    unseen_after: Judged

    def __post_init__(self) -> None:
        read_only(self.costs)

    @property
    def unstable(self) -> int:
        """Number of trials in which the robot went unstable or was lost."""
        return int(np.isinf(self.costs).sum())

    @property
    def best_so_far(self) -> FloatArray:
        """Lowest cost up to each trial, (n_trials,)."""
        return np.minimum.accumulate(self.costs)

    @property
    def improvement(self) -> float:
        """Share of the tracking error, mean over the joints, that is gone on the unseen motion; negative: it grew."""
        return _gone(self.unseen_before, self.unseen_after)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data; costs of unstable trials are None."""
        return {
            "law": self.tuned.key,
            "by_hand": _gains(self.by_hand),
            "tuned": _gains(self.tuned),
            "trials": int(self.costs.size),
            "unstable": self.unstable,
            "costs": without_infinities(self.costs.tolist()),
            "error_gone": without_infinities(_gone(self.before, self.after)),
            "error_gone_unseen": without_infinities(self.improvement),
            "unseen_rms": {
                "by_hand": without_infinities(self.unseen_before.error.tolist()),
                "tuned": without_infinities(self.unseen_after.error.tolist()),
            },
            "unseen_failure": self.unseen_after.failure,
        }


@single_threaded
def tune_gains(
    rehearsal: Rehearsal,
    law: TrackingLaw,
    *,
    unseen: Rehearsal,
    search: GainSearch | None = None,
    equipped: Equipped | None = None,
) -> TunedGains:
    """Return the gains of a law that track best on a rehearsed plant.

    Parameters
    ----------
    law : with its gains set by hand, as by `tracking_gains`
    unseen : another motion and another seed, on which the gains are judged
    search : 60 trials by default
    equipped : what makes a controller of a law, as one with a model's feedforward; the law alone by default

    Raises
    ------
    MissingExtraError
        when Optuna is not installed.
    ModelError
        when gains to begin with are zero, or the rehearsals are one and the same.
    SimulationError
        when the hand-set gains are unstable.
    """
    search = search or GainSearch()
    if unseen.motion is rehearsal.motion or unseen.seed == rehearsal.seed:
        raise ModelError("gains are judged where they were not tuned", expected="another motion and another seed")
    make = equipped or _alone
    before, unseen_before = (_sound(place, make(law)) for place in (rehearsal, unseen))
    space = _Space.around(law, search)
    study = _Optimiser(search, space)
    while study.costs.size < search.trials:
        tried = space.law(study.asked())
        study.told(rehearsal.judged(make(tried)).cost(before, search.price))
    tuned = space.law(study.best)
    return TunedGains(
        by_hand=law,
        tuned=tuned,
        costs=study.costs,
        before=before,
        after=rehearsal.judged(make(tuned)),
        unseen_before=unseen_before,
        unseen_after=unseen.judged(make(tuned)),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Space:
    """Factors on the gains of a law: a point is their logarithms by name."""

    law_by_hand: TrackingLaw
    gains: dict[str, FloatArray]
    reach: dict[str, float]

    @classmethod
    def around(cls, law: TrackingLaw, search: GainSearch) -> _Space:
        names = ("kp", "kd", "ki") if isinstance(law, PID) else ("kp", "kd")
        gains = {name: joint_gains(name, getattr(law, name), law.n_v) for name in names}
        reach = {f"{name}, {_ALL}": float(np.log(search.span)) for name in names}
        for name in names:
            reach |= {f"{name}, joint {joint + 1}": float(np.log(search.joint_span)) for joint in range(law.n_v)}
        return cls(law_by_hand=law, gains=gains, reach=reach)

    def law(self, point: dict[str, float]) -> TrackingLaw:
        """Return the law at a point."""
        changed: dict[str, Any] = {}
        for name, by_hand in self.gains.items():
            own = [point[f"{name}, joint {joint + 1}"] for joint in range(by_hand.size)]
            changed[name] = by_hand * np.exp(point[f"{name}, {_ALL}"] + np.array(own))
        return replace(self.law_by_hand, **changed)


class _Optimiser:
    """Optuna, asked and told; the first point it asks for is the middle of the space."""

    def __init__(self, search: GainSearch, space: _Space) -> None:
        optuna = _load_optuna()
        self._ranges = {
            name: optuna.distributions.FloatDistribution(-reach, reach) for name, reach in space.reach.items()
        }
        spoken = optuna.logging.get_verbosity()
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        try:
            self._study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=search.seed))
        finally:
            optuna.logging.set_verbosity(spoken)
        self._study.enqueue_trial(dict.fromkeys(space.reach, 0.0))
        self._trial: Any = None
        self._costs: list[float] = []

    @property
    def costs(self) -> FloatArray:
        """Cost of every trial so far."""
        return np.array(self._costs)

    @property
    def best(self) -> dict[str, float]:
        """The point of least cost."""
        return dict(self._study.best_params)

    def asked(self) -> dict[str, float]:
        """Return the next point to try."""
        self._trial = self._study.ask(self._ranges)
        return dict(self._trial.params)

    def told(self, cost: float) -> None:
        """Take the cost of the point that was asked for."""
        self._study.tell(self._trial, cost)
        self._costs.append(cost)


def _load_optuna() -> Any:
    try:
        import optuna
    except ImportError as error:
        raise MissingExtraError("optuna", "tuning") from error
    return optuna


def _alone(law: TrackingLaw) -> Controller:
    return TrackingController(law=law)


def _sound(rehearsal: Rehearsal, controller: Controller) -> Judged:
    """Return what hand-set gains are worth; these must not fail, for all costs are in parts of theirs."""
    judged = rehearsal.judged(controller)
    if judged.failure:
        raise SimulationError("the gains set by hand are unstable", got=judged.failure, remedy="begin with lower gains")
    return judged


def _gone(before: Judged, after: Judged) -> float:
    return float(1.0 - np.mean(after.error / before.error))


def _gains(law: TrackingLaw) -> dict[str, list[float]]:
    return {"kp": law.kp.tolist(), "kd": law.kd.tolist(), "ki": law.integral_gain.tolist()}
