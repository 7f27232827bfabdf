"""What a designed motion is worth on the plant: errors of the model identified from it and from random motions.

    python benchmarks/excitation_plant.py [--json] [--quick] [--robot NAME]

20 seeds (4 with --quick). Each has its own true robot, designed motion and random motion, of the same length, inside the
same limits, with the same torque noise in Nm and the same encoders; both models predict a third motion without noise.
"floor" is the error of the prediction by the true parameters: what sign and filters leave, whatever was identified.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from typing import Any

import numpy as np

from tauhat.dynamics import random_motion, torque_model
from tauhat.dynamics.rigid_body import rigid_torque
from tauhat.dynamics.tree import kernel_tree
from tauhat.estimation import identify
from tauhat.excitation import DesignSettings, DOptimal, FourierSeries, Mixed, design, information, random_fourier
from tauhat.robots import Robot, load_robot
from tauhat.simulation import ExperimentSettings, SensorErrors, perturbed, simulate
from tauhat.verification.truth import compare_with_truth

PERIOD, HARMONICS, MARGIN = 10.0, 5, 0.05
NOISE = 0.03  # deviation of the torque noise over the RMS torque of random states
KINDS = ("random", "mixed", "d")


def experiment_settings(robot: Robot) -> ExperimentSettings:
    """The same noise in Nm whatever the motion."""
    states = random_motion(robot, 2000, np.random.default_rng(1))
    torque = rigid_torque(kernel_tree(robot), states, robot.inertia)
    deviation = NOISE * np.sqrt(np.mean(torque**2, axis=1))
    sensors = SensorErrors(encoder_step=2e-5, torque_noise=deviation)
    return ExperimentSettings(sample_rate=500.0, sensors=sensors)


def motions(robot: Robot, rng: np.random.Generator) -> dict[str, FourierSeries]:
    wanted = DesignSettings(period=PERIOD, harmonics=HARMONICS, margin=MARGIN)
    return {
        "random": random_fourier(robot, period=PERIOD, harmonics=HARMONICS, rng=rng, margin=MARGIN),
        "mixed": design(robot, rng=rng, settings=wanted, criterion=Mixed()).trajectory,
        "d": design(robot, rng=rng, settings=wanted, criterion=DOptimal()).trajectory,
    }


def run(robot: Robot, seed: int, settings: ExperimentSettings) -> dict[str, dict[str, float]]:
    """Errors of one seed: of the parameters, in Nm they cause in random states, and of the predicted torque."""
    rng = np.random.default_rng([20261121, seed])
    truth, model = perturbed(robot, rng), torque_model(robot)
    judge = random_fourier(robot, period=PERIOD, harmonics=4, rng=rng, margin=MARGIN)
    unseen = simulate(robot, judge, rng=rng, parameters=truth, settings=settings).truth
    scales = information(model).scales
    found = {}
    for kind, motion in motions(robot, rng).items():
        recording = simulate(robot, motion, rng=rng, parameters=truth, settings=settings).recording
        estimate = identify(model, [recording])
        compared = compare_with_truth(estimate, unseen)
        error = (estimate.values - compared.values) * scales
        found[kind] = {
            "parameters_rms_nm": float(np.sqrt(np.mean(error**2))),
            "parameters_worst_nm": float(np.abs(error).max()),
            "prediction": compared.relative_rms,
            "prediction_of_truth": compare_with_truth(replace(estimate, values=compared.values), unseen).relative_rms,
            "inside_95": compared.share_inside,
        }
    return found


def summary(rows: list[dict[str, dict[str, float]]]) -> dict[str, dict[str, float]]:
    """Median over the seeds, and in how many the motion beat the random one."""
    table: dict[str, dict[str, float]] = {}
    for kind in KINDS:
        part = {key: float(np.median([row[kind][key] for row in rows])) for key in rows[0][kind]}
        for key in ("parameters_rms_nm", "prediction"):
            part[f"{key}_better"] = float(np.mean([row[kind][key] < row["random"][key] for row in rows]))
            part[f"{key}_ratio"] = float(np.median([row["random"][key] / row[kind][key] for row in rows]))
        table[kind] = part
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--quick", action="store_true", help="4 seeds instead of 20")
    parser.add_argument("--robot", default="ur5e")
    options = parser.parse_args()
    robot = load_robot(options.robot)
    settings = experiment_settings(robot)
    rows = [run(robot, seed, settings) for seed in range(4 if options.quick else 20)]
    table: dict[str, Any] = summary(rows)
    if options.json:
        print(json.dumps({"robot": robot.name, "seeds": rows, "summary": table}))
        return
    print(f"{robot.name}, {len(rows)} seeds, {PERIOD:g} s; medians; errors over those of a random motion of the seed")
    print(
        f"{'motion':8} {'parameters, Nm':>15} {'worst':>8} {'prediction':>11} {'floor':>7} {'in 95 %':>8}  times better (in seeds)"
    )
    for kind, part in table.items():
        gain = " and ".join(
            f"{part[f'{key}_ratio']:.1f} ({100 * part[f'{key}_better']:.0f} %)"
            for key in ("parameters_rms_nm", "prediction")
        )
        print(
            f"{kind:8} {part['parameters_rms_nm']:15.4f} {part['parameters_worst_nm']:8.3f} {100 * part['prediction']:9.2f} % "
            f"{100 * part['prediction_of_truth']:5.2f} % {100 * part['inside_95']:6.0f} %  {gain}"
        )


if __name__ == "__main__":
    main()
