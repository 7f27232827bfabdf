"""Estimators that simulate: bias and coverage under position noise and wrong filters, cost, and measured logs.

    python benchmarks/simulation_estimators.py [--seeds 20] [--quick] [--json] [--parts bias cost real] [--data FOLDER]

bias: every seed is a true robot, a motion and noise of its own, run by the MuJoCo plant at 0.1 ms under a PD law with
gravity feedforward sampled at 2 kHz, logged at 500 Hz; the estimators simulate with the library's own leapfrog at 0.5 ms.
Torque noise 2 % of each joint's RMS. `known` have law, gains and reference of the robot, `measured` nothing: a tuned law
and the measured motion. Errors are in standard deviations a parameter would have if its torque were 1 % of its joint's, so
that a parameter that hardly matters does not hide the others: bias is the mean over the seeds, spread the deviation.
cost: one log of a 6-joint arm, 20 s at 1 kHz; time and peak of memory of a fit, its passes and simulations.
real: EMPS with its published law, UR10e with the measured motion, each judged on another run.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import time
import tomllib
import tracemalloc
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tauhat.blas import single_threaded
from tauhat.control import PD
from tauhat.dynamics import Coulomb, TorqueModel, base_parameters, torque_model
from tauhat.errors import TauhatError, TauhatWarning
from tauhat.estimation import (
    ClosedLoop,
    ClosedLoopInputError,
    ClosedLoopOutputError,
    DirectInverse,
    Estimate,
    Estimator,
    InstrumentalVariables,
    OrdinaryLeastSquares,
    PhysicalConstraints,
    SampledReference,
    WeightedLeastSquares,
    collect_all,
    identify,
)
from tauhat.estimation.problem import Problem
from tauhat.excitation import random_fourier
from tauhat.recordings import Processing, Recording, read_recording
from tauhat.robots import Robot, load_robot
from tauhat.simulation import ExperimentSettings, SensorErrors, perturbed, simulate
from tauhat.simulation.gains import tracking_gains
from tauhat.simulation.laws import SmoothCoulomb
from tauhat.verification import standard_parameters, verify

EXAMPLES = Path(__file__).parent.parent / "examples" / "real"
CONTROL_RATE, BANDWIDTH, SECONDS = 2000.0, 15.0, 10.0
WIDTH = 0.02  # of the smooth sign of friction, in parts of the speed limit
SMALL = 0.01  # of the joint's torque: a parameter is known to one unit when its torque is known to that
FILTERS = {
    "suitable": (1e-4, Processing(cutoff=10.0, motion_cutoff=30.0)),
    "late: 100 Hz": (1e-4, Processing(cutoff=40.0, motion_cutoff=100.0)),
    "early: 1 Hz": (0.0, Processing(cutoff=20.0, motion_cutoff=1.0)),
}


def methods(loop: ClosedLoop, *, slow: bool) -> dict[str, Estimator]:
    found: dict[str, Estimator] = {
        "ols": OrdinaryLeastSquares(),
        "idim-iv known": InstrumentalVariables(loop=loop),
        "idim-iv measured": InstrumentalVariables(),
        "didim known": DirectInverse(loop=loop),
        "didim measured": DirectInverse(),
    }
    if slow:
        found |= {"clie known": ClosedLoopInputError(loop=loop), "cloe known": ClosedLoopOutputError(loop=loop)}
    return found


def smooth_truth(robot: Robot, rng: np.random.Generator) -> tuple[Any, TorqueModel]:
    """A true robot with smooth Coulomb friction and the model whose shape is right: what is judged is bias alone."""
    speeds = np.where(np.isfinite(robot.velocity_limit), robot.velocity_limit, 1.0)
    plain = perturbed(robot, rng)
    friction = SmoothCoulomb(torque=plain.coulomb, width=WIDTH * speeds)
    truth = replace(plain, coulomb=np.zeros(robot.n_v), laws=(friction,))
    return truth, torque_model(robot).with_term(Coulomb(widths=tuple((WIDTH * speeds).tolist())))


def noisy(recording: Recording, deviation: float, rng: np.random.Generator) -> Recording:
    return replace(recording, q=recording.q + deviation * rng.standard_normal(recording.q.shape))


def logged(
    robot: Robot, truth: Any, rng: np.random.Generator, *, rate: float, seconds: float = SECONDS
) -> tuple[Recording, ClosedLoop]:
    motion = random_fourier(robot, period=seconds, harmonics=5, rng=rng)
    law = tracking_gains(
        robot, motion.sample(np.arange(0.0, seconds, 0.05)).q, bandwidth=BANDWIDTH, control_rate=CONTROL_RATE
    )
    settings = ExperimentSettings(
        timestep=1e-4, control_rate=CONTROL_RATE, sample_rate=rate, controller=law,
        sensors=SensorErrors(relative_torque_noise=0.02),
    )  # fmt: skip
    recording = simulate(robot, motion, rng=rng, parameters=truth, settings=settings).recording
    return recording, ClosedLoop(law=law, references=(motion,), control_rate=CONTROL_RATE, longest_step=5e-4)


def units(problem: Problem) -> np.ndarray:
    """Per base parameter the change that alters the torque of the joint it matters most to by `SMALL` of its RMS."""
    evidence, share = problem.evidence, np.zeros(problem.base.n_b)
    for support, factor in zip(evidence.supports, evidence.total.factors, strict=True):
        size = np.linalg.norm(factor, axis=0)
        share[support] = np.maximum(share[support], size[:-1] / size[-1])
    return SMALL / share


def bias(name: str, seeds: int, *, slow: bool) -> list[dict[str, Any]]:
    robot = load_robot(name)
    collected: dict[tuple[str, str], dict[str, list[Any]]] = {}
    for seed in range(seeds):
        rng = np.random.default_rng([20261123, seed])
        truth, model = smooth_truth(robot, rng)
        clean, loop = logged(robot, truth, rng, rate=500.0)
        base = base_parameters(model)
        true = base.projection @ standard_parameters(model, truth)
        unit = units(problem_of(model, base, clean, FILTERS["suitable"][1]))
        for label, (deviation, processing) in FILTERS.items():
            problem = problem_of(model, base, noisy(clean, deviation, rng), processing)
            for method_name, method in methods(loop, slow=slow).items():
                into = collected.setdefault(
                    (label, method_name), {"errors": [], "inside": [], "passes": [], "failed": []}
                )
                try:
                    solution = single_threaded(method.fit_problem)(problem)
                except TauhatError as error:
                    into["failed"].append(str(error))
                    continue
                half = half_interval(solution)
                into["errors"].append((solution.values - true) / unit)
                into["inside"].append(np.abs(solution.values - true) <= half)
                into["passes"].append(solution.passes)
    return [
        bias_row({"robot": name, "filters": label, "method": method, "seeds": seeds}, into)
        for (label, method), into in collected.items()
    ]


def problem_of(model: TorqueModel, base: Any, recording: Recording, processing: Processing) -> Problem:
    evidence = collect_all(model, base, [recording], processing)
    return Problem(model=model, base=base, recordings=(recording,), processing=processing, evidence=evidence)


def half_interval(solution: Any) -> np.ndarray:
    from scipy.special import stdtrit

    return float(stdtrit(solution.degrees, 0.975)) * np.sqrt(np.diag(solution.covariance))


def bias_row(head: dict[str, Any], into: dict[str, list[Any]]) -> dict[str, Any]:
    row = head | {"failed": len(into["failed"])}
    if not into["errors"]:
        return row
    errors = np.array(into["errors"])
    mean, spread = errors.mean(axis=0), errors.std(axis=0, ddof=1) if len(errors) > 1 else np.zeros(errors.shape[1])
    return row | {
        "bias_rms": float(np.sqrt(np.mean(mean**2))),
        "bias_worst": float(np.abs(mean).max()),
        "spread_rms": float(np.sqrt(np.mean(spread**2))),
        "coverage": float(np.mean(into["inside"])),
        "passes": float(np.mean(into["passes"])),
    }


def cost(name: str = "ur5e", seconds: float = 20.0) -> list[dict[str, Any]]:
    """Time and memory of the fits of one log; the second of two fits, so that compiled code is in memory."""
    robot, rng = load_robot(name), np.random.default_rng(5)
    truth, model = smooth_truth(robot, rng)
    recording, loop = logged(robot, truth, rng, rate=1000.0, seconds=seconds)
    processing = Processing(cutoff=10.0, motion_cutoff=40.0)
    base = base_parameters(model)
    problem = problem_of(model, base, noisy(recording, 2e-5, rng), processing)
    plain = replace(loop, control_rate=None, longest_step=1e-3)
    rows = []
    for label, method in methods(plain, slow=True).items():
        warm = problem_of(model, base, problem.recordings[0].rows(0, 3000), processing)
        with contextlib.suppress(TauhatError):
            method.fit_problem(warm)
        start = time.perf_counter()
        solution = method.fit_problem(problem)
        passed = time.perf_counter() - start
        tracemalloc.start()
        method.fit_problem(problem)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        a_pass = {"ols": 0, "clie known": base.n_b + 1, "cloe known": base.n_b + 1}.get(label, 1)
        rows.append(
            {
                "robot": name, "method": label, "samples": recording.n_t, "n_b": base.n_b, "seconds": passed,
                "passes": solution.passes, "simulations": (solution.passes * a_pass + 1) if a_pass else 0,
                "peak_mb": peak / 2**20, "cause": solution.cause,
            }
        )  # fmt: skip
    start = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)
        identify(model, problem.recordings, estimator=DirectInverse(loop=plain))
    rows.append({"robot": name, "method": "identify(estimator=didim), filters chosen", "samples": recording.n_t,
                 "n_b": base.n_b, "seconds": time.perf_counter() - start})  # fmt: skip
    return rows


def emps_loop(data: Path) -> ClosedLoop:
    """The published controller of EMPS: position loop kp, speed loop kv without speed reference, 10 V at most."""
    from scipy.io import loadmat

    log = loadmat(data / "emps" / "DATA_EMPS.mat")
    t, wanted = log["t"].ravel(), log["qg"].reshape(-1, 1)
    kp, kv, gain = 160.18, 243.45, 35.15
    law = PD(kp=[kp * kv * gain], kd=[kv * gain], torque_limit=[10.0 * gain])
    still = np.zeros_like(wanted)
    return ClosedLoop(law=law, references=(SampledReference(t=t, q=wanted, dq=still, ddq=still),))


def real(data: Path) -> list[dict[str, Any]]:
    cases = tomllib.loads((EXAMPLES / "cases.toml").read_text(encoding="utf-8"))["case"]
    rows = []
    for case in cases:
        if case["name"] not in {"emps -> pulses", "ur10e 30 s -> 40 s"}:
            continue
        source = EXAMPLES / case["robot"] if (EXAMPLES / case["robot"]).exists() else data / case["robot"]
        fit, judge = (read_all(case[key], data, case["map"]) for key in ("fit", "judge"))
        robot = load_robot(str(source))
        loops = {"measured": ClosedLoop()} | ({"known": emps_loop(data)} if "emps" in case["name"] else {})
        found: dict[str, tuple[Estimator, PhysicalConstraints | None]] = {
            "ols": (OrdinaryLeastSquares(), None), "wls": (WeightedLeastSquares(), None),
        }  # fmt: skip
        for loop_name, loop in loops.items():
            found |= {
                f"idim-iv {loop_name}": (InstrumentalVariables(loop=loop), None),
                f"idim-iv {loop_name}, physical": (InstrumentalVariables(loop=loop), PhysicalConstraints()),
                f"didim {loop_name}": (DirectInverse(loop=loop), None),
                f"didim {loop_name}, physical": (DirectInverse(loop=loop), PhysicalConstraints()),
                f"clie {loop_name}": (ClosedLoopInputError(loop=loop), None),
            }
            if loop.known:
                found[f"cloe {loop_name}"] = (ClosedLoopOutputError(loop=loop), None)
        model = torque_model(robot)
        rows += [real_row(case, model, (fit, judge), label, *chosen) for label, chosen in found.items()]
    return rows


def read_all(logs: list[dict[str, str]], data: Path, map_name: str) -> list[Recording]:
    windows = [tuple(int(edge) for edge in log["rows"].split(":")) if "rows" in log else None for log in logs]
    return [
        read_recording(data / log["log"], map=EXAMPLES / map_name, rows=rows)
        for log, rows in zip(logs, windows, strict=True)
    ]


def real_row(
    case: dict[str, Any],
    model: TorqueModel,
    logs: tuple[list[Recording], list[Recording]],
    label: str,
    *chosen: Any,
) -> dict[str, Any]:
    start = time.perf_counter()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", TauhatWarning)
            estimate: Estimate = identify(
                model, logs[0], estimator=chosen[0], cutoff=case["cutoff"], constraints=chosen[1]
            )  # fmt: skip
            unseen = verify(estimate, logs[1]).logs[0].relative_rms
    except TauhatError as error:
        return {"case": case["name"], "method": label, "error": str(error)}
    values = {row.name: row.value for row in estimate.summary()} if model.robot.n_v == 1 else {}
    return {
        "case": case["name"], "method": label, "fit": estimate.relative_rms, "unseen": unseen,
        "seconds": time.perf_counter() - start, "values": values,
    }  # fmt: skip


def show(title: str, rows: list[dict[str, Any]]) -> None:
    print(f"\n{title}")
    for row in rows:
        cells = [f"{value:.4g}" if isinstance(value, float) else str(value) for value in row.values()]
        print("  " + "  ".join(cells))


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--parts", nargs="+", default=["bias", "cost", "real"], choices=["bias", "cost", "real"])
    beside = Path(__file__).parent.parent.parent / "shared" / "data"
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("TAUHAT_REAL_DATA", beside)))
    options = parser.parse_args()
    seeds = 3 if options.quick else options.seeds
    found: dict[str, list[dict[str, Any]]] = {}
    if "bias" in options.parts:
        found["bias two_link"] = bias("two_link", seeds, slow=True)
        found["bias ur5e"] = bias("ur5e", 2 if options.quick else max(2, seeds // 4), slow=False)
    if "cost" in options.parts:
        found["cost"] = cost()
    if "real" in options.parts and options.data.is_dir():
        found["real"] = real(options.data)
    if options.json:
        print(json.dumps(found))
        return
    for title, rows in found.items():
        show(title, rows)


if __name__ == "__main__":
    main()
