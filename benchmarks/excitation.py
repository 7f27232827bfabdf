"""Designed motions: cost of a gradient, what is reached in which time, beside other methods in the same run.

    python benchmarks/excitation.py [--json] [--quick] [--descriptions FOLDER]

UR10-class, Panda and TX40-class arm, 5 harmonics in 10 s, joint limits of the arms with three times the speed limit per
second as acceleration, no margin, all columns. Condition numbers are of columns scaled by constants, with the exact sign
on 2000 samples. One thread.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from excitation_peers import PinocchioRegressor, cma_es, finite_difference_slsqp, genetic, gradient, seconds_to
from threadpoolctl import threadpool_limits

from tauhat.arrays import FloatArray
from tauhat.dynamics import Coulomb, Motion, random_motion, torque_model
from tauhat.excitation import (
    ConditionNumber,
    Criterion,
    DOptimal,
    FourierSpace,
    Information,
    Mixed,
    information,
    motion_limits,
    random_points,
)
from tauhat.excitation.gradient import Objective, polish
from tauhat.robots import Robot, load_robot

DESCRIPTIONS = Path(__file__).parent.parent.parent / "shared" / "data"
FINGERS = {"panda_finger_joint1": 0.0, "panda_finger_joint2": 0.0}
OTHERS = {"genetic": genetic, "cma_es": cma_es, "slsqp_finite_differences": finite_difference_slsqp}
TARGET = 1.25  # times the best known condition


@dataclass(frozen=True, kw_only=True)
class Arm:
    """An arm and the aims for its class."""

    name: str
    robot: Robot
    gradient_ms: float
    single: float
    best: float
    log_det: float


@dataclass(frozen=True, kw_only=True)
class Problem:
    """What is designed for: smooth while searching, exact when judged."""

    space: FourierSpace
    smooth: Information
    exact: Information

    def judged(self, x: FloatArray) -> tuple[float, float]:
        """Condition number and log det."""
        spectrum = np.linalg.eigvalsh(self.exact.matrix(self.space.grid(2000).motion(x)))
        return float(np.sqrt(spectrum[-1] / spectrum[0])), float(np.log(spectrum).sum())


def arms(folder: Path) -> list[Arm]:
    aims = {
        "ur10e": {"gradient_ms": 3.0, "single": 5.8, "best": 5.2, "log_det": 108.0},
        "panda": {"gradient_ms": 4.5, "single": 6.7, "best": 6.2, "log_det": 120.0},
        "staubli_tx40": {"gradient_ms": 3.0, "single": 4.7, "best": 4.1, "log_det": 104.0},
    }
    files = {"panda": folder / "panda/panda.urdf", "staubli_tx40": folder / "tx40/tx40_mdh_modified.urdf"}
    made = [Arm(name=name, robot=with_accelerations(load_robot(name)), **aim) for name, aim in aims.items()]
    for name, path in files.items():
        if path.exists():
            robot = load_robot(path, locked=FINGERS if name == "panda" else None)
            made.append(Arm(name=f"{name} (URDF)", robot=with_accelerations(robot), **aims[name]))
    return made


def with_accelerations(robot: Robot) -> Robot:
    limits = [replace(joint.limits, acceleration=3.0 * joint.limits.velocity) for joint in robot.joints]
    return replace(
        robot, joints=tuple(replace(joint, limits=limit) for joint, limit in zip(robot.joints, limits, strict=True))
    )


def problem(robot: Robot, *, period: float = 10.0, terms: str | None = None, raw: bool = False) -> Problem:
    """The columns of the terms (all by default), scaled by constants or, as some peers have it, not at all."""
    limits = motion_limits(robot)
    model = torque_model(robot, terms) if terms else torque_model(robot)
    exact = information(model)
    if raw:
        exact = replace(exact, scales=np.ones(exact.n))
    widths = Coulomb(widths=tuple((0.02 * limits.velocity).tolist()))
    smooth = exact if terms else replace(exact, model=model.with_term(widths))
    return Problem(space=FourierSpace(limits=limits, period=period, harmonics=5), smooth=smooth, exact=exact)


def best_ms(action: Callable[[], object], repeats: int = 60) -> float:
    action()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        action()
        times.append(time.perf_counter() - start)
    return 1e3 * min(times)


def cost(arm: Arm) -> dict[str, float]:
    """Milliseconds of one evaluation at 500 samples, with and without gradient, and of the peers' evaluation."""
    case, criterion = problem(arm.robot), Mixed()
    grid = case.space.grid(500)
    x = random_points(case.space, 1, np.random.default_rng(0))[0]
    objective = Objective(information=case.smooth, grid=grid)
    loop = PinocchioRegressor(case.smooth, case.space)
    ours = np.linalg.cond(case.smooth.matrix(grid.motion(x))) ** 0.5
    return {
        "objective_ms": best_ms(lambda: criterion.evaluate(case.smooth.matrix(grid.motion(x)))),
        "gradient_ms": best_ms(lambda: objective.at(x, criterion)),
        "pinocchio_ms": best_ms(lambda: loop.condition(x), repeats=5),
        "pinocchio_difference": abs(float(loop.condition(x) / ours) - 1.0),
        "adjoint_error": adjoint_error(arm.robot),
        "columns": case.smooth.n,
    }


def adjoint_error(robot: Robot) -> float:
    """Largest difference between adjoint and sixth-order finite differences, relative to the largest derivative."""
    model = torque_model(robot, "inertia,rotor,viscous,offset")
    facts, rng = information(model), np.random.default_rng(1)
    motion = random_motion(robot, 200, rng)
    parts = {"q": motion.q, "dq": motion.dq, "ddq": motion.ddq}
    bars = rng.normal(size=model.columns(motion, facts.layout)[0].shape)
    found = model.pull(motion, facts.layout, bars)
    worst = 0.0
    for name in parts:
        derivative = getattr(found, name)
        for joint in range(robot.n_v):
            total = np.zeros(200)
            for weight, steps in ((45.0, 1), (-9.0, 2), (1.0, 3)):
                for sign in (1.0, -1.0):
                    moved = {key: part.copy() for key, part in parts.items()}
                    moved[name][joint] += sign * steps * 4e-3
                    total += sign * weight * (bars * model.columns(Motion(**moved), facts.layout)[0]).sum(axis=0)
            worst = max(
                worst, float(np.abs(total / (60.0 * 4e-3) - derivative[joint]).max() / np.abs(derivative).max())
            )
    return worst


def designs(arm: Arm, criterion: Criterion, starts: int) -> dict[str, Any]:
    """Five single random starts of the gradient design."""
    case, seconds, found = problem(arm.robot), [], []
    for start in random_points(case.space, starts, np.random.default_rng(0)):
        began = time.perf_counter()
        found.append(polish(case.smooth, case.space, start, criterion=criterion)[0])
        seconds.append(time.perf_counter() - began)
    judged = [case.judged(x) for x in found]
    return {
        "conditions": [condition for condition, _ in judged], "log_dets": [volume for _, volume in judged],
        "seconds": seconds, **excess(case, found),
    }  # fmt: skip


def excess(case: Problem, points: list[FloatArray]) -> dict[str, float]:
    """Largest relative excess over a limit on 20 000 samples, and largest speed and acceleration at the ends."""
    limits, over, rest = case.space.limits, 0.0, 0.0
    for x in points:
        samples = case.space.series(x).sample(np.linspace(0.0, case.space.period, 20_001))
        used = [
            np.abs(samples.q - case.space.middle) / case.space.reach, np.abs(samples.dq) / limits.velocity,
            np.abs(samples.ddq) / limits.acceleration,
        ]  # fmt: skip
        over = max(over, *(float(part.max()) - 1.0 for part in used))
        rest = max(rest, *(float(np.abs(part[[0, -1]]).max()) for part in (samples.dq, samples.ddq)))
    return {"excess": over, "rest": rest}


def independent(arm: Arm) -> dict[str, float]:
    """What 10 000 independent random states are worth."""
    motion = random_motion(arm.robot, 10_000, np.random.default_rng(2))
    spectrum = np.linalg.eigvalsh(problem(arm.robot).exact.matrix(motion))
    return {
        "condition": float(np.sqrt(spectrum[-1] / spectrum[0])), "log_det": float(np.log(spectrum).sum()),
    }  # fmt: skip


def race(arm: Arm, best_known: float, *, budget: float, seeds: int) -> dict[str, Any]:
    """Median time to reach 1.25 x the best known condition, of each method."""
    case, target = problem(arm.robot), TARGET * best_known
    rows: dict[str, Any] = {"target": target}
    for name, method in {"gradient": gradient, **OTHERS}.items():
        traces = [method(case.smooth, case.space, seed, budget) for seed in range(seeds)]
        times = [seconds_to(trace, target) for trace in traces]
        best = [min((value for _, value in trace), default=np.inf) for trace in traces]
        rows[name] = {"seconds_to_target": float(np.median(times)), "best": float(min(best))}
    for name in OTHERS:
        beaten = min(rows[name]["seconds_to_target"], budget) / rows["gradient"]["seconds_to_target"]
        rows[name]["times_slower_at_least"] = beaten
    return rows


def peer_cases(starts: int) -> list[dict[str, Any]]:
    """The cases of public tools in their own columns: no scaling, condition number as it stands."""
    cases = (
        ("UR10, 14 s, 36 inertial", "ur10e", 14.0, "inertia", "figaroh: 34.5 after 85 s; independent states 33.0"),
        ("7 joints, 10 s, inertial", "panda", 10.0, "inertia", "robot-sysid-pipeline: 80 after 32 s"),
        ("7 joints, 10 s, all columns", "panda", 10.0, None, "FloBaRoID (37 s): 245 after 118 s, 153 after 285 s"),
    )
    rows = []
    for name, robot_name, period, terms, peer in cases:
        robot = load_robot(robot_name)
        case = problem(robot, period=period, terms=terms, raw=True)
        began = time.perf_counter()
        points = random_points(case.space, starts, np.random.default_rng(3))
        found = [case.judged(polish(case.smooth, case.space, x, criterion=ConditionNumber())[0])[0] for x in points]
        states = np.linalg.cond(case.exact.matrix(random_motion(robot, 10_000, np.random.default_rng(4)))) ** 0.5
        rows.append(
            {
                "case": name, "columns": case.exact.n, "conditions": found, "independent": float(states),
                "seconds_each": (time.perf_counter() - began) / starts, "peer": peer,
            }
        )  # fmt: skip
    return rows


def measure(arm: Arm, *, quick: bool) -> dict[str, Any]:
    starts = 5
    rows: dict[str, Any] = {"arm": arm.name, "cost": cost(arm), "independent": independent(arm)}
    for criterion in (ConditionNumber(), Mixed(), DOptimal()):
        rows[criterion.key] = designs(arm, criterion, starts)
    if "URDF" not in arm.name:
        best = min(rows["condition"]["conditions"])
        rows["race"] = race(arm, best, budget=10.0 if quick else 40.0, seeds=1 if quick else 3)
    rows["aims"] = judged_aims(arm, rows)
    return rows


def judged_aims(arm: Arm, rows: dict[str, Any]) -> list[tuple[str, float, str, float]]:
    """Name, value, relation and aim of everything that was promised."""
    condition, volume, costs = rows["condition"], rows["d"], rows["cost"]
    aims = [
        ("objective + gradient, 500 samples [ms]", costs["gradient_ms"], "<=", arm.gradient_ms),
        ("adjoint against finite differences", costs["adjoint_error"], "<=", 1e-10),
        ("condition, worst single start", max(condition["conditions"]), "<=", arm.single),
        ("longest single start [s]", max(condition["seconds"]), "<=", 5.0),
        ("condition, best of five", min(condition["conditions"]), "<=", arm.best),
        ("five starts [s]", sum(condition["seconds"]), "<=", 20.0),
        ("over 10 000 independent states", min(condition["conditions"]) / rows["independent"]["condition"], "<=", 1.2),
        ("D-optimal log det, best of five", max(volume["log_dets"]), ">=", arm.log_det),
        ("D-optimal log det, median start", float(np.median(volume["log_dets"])), ">=", arm.log_det),
        ("excess over limits", max(condition["excess"], volume["excess"], rows["mixed"]["excess"]), "<=", 1e-12),
        ("speed, acceleration at the ends", max(condition["rest"], volume["rest"], rows["mixed"]["rest"]), "<=", 1e-12),
    ]
    race_rows = rows.get("race", {})
    slower = {name: race_rows[name]["times_slower_at_least"] for name in OTHERS if name in race_rows}
    return aims + [(f"{name}: times slower", times, ">=", 10.0) for name, times in slower.items()]


def met(value: float, relation: str, aim: float) -> bool:
    return value <= aim if relation == "<=" else value >= aim


def show(row: dict[str, Any]) -> None:
    costs, states = row["cost"], row["independent"]
    print(f"\n{row['arm']}: {costs['columns']} columns")
    print(
        f"  500 samples: objective {costs['objective_ms']:.2f} ms, with gradient {costs['gradient_ms']:.2f} ms, "
        f"Pinocchio loop + SVD {costs['pinocchio_ms']:.1f} ms (same condition to {costs['pinocchio_difference']:.0e})"
    )
    print(f"  10 000 independent states: condition {states['condition']:.2f}, log det {states['log_det']:.0f}")
    for key in ("condition", "mixed", "d"):
        part = row[key]
        conditions, volumes = sorted(part["conditions"]), sorted(part["log_dets"])
        print(
            f"  {key:9} condition {' '.join(f'{c:.2f}' for c in conditions)}   log det "
            f"{' '.join(f'{v:.0f}' for v in volumes)}   {np.mean(part['seconds']):.1f} s a start"
        )
    for name, part in row.get("race", {}).items():
        if name != "target":
            print(
                f"  {name:25} {part['seconds_to_target']:7.2f} s to {row['race']['target']:.2f}, best {part['best']:.2f}"
            )
    for name, value, relation, aim in row["aims"]:
        verdict = "met" if met(value, relation, aim) else "NOT MET"
        print(f"    {name:42} {value:10.3g} {relation} {aim:<8.3g} {verdict}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--quick", action="store_true", help="one seed and ten seconds for the other methods")
    parser.add_argument("--descriptions", type=Path, default=DESCRIPTIONS, help="folder with further URDFs")
    options = parser.parse_args()
    chosen = [arm for arm in arms(options.descriptions) if not options.quick or "URDF" not in arm.name]
    rows = []
    with threadpool_limits(1):
        for arm in chosen:
            rows.append(measure(arm, quick=options.quick))
            if not options.json:
                show(rows[-1])
        peers = peer_cases(2 if options.quick else 5)
    if options.json:
        print(json.dumps({"arms": rows, "peer_cases": peers}))
        return
    print("\nthe peers' cases, unscaled columns")
    for row in peers:
        found = " ".join(f"{value:.1f}" for value in sorted(row["conditions"]))
        print(
            f"  {row['case']:28} {row['columns']} columns: {found} in {row['seconds_each']:.1f} s each; independent states "
            f"{row['independent']:.1f}; {row['peer']}"
        )


if __name__ == "__main__":
    main()
