"""The least-squares family over many seeds: time of a thousand noisy logs, data generation included.

    python benchmarks/monte_carlo.py [--seeds 40] [--workers 2] [--robot ur5e] [--quick] [--json]

Every seed is a new random motion of 20 s at 200 Hz of a robot that is not the described one, its torque by the model
with white noise of 5 % of each joint's RMS; the log is filtered at 10 Hz once, and all of ols, wls, irls, irls-huber,
irls-bisquare, tls, ridge, prior, ml, recursive and hybrid are fitted to the rows and the evidence made of it. ols and wls
solve for shapes that are given, without telling how sure these are. Goal: 1000 seeds on two cores in 120 s.

torque: median error of the torque along the motion; inside: share of the 95 % intervals that hold the truth.
The sum of the parts is processor time; on a busy machine the wall time is longer than that over the workers.
"""

from __future__ import annotations

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from estimators import METHODS, problem_of, recorded, solved, torque_error, truth_of
from scipy.special import stdtrit

from tauhat.blas import single_threaded
from tauhat.estimation.solution import MOST_GROUPS

GOAL_SEEDS, GOAL_SECONDS = 1000, 120.0


@single_threaded
def one_seed(seed: int, *, name: str) -> dict[str, Any]:
    """Processor times of the parts of one seed [s], and how good its fits are."""
    begun = time.process_time()
    truth = truth_of(name)
    recording = recorded(truth, "clean", np.random.default_rng([20261121, seed]))
    made = time.process_time()
    problem = problem_of(truth, recording)
    # Blocks as the error bars use them: each method would merge the finer ones again.
    problem = replace(problem, evidence=problem.evidence.of_blocks(problem.evidence.merged_blocks(MOST_GROUPS)))
    times = {"data": made - begun, "rows": time.process_time() - made}
    figures = {}
    for method in METHODS:
        solution, times[method] = solved(method, problem)
        error = solution.values - truth.values
        half = stdtrit(solution.degrees, 0.975) * np.sqrt(np.diag(solution.covariance))
        inside = float(np.mean(np.abs(error) <= half))
        figures[method] = (torque_error(problem.evidence, error, truth.values), inside)
    return {"times": times, "figures": figures}


def measured(name: str, *, seeds: int, workers: int) -> dict[str, Any]:
    """Wall time of all seeds, with what the parts take; compiled code is loaded before."""
    work = partial(one_seed, name=name)
    with ProcessPoolExecutor(workers) as pool:
        list(pool.map(work, range(4 * workers)))
        begun = time.perf_counter()
        runs = list(pool.map(work, range(seeds), chunksize=min(10, -(-seeds // workers))))
        wall = time.perf_counter() - begun
    times = {part: 1e3 * float(np.mean([run["times"][part] for run in runs])) for part in runs[0]["times"]}
    figures = {method: np.array([run["figures"][method] for run in runs]) for method in METHODS}
    return {
        "robot": name,
        "base_parameters": truth_of(name).base.n_b,
        "seeds": seeds,
        "workers": workers,
        "wall_seconds": wall,
        "seconds_for_1000": wall * GOAL_SEEDS / seeds,
        "processor_seconds_for_1000": sum(times.values()) / 1e3 * GOAL_SEEDS / workers,
        "milliseconds": times,
        "torque": {method: float(np.median(rows[:, 0])) for method, rows in figures.items()},
        "inside": {method: float(np.mean(rows[:, 1])) for method, rows in figures.items()},
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--quick", action="store_true", help="10 seeds")
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--robot", default="ur5e")
    options = parser.parse_args()
    found = measured(options.robot, seeds=10 if options.quick else options.seeds, workers=options.workers)
    if options.json:
        print(json.dumps(found))
        return
    print(f"{found['robot']}, {found['base_parameters']} base parameters, {found['seeds']} seeds")
    print(f"{'part':14} {'CPU ms':>8} {'torque %':>9} {'inside %':>9}")
    for part, spent in found["milliseconds"].items():
        known = part in found["torque"]
        good = f"{100 * found['torque'][part]:9.3f} {100 * found['inside'][part]:9.1f}" if known else ""
        print(f"{part:14} {spent:8.1f} {good}")
    print(
        f"{found['wall_seconds']:.1f} s on {found['workers']} processes: {GOAL_SEEDS} seeds take "
        f"{found['seconds_for_1000']:.0f} s (processor time alone {found['processor_seconds_for_1000']:.0f} s, "
        f"goal {GOAL_SECONDS:.0f} s)"
    )


if __name__ == "__main__":
    main()
