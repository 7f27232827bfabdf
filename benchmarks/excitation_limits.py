"""What further limits cost and lose: the same arms free, and with self-collision, torque and a table.

    python benchmarks/excitation_limits.py [--json] [--quick] [--seeds N]

Each row is one design by the gradient method: joint limits with three times the speed limit per second as acceleration,
10 s, 5 harmonics, condition criterion, all columns, no margin, one start; with `all`, 80 % of the joints' torque,
self-collision with 2 cm of clearance, and the floor. Excess is the largest violation, in parts of each limit, on a grid
of 20 000 samples. One thread.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from excitation import with_accelerations
from tauhat.errors import ExcitationError
from tauhat.excitation import ConditionNumber, DesignSettings, LimitSet, design, parse_limits
from tauhat.robots import Robot, load_robot

ARMS = ("ur10e", "panda", "staubli_tx40")
LIMITS = {
    "none": "",
    "torque": "[torque]\nfraction = 0.8\n",
    "self-collision": "[collision]\nclearance = 0.02\n",
    "table": "[collision]\nself = false\nclearance = 0.02\n[[planes]]\nname = 'table'\nnormal = [0, 0, 1]\noffset = 0.0\n",
    "all": "[torque]\nfraction = 0.8\n[collision]\nclearance = 0.02\n"
    "[[planes]]\nname = 'table'\nnormal = [0, 0, 1]\noffset = 0.0\n",
}
FINE = 20_000


def excess(found: Any, limits: LimitSet) -> float:
    """Largest violation of the further limits on the fine grid; 0 when all hold."""
    if not limits.others:
        return 0.0
    rate = FINE / found.trajectory.duration
    recording = found.recording(rate=rate)
    from tauhat.dynamics import motion_from_rows

    motion = motion_from_rows(recording.q, recording.dq, recording.ddq)
    return max(0.0, *(-float(limit.margins(motion).min()) for limit in limits.others))


def one(robot: Robot, text: str, seed: int) -> dict[str, Any]:
    limits = parse_limits(text, robot)
    settings = DesignSettings(method="gradient", starts=1, margin=0.0, limits=limits)
    began = time.perf_counter()
    try:
        found = design(robot, rng=np.random.default_rng(seed), criterion=ConditionNumber(), settings=settings)
    except ExcitationError as error:
        return {"refused": str(error)}
    return {
        "condition": found.condition, "log_det": found.log_det, "seconds": time.perf_counter() - began,
        "excess": excess(found, limits),
    }  # fmt: skip


def measure(name: str, seeds: int) -> dict[str, Any]:
    robot = with_accelerations(load_robot(name))
    robot = replace(robot, name=name)
    return {kind: [one(robot, text, seed) for seed in range(seeds)] for kind, text in LIMITS.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--quick", action="store_true", help="one arm, one seed")
    parser.add_argument("--seeds", type=int, default=5)
    options = parser.parse_args()
    names, seeds = (ARMS[:1], 1) if options.quick else (ARMS, options.seeds)
    with threadpool_limits(1):
        results = {name: measure(name, seeds) for name in names}
    if options.json:
        print(json.dumps(results))
        return
    print(
        f"{'arm':14} {'limits':16} {'condition best':>15} {'median':>8} {'worst':>8} {'s median':>9} {'excess':>9} refused"
    )
    for name, kinds in results.items():
        for kind, rows in kinds.items():
            good = [row for row in rows if "condition" in row]
            if not good:
                print(f"{name:14} {kind:16} {rows[0]['refused']}")
                continue
            conditions = np.sort([row["condition"] for row in good])
            print(
                f"{name:14} {kind:16} {conditions[0]:15.2f} {np.median(conditions):8.2f} {conditions[-1]:8.2f} "
                f"{np.median([row['seconds'] for row in good]):9.1f} {max(row['excess'] for row in good):9.1e} "
                f"{len(rows) - len(good)}"
            )


if __name__ == "__main__":
    main()
