"""How often the intervals of an estimate hold the truth: white and autocorrelated torque noise, over seeds.

    python benchmarks/coverage.py [--json] [--robot two_link] [--seeds 100] [--seconds 20]

Every seed is a new motion and a new noise of 5 % of each joint's torque. Beside the block jackknife of the library
stands the white-noise formula `s^2 (A'A)^-1` on the same evidence. Wanted: 95 % of the 95 % intervals hold the truth.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace

import numpy as np
from scipy.signal import lfilter
from scipy.special import stdtrit

from tauhat.blas import single_threaded
from tauhat.dynamics import BaseParameters, Coulomb, TorqueModel, base_parameters, motion_from_rows, torque_model
from tauhat.estimation import Evidence, WeightedLeastSquares, collect
from tauhat.excitation import random_fourier
from tauhat.recordings import Processing, Recording
from tauhat.robots import Robot, load_robot
from tauhat.simulation import nominal_parameters
from tauhat.verification import standard_parameters

RATE = 200.0  # [Hz]
NOISE = 0.05  # of each joint's RMS torque
CONFIDENCE = 0.95
PROCESSING = Processing(cutoff=10.0, motion_cutoff=30.0)
TIME_CONSTANTS = {"white": 0.0, "0.2 s": 0.2, "1 s": 1.0}  # of first-order autoregressive noise [s]


def model_of(robot: Robot) -> TorqueModel:
    """The model whose Coulomb term has fixed widths: what is judged here is error bars, not the choice of a shape."""
    speeds = np.where(np.isfinite(robot.velocity_limit), robot.velocity_limit, 1.0)
    return torque_model(robot).with_term(Coulomb(widths=tuple((0.02 * speeds).tolist())))


def noise(rng: np.random.Generator, shape: tuple[int, int], time_constant: float) -> np.ndarray:
    """Noise of unit deviation, (n_t, n_v)."""
    if time_constant == 0.0:
        return rng.standard_normal(shape)
    pole = np.exp(-1.0 / (time_constant * RATE))
    lead = round(10 * time_constant * RATE)
    white = rng.standard_normal((shape[0] + lead, shape[1]))
    return lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], white, axis=0)[lead:]


def recording(
    model: TorqueModel, standard: np.ndarray, rng: np.random.Generator, *, seconds: float, time_constant: float
) -> Recording:
    """A random motion with the model's own torque and noise on it."""
    motion = random_fourier(model.robot, period=seconds, harmonics=5, rng=rng)
    samples = motion.sample(np.arange(0.0, seconds, 1.0 / RATE))
    layout = model.layout()
    columns, _ = model.columns(motion_from_rows(samples.q, samples.dq, samples.ddq), layout)
    weights = standard[layout.parameters]
    rows = [layout.of_joint(joint) for joint in range(model.robot.n_v)]
    tau = np.array([weights[part] @ columns[part] for part in rows]).T
    size = NOISE * np.sqrt(np.mean(tau**2, axis=0))
    return Recording(t=samples.t, q=samples.q, tau=tau + size * noise(rng, tau.shape, time_constant))


def held(evidence: Evidence, truth: np.ndarray) -> tuple[np.ndarray, float]:
    """Which intervals hold the truth, (n_b,), and the median half width."""
    solution = WeightedLeastSquares().fit(evidence)
    half = stdtrit(solution.degrees, 0.5 + 0.5 * CONFIDENCE) * np.sqrt(np.diag(solution.covariance))
    return np.abs(solution.values - truth) <= half, float(np.median(half))


@single_threaded
def measure(
    model: TorqueModel, base: BaseParameters, time_constant: float, *, seeds: int, seconds: float
) -> dict[str, float]:
    """Coverage of both kinds of intervals over all parameters and seeds."""
    standard = standard_parameters(model, nominal_parameters(model.robot))
    truth = base.projection @ standard
    honest, white, ratios = [], [], []
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        log = recording(model, standard, rng, seconds=seconds, time_constant=time_constant)
        evidence = collect(model, base, log, PROCESSING)
        inside, half = held(evidence, truth)
        plain, plain_half = held(replace(evidence, blocks=(evidence.total,)), truth)
        honest.append(inside)
        white.append(plain)
        ratios.append(half / plain_half)
    return {
        "jackknife": float(np.mean(honest)), "jackknife_worst": float(np.mean(honest, axis=0).min()),
        "white_formula": float(np.mean(white)), "white_formula_worst": float(np.mean(white, axis=0).min()),
        "width_ratio": float(np.median(ratios)),
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--robot", default="two_link")
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--seconds", type=float, default=20.0)
    options = parser.parse_args()
    model = model_of(load_robot(options.robot))
    base = base_parameters(model)
    rows = {
        name: measure(model, base, time_constant, seeds=options.seeds, seconds=options.seconds)
        for name, time_constant in TIME_CONSTANTS.items()
    }
    if options.json:
        print(json.dumps({"robot": options.robot, "base_parameters": base.n_b, "seeds": options.seeds, "noise": rows}))
        return
    print(
        f"{options.robot}: share of the 95 % intervals that hold the truth, {base.n_b} base parameters, "
        f"{options.seeds} seeds of {options.seconds:g} s, 10 Hz low-pass"
    )
    print(f"{'noise':8} {'jackknife %':>12} {'worst':>7} {'white formula %':>16} {'worst':>7} {'width ratio':>12}")
    for name, row in rows.items():
        shares = [100 * row[key] for key in ("jackknife", "jackknife_worst", "white_formula", "white_formula_worst")]
        print(
            f"{name:8} {shares[0]:12.1f} {shares[1]:7.0f} {shares[2]:16.1f} {shares[3]:7.0f} {row['width_ratio']:12.1f}"
        )
    print("worst: of the single parameters; width ratio: half width over that of the white formula, median")


if __name__ == "__main__":
    main()
