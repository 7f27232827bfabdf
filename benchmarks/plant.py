"""How much faster than real time the simulated robot runs, with every effect on.

    python benchmarks/plant.py [--json] [--quick]

The ur5e follows a random motion at 1 kHz: steps of the plant, control and log, on one core. Each way of running it is
timed from the prepared plant to the finished log, best of 5 (2 with --quick), by the clock and by processor time:

kernel       controller, laws, elastic joints, heat, MuJoCo and log in one compiled loop
controller   the same plant, its controller an object that Python asks once a period
python       the same plant in a plain Python loop around `mujoco.mj_step`, the reference that the kernel is tested with
plain plant  the kernel on a plant of rigid joints with viscous and Coulomb friction alone
bare step    `mujoco.mj_step` alone on that plain plant, in a Python loop: neither control, laws nor log

"difference" is the largest of the position between that way and the kernel, in rad.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from tauhat.arrays import FloatArray
from tauhat.control import TrackingController
from tauhat.excitation import random_fourier
from tauhat.robots import load_robot
from tauhat.simulation import (
    AttachedBody,
    ElasticJoints,
    Encoder,
    FrictionHeat,
    TrueParameters,
    build_plant,
    perturbed,
    started,
    tracking_gains,
)
from tauhat.simulation.closed_loop import Course, Pilot, follow
from tauhat.simulation.laws import (
    BalancingSpring,
    Bristles,
    CubeRootDrag,
    DirectionalViscous,
    GasCylinder,
    LoadedBristles,
    LoadedCoulomb,
    SharedDrive,
    StribeckBump,
)

RATE, SETTLE = 1000.0, 200
ROBOT = load_robot("ur5e")
N = ROBOT.n_v


def whole_truth() -> TrueParameters:
    """A plant with every effect: nine laws, four elastic joints with backlash, a shared motor, heat and a tool."""
    truth = perturbed(ROBOT, np.random.default_rng(0))
    short, long, width = np.full(N, 2e-3), np.full(N, 1e-2), np.full(N, 0.02)
    dry = Bristles(
        fine=0.2 * truth.coulomb[5:], coarse=0.1 * truth.coulomb[5:], fine_length=short[5:], coarse_length=long[5:]
    )
    laws = (
        StribeckBump(torque=0.3 * truth.coulomb, speed=np.full(N, 0.1), width=width),
        CubeRootDrag(coefficient=0.2 * truth.coulomb),
        DirectionalViscous(difference=0.1 * truth.viscous),
        Bristles(fine=0.2 * truth.coulomb, coarse=0.2 * truth.coulomb, fine_length=short, coarse_length=long),
        LoadedCoulomb(ratio=np.full(N, 0.03), width=width),
        LoadedBristles(ratio=np.full(N, 0.02), length=short),
        SharedDrive(own=5, other=4, ratio=1.0, inertia=0.5 * truth.rotor[5], viscous=0.5 * truth.viscous[5], dry=dry),
        BalancingSpring(rate=np.array([0.0, 20.0, 0.0, 0.0, 0.0, 0.0])),
        GasCylinder(joint=1, energy=80.0, distance=0.5, lever=0.1, angle=np.pi / 2, area=2e-3, volume=1e-3),
    )
    slopes = np.vstack([np.full((6, N), -0.004), np.zeros((3, N))])
    return replace(
        truth,
        coulomb=0.4 * truth.coulomb,
        laws=laws,
        elasticity=ElasticJoints(
            joints=(0, 1, 2, 3), stiffness=np.array([2e4, 2e4, 1e4, 4e3]), damping=np.array([20.0, 20.0, 10.0, 4.0]),
            gap=np.full(4, 1e-4),
        ),
        heat=FrictionHeat(
            heating=np.full(N, 0.01), time_constant=np.full(N, 600.0), viscous=np.full(N, -0.01),
            coulomb=np.full(N, -0.005), initial=np.full(N, 20.0), laws=slopes,
        ),
        attached=(
            AttachedBody(
                name="gripper", mass=2.0, centre=np.array([0.0, 0.0, 0.08]), inertia=np.diag([0.004, 0.004, 0.002])
            ),
        ),
    )  # fmt: skip


class Asked:
    """A tracking law behind the protocol of controllers, as any other controller is."""

    def __init__(self, inside: TrackingController) -> None:
        self.inside, self.feedforward, self.torque_limit = inside, inside.feedforward, inside.torque_limit
        self.start, self.step = inside.start, inside.step


def best_of(action: Callable[[], Any], repeats: int) -> tuple[float, float, Any]:
    """Seconds by the clock and of the processor, the least of each, and the last result."""
    clock, processor, result = [], [], None
    for _ in range(repeats):
        begin = time.perf_counter(), time.process_time()
        result = action()
        clock.append(time.perf_counter() - begin[0])
        processor.append(time.process_time() - begin[1])
    return min(clock), min(processor), result


def measure(seconds: float, repeats: int) -> list[dict[str, Any]]:
    motion = random_fourier(ROBOT, period=seconds, harmonics=5, rng=np.random.default_rng(1), margin=0.2)
    nominal = build_plant(ROBOT, timestep=1.0 / RATE)
    reference = motion.sample(np.arange(round(seconds * RATE) + 1) / RATE)
    course = Course(reference=reference, nominal=nominal, settle=SETTLE, stride=1, substeps=1, period=1.0 / RATE)
    law = tracking_gains(ROBOT, reference.q, bandwidth=8.0, control_rate=RATE)
    pilot = Pilot(controller=law, encoder=Encoder(side="motor", step=1e-6, velocity="differenced"), delayed=1)
    asked = replace(pilot, controller=Asked(TrackingController(law=law)))
    plant = build_plant(ROBOT, parameters=whole_truth(), timestep=1.0 / RATE)
    plain = build_plant(ROBOT, parameters=perturbed(ROBOT, np.random.default_rng(0)), timestep=1.0 / RATE)
    start, steps = reference.q[0], SETTLE + reference.n_t

    def bare() -> None:
        data = mujoco.MjData(plain.model)
        for _ in range(steps):
            mujoco.mj_step(plain.model, data)

    ways: dict[str, Callable[[], FloatArray | None]] = {
        "kernel": lambda: follow(started(plant, start), pilot, course),
        "controller": lambda: follow(started(plant, start), asked, course),
        "python": lambda: follow(started(plant, start).in_python(), pilot, course),
        "plain plant": lambda: follow(started(plain, start), pilot, course),
        "bare step": bare,
    }
    ways["kernel"]()  # compiles, or loads what was compiled
    rows, judge = [], None
    for name, action in ways.items():
        clock, processor, log = best_of(action, repeats)
        judge = log if name == "kernel" else judge
        same = log is not None and judge is not None and name != "plain plant"
        rows.append(
            {
                "way": name,
                "real_time_factor": steps / RATE / clock,
                "of_processor_time": steps / RATE / processor,
                "us_per_step": 1e6 * clock / steps,
                "difference": float(np.abs(log[:, 0] - judge[:, 0]).max()) if same else None,
            }
        )
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    rows = measure(4.0, 2) if options.quick else measure(20.0, 5)
    if options.json:
        print(json.dumps(rows))
        return
    print("ur5e, 1 kHz, every effect; times faster than real time")
    print(f"{'way':<12} {'by the clock':>13} {'processor':>10} {'us a step':>10} {'difference':>11}")
    for row in rows:
        difference = "" if row["difference"] is None else f"{row['difference']:.2g}"
        print(
            f"{row['way']:<12} {row['real_time_factor']:>13.1f} {row['of_processor_time']:>10.1f}"
            f" {row['us_per_step']:>10.1f} {difference:>11}"
        )


if __name__ == "__main__":
    main()
