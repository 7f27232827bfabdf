"""Bias, coverage and cost of every estimator, and of the least-squares family under what its members differ by.

    python benchmarks/estimators.py [--parts conditions plant cost] [--json] [--quick] [--seeds 24] [--robot ur5e]
                                    [--workers 2]

plant: every estimator on the MuJoCo plant, each seed another robot, motion and noise of 10 s at 500 Hz.
cost: processor time, closed-loop simulations and peak memory of a fit of 20 s at 500 Hz.
conditions: the least-squares family. Every seed is a new motion of 20 s at 200 Hz and a new noise of 5 % of each joint's RMS torque, through a low-pass of
10 Hz. Conditions:
    clean     white noise
    spikes    5 % of the torque samples off by ten times the joint's RMS torque, either sign
    touches   in 5 % of the time something leans on a joint for 0.3 s, with the joint's RMS torque
    shared    the joints' noise has a correlation of 0.9
    columns   every column and the torque have white errors of 6 % of their norm (made row by row: no recording has that)
torque: error of the torque that the estimate makes on the motion, over the torque, median over seeds; bias: root mean
square over the parameters of mean error over its standard error (1 is none); inside: share of the 95 % intervals that
hold the truth; worst: of a single parameter.
"""

from __future__ import annotations

import argparse
import json
import time
import warnings
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import numpy as np
from estimator_parts import costs, on_the_plant, show_costs, show_plant
from scipy.special import stdtrit

from tauhat.blas import single_threaded
from tauhat.dynamics import BaseParameters, Coulomb, TorqueModel, base_parameters, motion_from_rows, torque_model
from tauhat.errors import TauhatWarning
from tauhat.estimation import (
    Evidence,
    OrdinaryLeastSquares,
    Solution,
    WeightedLeastSquares,
    estimator_named,
)
from tauhat.estimation.evidence import evidence_from_rows
from tauhat.estimation.problem import Problem
from tauhat.estimation.rows import Rows, filtered_rows
from tauhat.excitation import random_fourier
from tauhat.recordings import Processing, Recording
from tauhat.robots import load_robot
from tauhat.simulation import nominal_parameters
from tauhat.verification import standard_parameters

METHODS = (
    *("ols", "wls", "irls", "irls-huber", "irls-bisquare", "tls"),
    *("ridge", "prior", "ml", "recursive", "hybrid"),
)
PARTS = ("conditions", "plant", "cost")
CONDITIONS = ("clean", "spikes", "touches", "shared", "columns")
RATE, SECONDS, NOISE = 200.0, 20.0, 0.05
PROCESSING = Processing(cutoff=10.0, motion_cutoff=30.0)
SHARE, TOUCH, CORRELATION, COLUMNS = 0.05, 60, 0.9, 0.06


@dataclass(frozen=True)
class Truth:
    """A model with fixed shapes, its base parameters, and the standard parameters that make the torque."""

    model: TorqueModel
    base: BaseParameters
    standard: np.ndarray

    @property
    def values(self) -> np.ndarray:
        return self.base.projection @ self.standard


@cache
def truth_of(name: str) -> Truth:
    robot = load_robot(name)
    speeds = np.where(np.isfinite(robot.velocity_limit), robot.velocity_limit, 1.0)
    model = torque_model(robot).with_term(Coulomb(widths=tuple((0.02 * speeds).tolist())))
    # The nominal robot is not the truth: else a prior towards it would be right by definition.
    standard = standard_parameters(model, nominal_parameters(robot))
    sizes = 1.0 + 0.2 * np.random.default_rng(7).standard_normal(standard.size)
    return Truth(model, base_parameters(model), standard * sizes)


def recorded(truth: Truth, condition: str, rng: np.random.Generator) -> Recording:
    """A random motion with the model's torque, noise, and what the condition adds."""
    motion = random_fourier(truth.model.robot, period=SECONDS, harmonics=5, rng=rng)
    samples = motion.sample(np.arange(0.0, SECONDS, 1.0 / RATE))
    layout = truth.model.layout()
    columns, _ = truth.model.columns(motion_from_rows(samples.q, samples.dq, samples.ddq), layout)
    weights = truth.standard[layout.parameters]
    n_v = truth.model.robot.n_v
    tau = np.array([weights[layout.of_joint(j)] @ columns[layout.of_joint(j)] for j in range(n_v)]).T
    size = np.sqrt(np.mean(tau**2, axis=0))
    noise = rng.standard_normal(tau.shape)
    if condition == "shared":
        noise = np.sqrt(CORRELATION) * rng.standard_normal((len(tau), 1)) + np.sqrt(1.0 - CORRELATION) * noise
    return Recording(t=samples.t, q=samples.q, tau=tau + NOISE * size * noise + outliers(condition, size, tau, rng))


def outliers(condition: str, size: np.ndarray, tau: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """What is added to the torque (n_t, n_v)."""
    added = np.zeros_like(tau)
    if condition == "spikes":
        return 10.0 * size * (rng.random(tau.shape) < SHARE) * rng.choice([-1.0, 1.0], tau.shape)
    if condition == "touches":
        for joint in range(tau.shape[1]):
            for start in rng.integers(0, len(tau) - TOUCH, round(SHARE * len(tau) / TOUCH)):
                added[start : start + TOUCH, joint] = size[joint] * rng.choice([-1.0, 1.0])
    return added


def problem_of(truth: Truth, recording: Recording) -> Problem:
    """The problem of one recording with its rows, which all methods share."""
    layout = truth.model.layout(truth.base.independent)
    pieces = list(filtered_rows(truth.model, layout, recording, PROCESSING))
    rows = Rows(*(np.concatenate(parts, axis=-1) for parts in zip(*pieces, strict=True)))
    return Problem(
        model=truth.model, base=truth.base, recordings=(recording,), processing=PROCESSING,
        evidence=evidence_from_rows(layout, truth.base, [rows]), kept=(rows,),
    )  # fmt: skip


def with_noisy_columns(truth: Truth, problem: Problem, rng: np.random.Generator) -> Problem:
    """The same problem with errors in every row's columns and torque; what is constant stays exact."""
    (piece,) = problem.kept
    layout = truth.model.layout(truth.base.independent)
    exact = np.array([truth.model.parameters[index].symbol == "To" for index in layout.parameters])
    sizes = np.sqrt(np.mean(piece.columns**2, axis=1, keepdims=True)) * ~exact[:, None]
    level = np.sqrt(np.mean(piece.tau**2, axis=1, keepdims=True))
    noisy = piece._replace(
        columns=piece.columns + COLUMNS * sizes * rng.standard_normal(piece.columns.shape),
        tau=piece.tau + COLUMNS * level * rng.standard_normal(piece.tau.shape),
    )
    evidence = evidence_from_rows(layout, truth.base, [noisy])
    return replace(problem, evidence=evidence, kept=(noisy,))


def solved(method: str, problem: Problem) -> tuple[Solution, float]:
    """Solution and its processor time [s]; shapes are given here, so ols and wls need not tell how sure they are."""
    start = time.process_time()
    estimator = estimator_named(method)
    if isinstance(estimator, OrdinaryLeastSquares | WeightedLeastSquares):
        solution = estimator.fit(problem.evidence)
    else:
        solution = estimator.fit_problem(estimator.settled(problem))
    return solution, time.process_time() - start


def torque_error(evidence: Evidence, error: np.ndarray, truth: np.ndarray) -> float:
    parts = list(zip(evidence.supports, evidence.total.factors, strict=True))
    off = sum(float(np.sum((factor[:, :-1] @ error[place]) ** 2)) for place, factor in parts)
    return float(np.sqrt(off / sum(float(np.sum((factor[:, :-1] @ truth[place]) ** 2)) for place, factor in parts)))


@single_threaded
def run(case: tuple[str, int], *, name: str, methods: tuple[str, ...]) -> dict[str, dict[str, Any]]:
    """Errors of every method on one condition and seed."""
    condition, seed = case
    truth, rng = truth_of(name), np.random.default_rng([20261123, seed])
    problem = clean = problem_of(truth, recorded(truth, condition, rng))
    if condition == "columns":
        problem = with_noisy_columns(truth, problem, rng)
    figures = {}
    for method in methods:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", TauhatWarning)
            solution, seconds = solved(method, problem)
        error = solution.values - truth.values
        half = stdtrit(solution.degrees, 0.975) * np.sqrt(np.diag(solution.covariance))
        figures[method] = {
            "torque": torque_error(clean.evidence, error, truth.values), "error": error.tolist(),
            "inside": (np.abs(error) <= half).tolist(), "seconds": seconds, "passes": solution.passes,
        }  # fmt: skip
    return figures


def summary(rows: list[dict[str, Any]]) -> dict[str, float]:
    """Figures of one condition and method over its seeds."""
    errors = np.array([row["error"] for row in rows])
    spread = np.maximum(errors.std(axis=0, ddof=1), np.finfo(float).tiny)
    inside = np.array([row["inside"] for row in rows])
    return {
        "torque": float(np.median([row["torque"] for row in rows])),
        "bias": float(np.sqrt(np.mean((errors.mean(axis=0) / spread) ** 2) * len(rows))),
        "inside": float(inside.mean()),
        "worst": float(inside.mean(axis=0).min()),
        "passes": float(np.median([row["passes"] for row in rows])),
        "milliseconds": 1e3 * float(np.median([row["seconds"] for row in rows])),
    }


def conditions(name: str, chosen: list[str], *, seeds: int, workers: int) -> dict[str, dict[str, dict[str, float]]]:
    """Figures of every condition and member of the family."""
    cases = [(condition, seed) for condition in chosen for seed in range(seeds)]
    with ProcessPoolExecutor(workers) as pool:
        runs = list(pool.map(partial(run, name=name, methods=METHODS), cases))
    return {
        condition: {
            method: summary([one[method] for case, one in zip(cases, runs, strict=True) if case[0] == condition])
            for method in METHODS
        }
        for condition in chosen
    }


def show_conditions(table: dict[str, dict[str, dict[str, float]]]) -> None:
    print(
        f"{'condition':10} {'estimator':14} {'torque %':>9} {'bias':>6} {'inside %':>9} {'worst %':>8} {'passes':>7} {'CPU ms':>7}"
    )
    for condition, rows in table.items():
        for method, row in rows.items():
            print(
                f"{condition:10} {method:14} {100 * row['torque']:9.3f} {row['bias']:6.2f} {100 * row['inside']:9.1f} "
                f"{100 * row['worst']:8.0f} {row['passes']:7.0f} {row['milliseconds']:7.1f}"
            )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", nargs="+", default=list(PARTS), choices=PARTS)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--quick", action="store_true", help="4 seeds; the plant is the two-link arm")
    parser.add_argument("--seeds", type=int, default=24)
    parser.add_argument("--robot", default="ur5e")
    parser.add_argument("--conditions", nargs="*", default=list(CONDITIONS), choices=CONDITIONS)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    seeds = 4 if options.quick else options.seeds
    plant = "two_link" if options.quick else options.robot
    found: dict[str, Any] = {"robot": options.robot, "seeds": seeds}
    if "conditions" in options.parts:
        found["conditions"] = conditions(options.robot, options.conditions, seeds=seeds, workers=options.workers)
    if "plant" in options.parts:
        found["plant"] = on_the_plant(plant, seeds=seeds, workers=options.workers)
    if "cost" in options.parts:
        found["cost"] = costs(plant)
    if options.json:
        print(json.dumps(found))
        return
    print(f"{options.robot}, {seeds} seeds")
    for part, show in (("conditions", show_conditions), ("plant", show_plant), ("cost", show_costs)):
        if part in found:
            show(found[part])


if __name__ == "__main__":
    main()
