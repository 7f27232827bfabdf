"""The regressor kernel against Pinocchio's loop and against writing the output, in one run.

    python benchmarks/kernels.py [--json] [--samples N]

Aims: at least 10 times Pinocchio's Python loop on one thread, 15 times on two; memory bandwidth is the floor.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable

import numpy as np
import pinocchio as pin

from tauhat.dynamics import inverse_dynamics, random_motion
from tauhat.dynamics.motion import Motion
from tauhat.dynamics.rigid_body import inertial_columns, rigid_torque
from tauhat.dynamics.tree import kernel_tree
from tauhat.robots import load_robot
from tauhat.robots.kinematics import pinocchio_model


def best_of(action: Callable[[], object], *, repeats: int) -> float:
    """Shortest wall time of one call [s]; the first call, which may compile, is not counted."""
    action()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        action()
        times.append(time.perf_counter() - start)
    return min(times)


def pinocchio_loop(model: pin.Model, motion: Motion, out: np.ndarray) -> None:
    data = model.createData()
    q, dq, ddq = (np.ascontiguousarray(part.T) for part in (motion.q, motion.dq, motion.ddq))
    for k in range(motion.n_t):
        out[k] = pin.computeJointTorqueRegressor(model, data, q[k], dq[k], ddq[k])


def measure(name: str, samples: int) -> dict[str, float | str | int]:
    robot = load_robot(name)
    tree = kernel_tree(robot)
    motion = random_motion(robot, samples, np.random.default_rng(0))
    columns = np.zeros((10 * robot.n_v, robot.n_v, samples))
    peer_out = np.zeros((samples, robot.n_v, 10 * robot.n_v))
    model = pinocchio_model(robot)
    pinocchio_loop(model, motion, peer_out)
    inertial_columns(tree, motion, out=columns)
    error = float(np.abs(columns.transpose(2, 1, 0) - peer_out).max() / np.abs(peer_out).max())
    micro = 1e6 / samples
    one = best_of(lambda: inertial_columns(tree, motion, out=columns), repeats=15) * micro
    two = best_of(lambda: inertial_columns(tree, motion, out=columns, threads=2), repeats=15) * micro
    peer = best_of(lambda: pinocchio_loop(model, motion, peer_out), repeats=3) * micro
    write = best_of(lambda: columns.fill(1.0), repeats=15) * micro
    torque = best_of(lambda: rigid_torque(tree, motion, robot.inertia), repeats=15) * micro
    check = inverse_dynamics(robot, motion.q[:, :9].T, motion.dq[:, :9].T, motion.ddq[:, :9].T)
    assert np.isfinite(check).all()
    return {
        "robot": name, "joints": robot.n_v, "samples": samples, "pinocchio_loop_us": peer, "one_thread_us": one,
        "two_threads_us": two, "write_output_us": write, "inverse_dynamics_us": torque, "ratio_one": peer / one,
        "ratio_two": peer / two, "largest_relative_difference": error,
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--samples", type=int, default=20_000)
    options = parser.parse_args()
    rows = [measure(name, options.samples) for name in ("ur10e", "panda")]
    if options.json:
        print(json.dumps(rows))
        return
    print(f"regressor of {options.samples} samples, microseconds per sample (best of 15)")
    print(
        f"{'robot':8} {'pinocchio loop':>15} {'one thread':>11} {'two':>6} {'only writing':>13} {'ratios':>12} {'error':>9}"
    )
    for row in rows:
        ratios = f"{row['ratio_one']:.1f} / {row['ratio_two']:.1f}"
        print(
            f"{row['robot']:8} {row['pinocchio_loop_us']:15.2f} {row['one_thread_us']:11.3f} {row['two_threads_us']:6.3f} "
            f"{row['write_output_us']:13.3f} {ratios:>12} {row['largest_relative_difference']:9.1e}"
        )
    print("aims: ratio 10 on one thread, 15 on two; error below 3e-14")


if __name__ == "__main__":
    main()
