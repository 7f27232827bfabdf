"""Time of a physically consistent fit after the evidence exists, beside the same problem built with CVXPY.

    python benchmarks/consistency.py [--json] [--quick] [--robots ur10e panda]

Aim: at most 20 ms at 7 joints, building and solving. The evidence is that of noisy torque on random states; both solve
the same problem (pseudo-inertias with a margin, friction and rotor inertia not negative, Gaussian pull, same objective)
with Clarabel, and the objectives found are compared. The peer needs `pip install cvxpy`, and is left out without it.
One thread.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import time
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import numpy as np

from tauhat.dynamics import TorqueModel, base_parameters, torque_model
from tauhat.dynamics.base import BaseParameters, random_motion
from tauhat.estimation import (
    EntropicPull,
    Evidence,
    GaussianPull,
    PhysicalConstraints,
    WeightedLeastSquares,
    consistent,
)
from tauhat.estimation.block import Block
from tauhat.estimation.consistency_problem import ConsistencyProblem, consistency_problem
from tauhat.estimation.physical import solve_consistency
from tauhat.estimation.pseudo_inertia import BASIS, SIZE
from tauhat.robots import load_robot

NOISE = 0.3  # of each joint's torque: enough for the free fit to be unphysical
STATES = 1000


def evidence_of(model: TorqueModel, base: BaseParameters) -> Evidence:
    """Evidence of the nominal robot with friction, and noise."""
    robot, rng = model.robot, np.random.default_rng(0)
    ones = np.ones(robot.n_v)
    truth = np.concatenate([robot.inertia.ravel(), 0.1 * ones, 3.0 * ones, 5.0 * ones, 0.2 * ones])
    layout = model.layout(base.independent)
    columns, _ = model.columns(random_motion(robot, STATES, rng), layout)
    place = np.full(model.n_p, -1)
    place[base.independent] = np.arange(base.n_b)
    factors, supports = [], []
    for joint in range(robot.n_v):
        part = layout.of_joint(joint)
        support = place[layout.parameters[part]]
        torque = columns[part].T @ (base.projection @ truth)[support]
        torque = torque + NOISE * torque.std() * rng.normal(size=STATES)
        factors.append(np.column_stack([columns[part].T, torque]))
        supports.append(support)
    block = Block(factors=tuple(factors), n_t=STATES).reduced()
    return Evidence(supports=tuple(supports), n_b=base.n_b, blocks=(block,))


def through_cvxpy(problem: ConsistencyProblem) -> float:
    """Build and solve the same problem as users of CVXPY do; return the objective."""
    import cvxpy

    place = problem.coordinates
    x = cvxpy.Variable(place.n_u)  # whole standard parameters
    u = np.linalg.solve(place.matrix, np.eye(place.n_u)) @ x
    constraints = [row.matrix @ u + row.offset >= 0 for row in problem.rows if row.cone == "nonnegative"]
    for link in range(place.n_links):
        body = x[SIZE * link : SIZE * link + SIZE]
        pseudo = sum(body[k] * BASIS[k] for k in range(SIZE))
        constraints.append(pseudo - problem.margin * cvxpy.trace(pseudo) * np.eye(4) >> 0)
    misfit = 0.5 * cvxpy.sum_squares(problem.fit[:, :-1] @ u - problem.fit[:, -1])
    pull = 0.5 * cvxpy.sum_squares(cvxpy.multiply(np.sqrt(problem.precision), u - place.nominal))
    task = cvxpy.Problem(cvxpy.Minimize(misfit + pull), constraints)
    return float(task.solve(solver=cvxpy.CLARABEL))


def timed(action: Callable[[], Any], repeats: int) -> dict[str, float]:
    action()
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        action()
        seconds.append(time.perf_counter() - start)
    return {"median_ms": 1e3 * statistics.median(seconds), "least_ms": 1e3 * min(seconds)}


def run(name: str, repeats: int) -> dict[str, Any]:
    model = torque_model(load_robot(name))
    base = base_parameters(model)
    evidence = evidence_of(model, base)
    weights = WeightedLeastSquares().solve(evidence).weights
    problems = {
        pull.key: consistency_problem(
            evidence, model, base, weights=weights, constraints=PhysicalConstraints(pull=pull)
        )
        for pull in (GaussianPull(), EntropicPull())
    }
    names = model.robot.joint_names
    row: dict[str, Any] = {"robot": name, "joints": model.robot.n_v, "parameters": model.n_p, "base": base.n_b}
    for key, problem in problems.items():
        constraints = PhysicalConstraints(pull=problem.pull)
        row[key] = timed(
            lambda c=constraints: consistent(evidence, model, base, weights=weights, constraints=c), repeats
        )
        proof = solve_consistency(problem, names=names).certificate
        row[key] |= {"objective": proof.primal, "gap": proof.gap, "iterations": proof.iterations}
    if find_spec("cvxpy"):
        row["cvxpy"] = timed(lambda: through_cvxpy(problems["gaussian"]), max(2, repeats // 5))
        row["cvxpy"]["objective"] = through_cvxpy(problems["gaussian"])
    return row


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--quick", action="store_true", help="few repetitions")
    parser.add_argument("--robots", nargs="+", default=["ur10e", "panda"])
    options = parser.parse_args()
    rows = [run(name, 5 if options.quick else 40) for name in options.robots]
    if options.json:
        print(json.dumps(rows))
        return
    print(
        f"{'robot':8} {'n_p':>4} {'n_b':>4}  {'':9} {'median ms':>10} {'least ms':>9} {'objective':>12} {'proven gap':>11}"
    )
    for row in rows:
        for key in ("gaussian", "entropic", "cvxpy"):
            if key in row:
                part = row[key]
                gap = f"{part['gap']:11.1e}" if "gap" in part else ""
                print(
                    f"{row['robot']:8} {row['parameters']:4d} {row['base']:4d}  {key:9} {part['median_ms']:10.1f} "
                    f"{part['least_ms']:9.1f} {part['objective']:12.6f} {gap}"
                )
    print("aim: 20 ms at 7 joints" + ("" if find_spec("cvxpy") else "; the peer is not installed: pip install cvxpy"))


if __name__ == "__main__":
    main()
