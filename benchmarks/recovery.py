"""Recovery of every law of friction from the MuJoCo plant: are the true parameters inside their own 95 % intervals?

    python benchmarks/recovery.py [--json] [--quick] [--seeds 20] [--robot ur5e] [--kind dahl ...] [--true-shapes]
                                  [--workers 2]

Each seed is a true robot of its own, a random motion, encoders of 2e-5 rad and torque noise of 2 % of each joint's RMS
torque. The plant applies the law as a torque by code of its own; the model has the law's term with the shape, filters
and delay that `identify` chooses. Two figures of prediction on an unseen motion without noise: by the estimate, and by
the true parameters with the chosen shapes, which is what shape and filters leave whatever was identified.
"""

from __future__ import annotations

import argparse
import json
import warnings
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from tauhat.errors import TauhatWarning
from tauhat.estimation import Estimate, identify
from tauhat.excitation import random_fourier
from tauhat.robots import load_robot
from tauhat.simulation import (
    KINDS,
    ExperimentSettings,
    SensorErrors,
    matching_model,
    simulate,
    typical_plant,
    with_true_shapes,
)
from tauhat.verification import TruthComparison, compare_with_truth

PERIOD, HARMONICS = 20.0, 5
UNSEEN_PERIOD, UNSEEN_HARMONICS = 10.0, 4
# A servo of 15 Hz lets a joint with sharp dry friction stick for 50 ms at every reversal, four times as long as the
# reference is slow; no law of the speed describes that, and a cube root beside it came out 14 % too small.
SETTINGS = ExperimentSettings(
    sample_rate=500.0, bandwidth=60.0, sensors=SensorErrors(encoder_step=2e-5, relative_torque_noise=0.02)
)
RIGID = {"m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz", "Ia", "Iam", "To"}


def run(case: tuple[str, int], *, name: str, true_shapes: bool) -> dict[str, Any]:
    """Figures of one kind of plant and one seed."""
    kind, seed = case
    robot, rng = load_robot(name), np.random.default_rng([20261122, seed])
    truth = typical_plant(robot, kind, rng=rng)
    motion = random_fourier(robot, period=PERIOD, harmonics=HARMONICS, rng=rng)
    judge = random_fourier(robot, period=UNSEEN_PERIOD, harmonics=UNSEEN_HARMONICS, rng=rng)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)
        log = simulate(robot, motion, rng=rng, parameters=truth, settings=SETTINGS)
        unseen = simulate(robot, judge, rng=rng, parameters=truth, settings=SETTINGS).truth
        model = matching_model(robot, kind, truth)
        estimate = identify(with_true_shapes(model, truth) if true_shapes else model, [log.recording])
    compared = compare_with_truth(estimate, unseen)
    by_truth = compare_with_truth(replace(estimate, values=compared.values), unseen)
    return {"kind": kind, "seed": seed} | figures(estimate, compared) | {
        "prediction": compared.relative_rms,
        "prediction_of_truth": by_truth.relative_rms,
    }  # fmt: skip


def figures(estimate: Estimate, compared: TruthComparison) -> dict[str, Any]:
    """What the parameters of one estimate are worth; `rows` are all of them."""
    parameters = [estimate.model.parameters[index] for index in estimate.base.independent]
    half = estimate.half_intervals()
    error = estimate.values - compared.values
    rows = [
        {
            "name": parameter.name,
            "friction": parameter.symbol not in RIGID,
            "inside": bool(inside),
            "error": float(own),
            "half": float(width),
            "true": float(value),
        }
        for parameter, inside, own, width, value in zip(
            parameters, compared.inside, error, half, compared.values, strict=True
        )
    ]
    shapes = {
        term.key: list(term.shape) for term in estimate.model.terms if getattr(term, "shape_field", "") and term.shape
    }
    return {
        "rows": rows,
        "shapes": shapes,
        "processing": estimate.processing.to_dict(),
        "condition": estimate.condition,
    }


def summary(runs: list[dict[str, Any]]) -> dict[str, float]:
    """Figures of one kind over its seeds."""
    rows = [row for one in runs for row in one["rows"]]
    friction = [row for row in rows if row["friction"]]
    relative = [abs(row["error"] / row["true"]) for row in friction if row["true"] != 0.0]
    return {
        "seeds": len(runs),
        "parameters": len(rows) / len(runs),
        "inside": float(np.mean([row["inside"] for row in rows])),
        "inside_friction": float(np.mean([row["inside"] for row in friction])),
        "friction_error": float(np.median(relative)),
        "friction_error_90": float(np.quantile(relative, 0.9)),
        "prediction": float(np.median([one["prediction"] for one in runs])),
        "prediction_of_truth": float(np.median([one["prediction_of_truth"] for one in runs])),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="all rows of all seeds, too")
    parser.add_argument("--quick", action="store_true", help="4 seeds")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--robot", default="ur5e")
    parser.add_argument("--kind", nargs="*", default=list(KINDS), choices=list(KINDS))
    parser.add_argument("--true-shapes", action="store_true", help="give the model the plant's own shapes")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    cases = list(product(options.kind, range(4 if options.quick else options.seeds)))
    with ProcessPoolExecutor(options.workers) as pool:
        runs = list(pool.map(partial(run, name=options.robot, true_shapes=options.true_shapes), cases))
    table = {kind: summary([one for one in runs if one["kind"] == kind]) for kind in options.kind}
    if options.json:
        print(json.dumps({"robot": options.robot, "summary": table, "runs": runs}))
        return
    print(f"{options.robot}, {len(cases) // len(options.kind)} seeds of {PERIOD:g} s; errors in %, prediction: medians")
    print(
        f"{'plant':20} {'parameters':>10} {'inside 95 %':>11} {'friction':>8} {'friction error':>14} {'90 % below':>10} "
        f"{'prediction':>10} {'of the truth':>12}"
    )
    for kind, row in table.items():
        shares = [100.0 * value for name, value in row.items() if name not in {"seeds", "parameters"}]
        print(
            f"{kind:20} {row['parameters']:10.0f} {shares[0]:11.1f} {shares[1]:8.1f} {shares[2]:14.1f} {shares[3]:10.1f} "
            f"{shares[4]:10.2f} {shares[5]:12.2f}"
        )


if __name__ == "__main__":
    main()
