"""Genetic search for the program of a stage: every individual is planned before it is judged.

A program that cannot be planned, lasts too long, or breaks a limit of several joints ranks behind all that do not, by
how far it is off. Several populations evolve side by side, each in a process of its own; the best of all is kept.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.dynamics.motion import Motion, motion_from_rows
from tauhat.errors import ExcitationError
from tauhat.excitation.criteria import Criterion
from tauhat.excitation.genetic import GeneticSettings, genetic_algorithm
from tauhat.excitation.information import Information
from tauhat.excitation.limits import MotionLimit
from tauhat.excitation.task_design.blocks import told_of
from tauhat.excitation.task_design.program import ProgramSpace
from tauhat.excitation.waypoints.motion import WaypointMotion

SAMPLES = 200  # of a program while searching
FINE = 4000  # of a program that is looked at in the end
_OUTSIDE = 1e6  # above every criterion
_KEPT = 10  # individuals of a population that are handed back, best first


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StageSearch:
    """What programs of a stage are judged by.

    facts : the columns, scaled; its sign is smooth
    known : (n, n) information of the stages before, per reading of all stages
    share : part of all readings, weighted, that this stage gives when its time is filled
    counted : places of the columns that count
    others : limits of several joints at once
    margin : part of relative limits that is left unused
    """

    space: ProgramSpace
    facts: Information
    known: FloatArray
    share: float
    counted: IntArray
    criterion: Criterion
    others: tuple[MotionLimit, ...]
    margin: float

    def value(self, genes: FloatArray) -> float:
        """Return the criterion of the program that genes pick; `_OUTSIDE` and more for one that is not allowed."""
        try:
            motion = self.space.motion(genes)
        except ExcitationError:
            return 3.0 * _OUTSIDE
        late = motion.duration / self.space.stage.seconds
        if late > 1.0:
            return _OUTSIDE * (3.0 - 1.0 / late)
        samples = sampled(motion, SAMPLES)
        least = min((self.room(samples, limit) for limit in self.others), default=0.0)
        if least < 0.0:
            return _OUTSIDE * (2.0 - 1.0 / (1.0 - least))
        filled = self.space.stage.runs(motion.duration) * motion.duration / self.space.stage.seconds
        told = told_of(self.known + self.share * filled * self.facts.matrix(samples), self.counted)
        return self.criterion.of_lifted(np.asarray(np.linalg.eigvalsh(told), dtype=np.float64))[0]

    def refusal(self, genes: FloatArray) -> ExcitationError:
        """Return why a program is not allowed."""
        where = f"stage {self.space.stage.name}"
        try:
            motion = self.space.motion(genes)
        except ExcitationError as error:
            return ExcitationError(
                f"no program can be planned: {error.what}", where=f"{where}, {error.where}", expected=error.expected,
                got=error.got, remedy=error.remedy,
            )  # fmt: skip
        if motion.duration > self.space.stage.seconds:
            return ExcitationError(
                "no program is short enough", where=where, expected=f"{self.space.stage.seconds:g} s",
                got=f"{motion.duration:.1f} s", remedy="more seconds, fewer points, faster moves, or a larger search",
            )  # fmt: skip
        samples = sampled(motion, FINE)
        limit = min(self.others, key=lambda each: self.room(samples, each))
        rows = limit.margins(samples).min(axis=1)
        return ExcitationError(
            f"no program keeps the limit {limit.name}", where=f"{where}, {limit.parts[int(rows.argmin())]}",
            got=limit.missing(int(rows.argmin()), float(rows.min())), remedy="a smaller region, or slower moves",
        )  # fmt: skip

    def room(self, motion: Motion, limit: MotionLimit) -> float:
        """Return the smallest margin of a limit along a motion; negative outside."""
        return float(limit.margins(motion).min()) - (self.margin if limit.relative else 0.0)


@dataclass(frozen=True, slots=True)
class Island:
    """One population of a search, to be evolved in a process of its own."""

    search: StageSearch
    settings: GeneticSettings

    def __call__(self, seed: int) -> tuple[FloatArray, FloatArray]:
        """Return the best individuals, (n, n_genes), best first, and their values, (n,)."""
        search, rng = self.search, np.random.default_rng(seed)
        start = rng.random((self.settings.population, search.space.n_genes))
        algorithm = genetic_algorithm(start, low=0.0, high=1.0, generations=self.settings.generations, rng=rng)
        best, least = np.empty((0, start.shape[1])), np.empty(0)
        for _ in range(self.settings.generations):
            population = algorithm.ask()
            genes = np.asarray(population.get("X"), dtype=np.float64)
            values = np.array([search.value(row) for row in genes])
            population.set("F", values[:, None])
            algorithm.tell(infills=population)
            order = np.argsort(np.concatenate([least, values]), kind="stable")[:_KEPT]
            best, least = np.concatenate([best, genes])[order], np.concatenate([least, values])[order]
        return best, least


def is_allowed(value: float) -> bool:
    """Return whether a value of the search is that of a program inside all limits."""
    return value < _OUTSIDE


def sampled(motion: WaypointMotion, count: int) -> Motion:
    """Return one run of a program at `count` evenly spaced times."""
    t = (np.arange(count, dtype=np.float64) + 0.5) * (motion.duration / count)
    samples = motion.sample(np.asarray(t))
    return motion_from_rows(samples.q, samples.dq, samples.ddq)
