"""Parts of `benchmarks/estimators.py` that take every estimator there is: on the MuJoCo plant, and what a fit costs."""

from __future__ import annotations

import time
import tracemalloc
import warnings
from dataclasses import dataclass
from typing import Any

from tauhat.blas import single_threaded
from tauhat.errors import TauhatError, TauhatWarning
from tauhat.estimation.estimators import ESTIMATORS
from tauhat.estimation.simulated_runs import SimulatedRuns
from tauhat.studies.monte_carlo import MonteCarloStudy
from tauhat.studies.monte_carlo.cells import cells_of
from tauhat.studies.monte_carlo.experiment import Disturbance, experiment_of, logged, problem_of
from tauhat.studies.monte_carlo.fitting import method_of
from tauhat.workers import LocalWorkers


def on_the_plant(robot: str, *, seeds: int, workers: int) -> list[dict[str, Any]]:
    """Bias and coverage of every estimator: one row each, over so many robots, motions and noises at 500 Hz."""
    study = MonteCarloStudy(robots=(robot,), noises=(1.0,), rates=(500.0,), seeds=seeds, slow_seeds=seeds)
    cells = cells_of(study.fits(LocalWorkers(count=workers)), usable=study.usable)
    return [
        {
            "estimator": cell.estimator, "torque": cell.torque_error, "bias": cell.bias, "inside": cell.inside,
            "ended": cell.ended, "passes": cell.passes, "seconds": cell.seconds, "losses": sorted(set(cell.losses)),
        }
        for cell in cells
    ]  # fmt: skip


@dataclass
class Counter:
    """How many closed-loop simulations were run."""

    count: int = 0

    def watching(self) -> None:
        plain = SimulatedRuns.moved

        def moved(runs: SimulatedRuns, *arguments: Any, **named: Any) -> Any:
            self.count += 1
            return plain(runs, *arguments, **named)

        SimulatedRuns.moved = moved  # type: ignore[method-assign,assignment]


@single_threaded
def costs(robot: str, *, seconds: float = 20.0, rate: float = 500.0) -> list[dict[str, Any]]:
    """Time, simulations and peak memory of a fit of every estimator to one log, compiled code in memory."""
    experiment = experiment_of(robot, seed=0, seconds=seconds)
    recording = logged(experiment, Disturbance(position=5e-5, torque=0.02, rate=rate), seed=0)
    short = problem_of(experiment.model, recording.rows(0, recording.n_t // 4))
    problem = problem_of(experiment.model, recording)
    counter = Counter()
    counter.watching()
    rows = []
    for key in ESTIMATORS:
        method = method_of(key, experiment.loop)
        row: dict[str, Any] = {"estimator": key}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", TauhatWarning)
            try:
                method.fit_problem(method.settled(short))
                counter.count, start = 0, time.process_time()
                solution = method.fit_problem(method.settled(problem))
                row |= {"seconds": time.process_time() - start, "simulations": counter.count, "passes": solution.passes}
                tracemalloc.start()
                method.fit_problem(method.settled(problem))
                row["peak_mb"] = tracemalloc.get_traced_memory()[1] / 2**20
                tracemalloc.stop()
            except TauhatError as error:
                tracemalloc.stop()
                row["failure"] = str(error)
        rows.append(row)
    return rows


def show_plant(rows: list[dict[str, Any]]) -> None:
    print(f"{'on the plant':18}{'torque %':>9}{'bias':>7}{'inside %':>9}{'ended %':>9}{'passes':>7}{'CPU s':>9}")
    for row in rows:
        print(
            f"{row['estimator']:18}{100 * row['torque']:9.3f}{row['bias']:7.2f}{100 * row['inside']:9.1f}"
            f"{100 * row['ended']:9.0f}{row['passes']:7.0f}{row['seconds']:9.3f}"
        )
        for loss in row["losses"]:
            print(f"{'':18}  {loss}")


def show_costs(rows: list[dict[str, Any]]) -> None:
    print(f"{'cost of a fit':18}{'CPU s':>9}{'simulations':>12}{'passes':>7}{'peak MB':>9}")
    for row in rows:
        if "failure" in row:
            print(f"{row['estimator']:18}{row['failure']}")
            continue
        print(
            f"{row['estimator']:18}{row['seconds']:9.3f}{row['simulations']:12d}{row['passes']:7d}{row['peak_mb']:9.1f}"
        )
