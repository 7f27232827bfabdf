"""Genetic design: a whole population of motions in one batched call, every one inside the joint limits.

Individuals are points of the `FourierSpace`, shrunk onto the joint limits before they are judged, so that none is lost
to infeasibility. Where limits of several joints at once count too, those that keep them come first, ranked by the
criterion; the others follow, ranked by what they exceed. Crossover and mutation are pymoo's (simulated binary
crossover, polynomial mutation).

Source: Deb, Agrawal, "Simulated binary crossover for continuous search space", 1995.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ExcitationError, MissingExtraError
from tauhat.excitation.criteria import Criterion
from tauhat.excitation.guard import Guard
from tauhat.excitation.information import Information
from tauhat.excitation.space import FourierSpace, SampledSpace, random_points

SAMPLES = 100  # per period while searching
_OUTSIDE = 1e6  # above every criterion: what a motion outside its limits is worth at best

Progress = Callable[[int, float], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class GeneticSettings:
    """How the genetic search runs.

    population : individuals, all judged in one call
    generations : how often they are renewed
    """

    population: int = 100
    generations: int = 60

    def __post_init__(self) -> None:
        if self.population < 4 or self.generations < 1:
            raise ExcitationError(
                "too small a genetic search", expected="population >= 4, generations >= 1",
                got=f"{self.population}, {self.generations}",
            )  # fmt: skip


def population_values(
    information: Information, grid: SampledSpace, points: FloatArray, criterion: Criterion
) -> FloatArray:
    """Return the criterion of each point (n, n_v, 2 n_h - 1), (n,)."""
    matrices = information.matrices(grid.motion(points), len(points))
    spectra = np.linalg.eigvalsh(matrices)
    return np.array([criterion.of_lifted(spectrum)[0] for spectrum in spectra])


def evolve(
    information: Information,
    room: FourierSpace | Guard,
    *,
    criterion: Criterion,
    rng: np.random.Generator,
    settings: GeneticSettings | None = None,
    progress: Progress | None = None,
) -> tuple[FloatArray, int]:
    """Return the best point found and the number of evaluations.

    Parameters
    ----------
    room : the space to search in, or the guard that keeps limits of several joints at once in one
    progress : called after each generation with its number and the best criterion so far

    Raises
    ------
    MissingExtraError
        when pymoo is not installed.
    """
    chosen = settings or GeneticSettings()
    space, guard = (room.space, room) if isinstance(room, Guard) else (room, None)
    algorithm = _algorithm(space, chosen, rng, guard)
    grid = space.grid(SAMPLES)
    best, value = None, np.inf
    for generation in range(chosen.generations):
        population = algorithm.ask()
        points = np.array([space.shrunk(genes) for genes in population.get("X")])
        values = population_values(information, grid, points, criterion)
        if guard is not None:
            excess = guard.violations(points)
            values = np.where(excess > 0.0, _OUTSIDE + excess, values)
        population.set("F", values[:, None])
        algorithm.tell(infills=population)
        if values.min() < value:
            best, value = points[values.argmin()], float(values.min())
        if progress is not None:
            progress(generation + 1, value)
    if best is None:
        raise ExcitationError("the genetic search found no motion", where=information.model.robot.name)
    settled = best if guard is None else guard.settled(best)
    return np.asarray(settled), chosen.population * chosen.generations


def _algorithm(space: FourierSpace, settings: GeneticSettings, rng: np.random.Generator, guard: Guard | None) -> Any:
    start = random_points(space, settings.population, rng)
    if guard is not None:
        start = np.array([guard.one_start(point, index) for index, point in enumerate(start)])
    reach = 1.5 * np.abs(start).max(axis=0).ravel() + 1e-12
    rows = start.reshape(settings.population, -1)
    return genetic_algorithm(rows, low=-reach, high=reach, generations=settings.generations, rng=rng)


def genetic_algorithm(
    start: FloatArray, *, low: FloatArray | float, high: FloatArray | float, generations: int, rng: np.random.Generator
) -> Any:
    """Return pymoo's algorithm, to be asked for populations and told their values.

    Parameters
    ----------
    start : (n, n_genes) first population
    low, high : bounds of the genes, (n_genes,) or one for all

    Raises
    ------
    MissingExtraError
        when pymoo is not installed.
    """
    try:
        from pymoo.algorithms.soo.nonconvex.ga import GA
        from pymoo.core.problem import Problem
    except ImportError as error:
        raise MissingExtraError("pymoo", "excitation") from error
    problem = Problem(n_var=start.shape[1], n_obj=1, xl=low, xu=high)
    algorithm = GA(pop_size=len(start), sampling=start)
    algorithm.setup(problem, seed=int(rng.integers(2**31)), termination=("n_gen", generations), verbose=False)
    return algorithm
