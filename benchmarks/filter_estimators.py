"""The sequential family on known truths: bias, coverage and time of filters, recursions and the adaptive estimator.

    python benchmarks/filter_estimators.py [--json] [--quick] [--seeds 20] [--workers 2]

Every seed is a new robot (links up to 30 % heavier or lighter than described, friction up to 50 % more or less) and a new
motion of 20 s at 500 Hz, with torque noise of 5 % of each joint's RMS torque and position noise of 5e-5 rad, on the
two-link arm; once more, one seed, on a UR5e. Weighted least squares on the same filtered rows stands beside them.
Filters begin with the first 30 % of the log (`first-stretch`); in the second table with the description's parameters and
50 % uncertainty (`nominal`); in the third, the band of the state filter and of the parallel model's loop are varied.

torque: error of the torque that the estimate makes on an unseen motion, over the torque, median over seeds; bias: root
mean square over the parameters of mean error over its standard error (1 is none); inside: share of the 95 % intervals
that hold the truth, over seeds that ended well; ended: seeds that did so without advice; time: seconds per second of log.
"""

from __future__ import annotations

import argparse
import json
import time
import warnings
from concurrent.futures import ProcessPoolExecutor
from functools import cache, partial
from itertools import product
from typing import Any

import numpy as np
from scipy.special import stdtrit

from tauhat.blas import single_threaded
from tauhat.dynamics import BaseParameters, Coulomb, TorqueModel, base_parameters, motion_from_rows, torque_model
from tauhat.errors import TauhatError, TauhatWarning
from tauhat.estimation import Estimator, WeightedLeastSquares
from tauhat.estimation.evidence import collect_all
from tauhat.estimation.filters import (
    Adaline,
    AdaptiveInputError,
    CentralDifferenceKalman,
    HopfieldTank,
    Nominal,
    ParameterKalman,
    SquareRootCentralDifferenceKalman,
    SquareRootExtendedKalman,
    SquareRootUnscentedKalman,
    StateKalman,
    UnscentedKalman,
)
from tauhat.estimation.problem import Problem
from tauhat.estimation.sequential import SequentialLeastSquares
from tauhat.excitation import random_fourier
from tauhat.recordings import Processing, Recording
from tauhat.robots import load_robot
from tauhat.simulation import nominal_parameters
from tauhat.verification import standard_parameters

RATE, SECONDS, TORQUE_NOISE, POSITION_NOISE = 500.0, 20.0, 0.05, 5e-5
PROCESSING = Processing(cutoff=10.0, motion_cutoff=30.0)
METHODS: dict[str, Estimator] = {
    method.key: method
    for method in (
        *(WeightedLeastSquares(power=1.0), ParameterKalman(), Adaline(), HopfieldTank()),
        *(StateKalman(), SquareRootExtendedKalman(), UnscentedKalman(), SquareRootUnscentedKalman()),
        *(CentralDifferenceKalman(), SquareRootCentralDifferenceKalman(), AdaptiveInputError()),
        SequentialLeastSquares(),
    )
}
FROM_NOMINAL: dict[str, Estimator] = {
    method.key: method
    for method in (
        *(SquareRootExtendedKalman(beginning=Nominal()), SquareRootUnscentedKalman(beginning=Nominal())),
        *(SquareRootCentralDifferenceKalman(beginning=Nominal()), AdaptiveInputError(beginning=Nominal())),
    )
}
BANDS: dict[str, Estimator] = {
    **{f"ekf-root, {band:g} Hz": SquareRootExtendedKalman(band=band) for band in (1.0, 2.0, 5.0, 10.0, 30.0)},
    **{f"adaptive, {band:g} Hz": AdaptiveInputError(bandwidth=band) for band in (0.5, 1.0, 2.0, 5.0)},
}
BEGINNINGS = {"first-stretch": METHODS, "nominal": FROM_NOMINAL, "bands": BANDS}


@cache
def arm(name: str) -> tuple[TorqueModel, BaseParameters, np.ndarray]:
    """Model with fixed widths, base parameters, the description's standard parameters."""
    robot = load_robot(name)
    speeds = np.where(np.isfinite(robot.velocity_limit), robot.velocity_limit, 1.0)
    model = torque_model(robot).with_term(Coulomb(widths=tuple((0.02 * speeds).tolist())))
    return model, base_parameters(model), standard_parameters(model, nominal_parameters(robot))


def true_parameters(name: str, rng: np.random.Generator) -> np.ndarray:
    """Standard parameters (n_p,) of a robot like the described one: every link and every friction by a factor."""
    model, _, nominal = arm(name)
    links = rng.uniform(0.7, 1.3, model.robot.n_v)
    rigid = np.array([term.key in {"inertia", "rotor"} for term in model.terms for _ in term.parameters(model.robot)])
    own = np.array([links[parameter.joint] for parameter in model.parameters])
    return nominal * np.where(rigid, own, rng.uniform(0.5, 1.5, model.n_p))


def torque(name: str, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, standard: np.ndarray) -> np.ndarray:
    model, _, _ = arm(name)
    layout = model.layout()
    columns, _ = model.columns(motion_from_rows(q, dq, ddq), layout)
    weights = standard[layout.parameters]
    rows = [layout.of_joint(joint) for joint in range(model.robot.n_v)]
    return np.array([weights[part] @ columns[part] for part in rows]).T


def problem_of(name: str, standard: np.ndarray, rng: np.random.Generator) -> Problem:
    model, base, _ = arm(name)
    motion = random_fourier(model.robot, period=SECONDS, harmonics=5, rng=rng)
    samples = motion.sample(np.arange(0.0, SECONDS, 1.0 / RATE))
    tau = torque(name, samples.q, samples.dq, samples.ddq, standard)
    noise = TORQUE_NOISE * np.sqrt(np.mean(tau**2, axis=0)) * rng.standard_normal(tau.shape)
    q = samples.q + POSITION_NOISE * rng.standard_normal(tau.shape)
    recordings = (Recording(t=samples.t, q=q, tau=tau + noise, name=name),)
    evidence = collect_all(model, base, recordings, PROCESSING)
    return Problem(model=model, base=base, recordings=recordings, processing=PROCESSING, evidence=evidence)


@single_threaded
def run(case: tuple[str, int], *, name: str, beginning: str) -> dict[str, Any]:
    """Figures of one method and seed."""
    key, seed = case
    rng = np.random.default_rng([20261121, seed])
    model, base, _ = arm(name)
    standard = true_parameters(name, rng)
    problem = problem_of(name, standard, rng)
    unseen = random_fourier(model.robot, period=10.0, harmonics=4, rng=rng).sample(np.arange(0.0, 10.0, 0.01))
    truth = base.projection @ standard
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)
        begun = time.perf_counter()
        try:
            solution = BEGINNINGS[beginning][key].fit_problem(problem)
        except TauhatError as error:  # no segments in this motion, say: counted as not ended well
            return {"method": key, "seed": seed, "ended": False, "cause": str(error)}
        passed = time.perf_counter() - begun
    states = (unseen.q, unseen.dq, unseen.ddq)
    found = np.zeros(model.n_p)
    found[base.independent] = solution.values
    exact = torque(name, *states, standard)
    half = float(stdtrit(solution.degrees, 0.975)) * np.sqrt(np.diag(solution.covariance))
    return {
        "method": key,
        "seed": seed,
        "torque": float(np.linalg.norm(torque(name, *states, found) - exact) / np.linalg.norm(exact)),
        "error": (solution.values - truth).tolist(),
        "inside": (np.abs(solution.values - truth) <= half).tolist(),
        "ended": not solution.advice,
        "cause": solution.cause,
        "time": passed / SECONDS,
    }


def summary(runs: list[dict[str, Any]]) -> dict[str, float]:
    """Figures of one method over its seeds."""
    well, solved = [one for one in runs if one["ended"]], [one for one in runs if "torque" in one]
    errors = np.array([one["error"] for one in well])
    spread = np.std(errors, axis=0, ddof=1) / np.sqrt(len(well)) if len(well) > 2 else np.full(1, np.nan)
    bias = np.sqrt(np.mean((errors.mean(axis=0) / spread) ** 2)) if len(well) > 2 else np.nan
    return {
        "torque": float(np.median([one["torque"] for one in solved])),
        "bias": float(bias),
        "inside": float(np.mean([one["inside"] for one in well])) if well else float("nan"),
        "ended": len(well) / len(runs),
        "time": float(np.median([one["time"] for one in solved])),
    }


def measured(name: str, beginning: str, *, seeds: int, workers: int) -> dict[str, dict[str, float]]:
    """Figures of every method on one arm."""
    keys = list(BEGINNINGS[beginning])
    with ProcessPoolExecutor(workers) as pool:
        runs = list(pool.map(partial(run, name=name, beginning=beginning), list(product(keys, range(seeds)))))
    return {key: summary([one for one in runs if one["method"] == key]) for key in keys}


def shown(title: str, table: dict[str, dict[str, float]]) -> None:
    print(f"\n{title}\n{'method':18}{'torque %':>10}{'bias':>8}{'inside %':>10}{'ended %':>9}{'s per s':>9}")
    for key, row in table.items():
        print(
            f"{key:18}{100 * row['torque']:10.3f}{row['bias']:8.2f}{100 * row['inside']:10.1f}"
            f"{100 * row['ended']:9.0f}{row['time']:9.4f}",
            flush=True,
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--quick", action="store_true", help="3 seeds, the two-link arm alone")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    seeds = 3 if options.quick else options.seeds
    cases = [("two_link", beginning, seeds) for beginning in BEGINNINGS]
    cases += [] if options.quick else [("ur5e", "first-stretch", 1)]
    tables = {}
    for name, beginning, count in cases:
        title = f"{name}, {beginning}, {count} seeds"
        tables[title] = measured(name, beginning, seeds=count, workers=options.workers)
        if not options.json:
            shown(title, tables[title])
    if options.json:
        print(json.dumps(tables))


if __name__ == "__main__":
    main()
