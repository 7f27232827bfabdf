"""All estimators on simulated robots, over noise and sampling rate, many times: the settings and the run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import ClassVar

import numpy as np

from tauhat.errors import ModelError
from tauhat.estimation.estimators import ESTIMATORS, estimator_named
from tauhat.studies.monte_carlo.chapters import chapters_of, summary_of
from tauhat.studies.monte_carlo.experiment import Disturbance, check_rate
from tauhat.studies.monte_carlo.families import SLOW
from tauhat.studies.monte_carlo.figures import Figures
from tauhat.studies.monte_carlo.fitting import Case, Fit, fits_of
from tauhat.studies.study import Study, StudyResult
from tauhat.workers import Workers


@dataclass(frozen=True, slots=True, kw_only=True)
class MonteCarloStudy(Study):
    """Every estimator on every robot, level of noise and rate, with as many robots, motions and noises as seeds.

    Source: Leboutet et al., "Inertial parameter identification in robotics: a survey", 2021 (the comparison).

    robots : what `load_robot` takes
    noises : levels, in parts of `position_noise` and `torque_noise`
    rates : of the log [Hz]; 2000 Hz is a multiple of each
    estimators : by name
    seeds : of every estimator
    slow_seeds : of those that take more than about a second a fit, at most
    seconds : duration of the motion [s]
    position_noise : usual standard deviation of a position [rad or m]
    torque_noise : the same of a torque, in parts of its root mean square
    usable : largest relative error of the torque on the unseen motion with which a fit has ended well
    """

    key: ClassVar[str] = "estimators"
    title: ClassVar[str] = "Estimators compared by Monte Carlo"
    takes: ClassVar[tuple[str, ...]] = ("seeds", "estimators")
    robots: tuple[str, ...] = ("staubli_tx40", "ur5e")
    noises: tuple[float, ...] = (0.1, 1.0, 5.0)
    rates: tuple[float, ...] = (100.0, 500.0, 1000.0)
    estimators: tuple[str, ...] = tuple(ESTIMATORS)
    seeds: int = 20
    slow_seeds: int = 3
    seconds: float = 10.0
    position_noise: float = 5e-5
    torque_noise: float = 0.02
    usable: float = 0.2

    def __post_init__(self) -> None:
        for name in ("robots", "noises", "rates", "estimators"):
            values = tuple(getattr(self, name))
            object.__setattr__(self, name, values)
            if not values or len(set(values)) < len(values):
                raise ModelError(f"study of estimators: {name}", expected="at least one, none twice", got=values)
        for key in self.estimators:
            estimator_named(key)
        for rate in self.rates:
            check_rate(rate)
        for name in ("seeds", "slow_seeds"):
            if getattr(self, name) < 1:
                raise ModelError(f"study of estimators: {name}", expected="at least 1", got=getattr(self, name))
        for name in ("seconds", "position_noise", "torque_noise", "usable"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise ModelError(f"study of estimators: {name}", expected="a positive number", got=getattr(self, name))
        if not all(0.0 < level < np.inf for level in self.noises):
            raise ModelError("study of estimators: noises", expected="positive numbers", got=self.noises)

    def cases(self) -> tuple[Case, ...]:
        """Return the pieces of work; those of one simulated experiment follow each other."""
        situations = [(rate, noise) for rate in self.rates for noise in self.noises]
        cases = (
            Case(
                robot=robot,
                noise=noise,
                disturbance=Disturbance(
                    position=noise * self.position_noise, torque=noise * self.torque_noise, rate=rate
                ),
                seed=seed,
                seconds=self.seconds,
                estimators=tuple(key for key in self.estimators if seed < self.seeds_of(key)),
            )
            for robot in self.robots
            for seed in range(self.seeds)
            for rate, noise in situations
        )
        return tuple(case for case in cases if case.estimators)

    def seeds_of(self, estimator: str) -> int:
        """Return how many seeds an estimator is fitted to."""
        return min(self.slow_seeds, self.seeds) if estimator in SLOW else self.seeds

    def fits(self, workers: Workers, *, tell: Callable[[str], None] = lambda _: None) -> tuple[Fit, ...]:
        """Return every fit, in the order of the cases."""
        cases, fits = self.cases(), list[Fit]()
        for number, (case, found) in enumerate(zip(cases, workers.map(fits_of, cases), strict=True), start=1):
            fits += found
            rate = f"{case.disturbance.rate:g} Hz"
            tell(f"{number} of {len(cases)}: {case.robot}, noise {case.noise:g}, {rate}, seed {case.seed}")
        return tuple(fits)

    def run(self, workers: Workers, *, tell: Callable[[str], None] = lambda _: None) -> StudyResult:
        """Return the figures of all fits in chapters."""
        return self.result(self.fits(workers, tell=tell))

    def result(self, fits: Sequence[Fit]) -> StudyResult:
        """Return the figures of these fits in chapters."""
        figures = Figures.of(self, fits)
        return StudyResult(
            name=self.key,
            title=self.title,
            summary=summary_of(figures),
            chapters=chapters_of(figures),
            settings=asdict(self),
        )
