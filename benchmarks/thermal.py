"""Friction that warms up: identified from a warm-up in MuJoCo, judged on unseen logs, felt by the thermal observer.

    python benchmarks/thermal.py [--quick] [--json] [--model NAMES]

The plant is a UR5e whose gears warm up by about 60 K, with the plant's own law of heat in kelvins; the model knows
neither kelvins nor a thermometer. One motion is repeated for 20 minutes (`--quick`: 10) at 100 Hz. Then two unseen
motions of two minutes at 250 Hz, one that begins cold and one as warm as the warm-up ended, each with pushes of 30 N of
40 s at the tool. Printed: time constants and slopes against the plant's; the error of the torque with and without the
term; and what observers make of the pushes: root mean square and 95 % of the error of external torque, all joints by
their own torque's size, and how often the error bar holds.
"""

from __future__ import annotations

import argparse
import json
import warnings
from dataclasses import replace
from typing import Any

import numpy as np

from tauhat.dynamics import torque_model
from tauhat.errors import TauhatWarning
from tauhat.estimation import Estimate, identify, warm_start
from tauhat.estimation.warming import slopes_of, thermal_term
from tauhat.excitation.fourier import random_fourier
from tauhat.excitation.repeated import Repeated
from tauhat.recordings import Recording
from tauhat.robots import load_robot
from tauhat.sensing import TorqueObserver, WrenchSolver, observer_named, sensed_model
from tauhat.simulation.experiment import ExperimentSettings, simulate
from tauhat.simulation.heat import FrictionHeat
from tauhat.simulation.parameters import TrueParameters, perturbed
from tauhat.simulation.sensors import SensorErrors
from tauhat.verification.prediction import verify

ROBOT = load_robot("ur5e")
PERIOD, AMBIENT = 15.0, 20.0
PUSH = np.array([0.0, 20.0, 22.4, 0.0, 0.0, 0.0])  # [N, Nm] at the tool, in the base's axes
PUSHED = (60.0, 100.0)  # [s]
SETTLED = 5.0  # [s] behind the start, and behind the ends of a push


def plant(above: np.ndarray) -> TrueParameters:
    """Return the robot, `above` (6,) warmer than its surroundings [K]."""
    heat = FrictionHeat(
        heating=np.array([0.012, 0.010, 0.015, 0.06, 0.06, 0.06]), time_constant=np.array([500.0, 700, 600, 400, 450, 350]),
        viscous=np.full(6, -0.012), coulomb=np.full(6, -0.008), initial=AMBIENT + above, ambient=AMBIENT, reference=AMBIENT,
    )  # fmt: skip
    friction = {"coulomb": np.array([8.0, 9, 6, 2, 2, 2]), "viscous": np.array([12.0, 12, 8, 2.5, 2.5, 2.5])}
    return replace(perturbed(ROBOT, np.random.default_rng(7), spread=0.1), heat=heat, **friction)


def log(minutes: float, above: np.ndarray, *, seed: int, rate: float) -> Recording:
    rng = np.random.default_rng(seed)
    series = random_fourier(ROBOT, harmonics=5, period=PERIOD, rng=rng)
    motion = Repeated(series=series, periods=round(60.0 * minutes / PERIOD))
    sensors = SensorErrors(torque_noise=0.3, encoder_step=1e-5)
    settings = ExperimentSettings(timestep=1e-3, control_rate=1000.0, sample_rate=rate, sensors=sensors)
    made = simulate(ROBOT, motion, rng=rng, parameters=plant(above), settings=settings).recording
    return replace(made, dq=None, ddq=None)


def against_the_plant(estimate: Estimate) -> list[dict[str, float]]:
    """Return time constants, and the change of friction at the typical speed, found and true."""
    term, truth = thermal_term(estimate.model), plant(np.zeros(6))
    assert term is not None
    assert truth.heat is not None
    heat, v = truth.heat, np.array(term.speeds)
    standard = np.zeros(estimate.model.n_p)
    standard[estimate.base.independent] = estimate.values
    found = slopes_of(estimate.model, standard)
    kelvins = heat.heating * heat.time_constant * (truth.coulomb + truth.viscous * v) * v
    true = (truth.coulomb * heat.coulomb + truth.viscous * heat.viscous * v) * kelvins
    return [
        {
            "joint": joint + 1, "time": term.times[joint], "true_time": heat.time_constant[joint],
            "change": found[joint] @ [1.0, v[joint]], "true_change": true[joint],
        }
        for joint in range(6)
    ]  # fmt: skip


def predicted(estimate: Estimate, unseen: Recording) -> float:
    """Return the relative error of the torque behind the first 20 s; an estimate with the term is started by these."""
    rest = unseen.rows(int(20.0 * unseen.rate), unseen.n_t)
    if thermal_term(estimate.model) is not None:
        estimate = warm_start(estimate, unseen, seconds=20.0).later
    return verify(estimate, [rest]).logs[0].relative_rms


def felt(estimate: Estimate, name: str, unseen: Recording) -> dict[str, float]:
    """Return what an observer makes of the push."""
    solver = WrenchSolver(robot=ROBOT)
    external = np.zeros_like(unseen.q)
    t = unseen.t - unseen.t[0]
    for k in np.flatnonzero((t >= PUSHED[0]) & (t < PUSHED[1])):
        external[k] = solver.jacobian(unseen.q[k])[0].T @ PUSH
    seer = TorqueObserver(model=sensed_model(estimate), step=1.0 / unseen.rate, observer=observer_named(name))
    found = seer.along(unseen.q, unseen.tau - external)
    judged = t > SETTLED
    for edge in PUSHED:
        judged &= (t < edge) | (t > edge + SETTLED)
    error, bar = (found.tau - external)[judged], np.sqrt(found.variance[judged])
    scale = np.sqrt(np.mean(unseen.tau**2, axis=0))
    return {
        "rms": float(np.sqrt(np.mean((error / scale) ** 2))),
        "worst_95": float(np.quantile(np.abs(error / scale), 0.95)),
        "inside": float(np.mean(np.abs(error) < 1.96 * bar)),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a warm-up of ten minutes")
    parser.add_argument("--json", action="store_true", help="one JSON document")
    parser.add_argument("--model", default="plain", help="terms beside thermal: plain, robust")
    options = parser.parse_args()
    warnings.simplefilter("ignore", TauhatWarning)
    warm_up = simulate_all(10.0 if options.quick else 20.0)
    names = options.model
    estimates = {
        "without": identify(torque_model(ROBOT, names), [warm_up["warm-up"]]),
        "with": identify(torque_model(ROBOT, f"{names},thermal"), [warm_up["warm-up"]]),
    }
    result: dict[str, Any] = {"plant": against_the_plant(estimates["with"]), "torque": {}, "felt": {}}
    for state in ("cold", "warm"):
        for kind, estimate in estimates.items():
            result["torque"][f"{state}, {kind} the term"] = predicted(estimate, warm_up[state])
        result["felt"][f"{state}, momentum"] = felt(estimates["without"], "momentum", warm_up[state])
        result["felt"][f"{state}, thermal"] = felt(estimates["with"], "thermal", warm_up[state])
    print(json.dumps(result, indent=1, default=float)) if options.json else show(result)


def simulate_all(minutes: float) -> dict[str, Recording]:
    whole = log(minutes, np.zeros(6), seed=1, rate=100.0)
    assert whole.temperature is not None
    hot = whole.temperature[-1] - AMBIENT
    return {
        "warm-up": replace(whole, temperature=None),
        "cold": log(2.0, np.zeros(6), seed=2, rate=250.0),
        "warm": log(2.0, hot, seed=3, rate=250.0),
    }


def show(result: dict[str, Any]) -> None:
    print(
        f"{'joint':>6} {'T found s':>10} {'T true s':>9} {'change found':>13} {'true':>8}  of friction at typical speed"
    )
    for row in result["plant"]:
        print(
            f"{row['joint']:6.0f} {row['time']:10.0f} {row['true_time']:9.0f} {row['change']:13.2f} "
            f"{row['true_change']:8.2f}"
        )
    print("\nerror of the torque on unseen motions, behind 20 s")
    for name, value in result["torque"].items():
        print(f"{name:28} {100 * value:6.2f} %")
    print(f"\n{'external torque':28} {'rms':>8} {'95 %':>8} {'bar holds':>10}   of the joints' torque")
    for name, row in result["felt"].items():
        print(f"{name:28} {100 * row['rms']:6.2f} % {100 * row['worst_95']:6.2f} % {100 * row['inside']:8.1f} %")


if __name__ == "__main__":
    main()
