"""How often the residual tests name what is not there, and what is: simulated arms with and without each effect.

    python benchmarks/residual_tests.py [--json] [--robot two_link] [--seeds 20] [--seconds 20] [--noise 0.03]

False alarms: the plant has what the model has, with white torque noise and with noise that is correlated; counted is
the share of recordings on which anything is named. Power: the plant has one effect that the model lacks; counted is the
share of recordings on which it is the first that is named on some joint, and named anywhere. Every seed is a new plant,
a motion to fit and another motion to judge.
"""

from __future__ import annotations

import argparse
import json
import warnings
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter

from tauhat.dynamics import torque_model
from tauhat.errors import TauhatWarning
from tauhat.estimation import identify
from tauhat.excitation import random_fourier
from tauhat.recordings import Recording
from tauhat.robots import Robot, load_robot
from tauhat.simulation import (
    ElasticJoints,
    ExperimentSettings,
    FrictionHeat,
    TrueParameters,
    simulate,
    typical_plant,
)
from tauhat.simulation.closed_loop import Encoder
from tauhat.verification import LogResiduals, residual_tests

PLAIN = "inertia,rotor,viscous,coulomb,offset"
SAMPLE_RATE = 250.0
MEMORY = {"right model, noise of 0.2 s": 0.2, "right model, noise of 1 s": 1.0}  # [s]


class Case(NamedTuple):
    """A plant, the model that is fitted, and the effects either of which is right to name; none: nothing may be."""

    plant: str
    model: str
    right: tuple[str, ...]


CASES = {
    "right model, white noise": Case("plain", PLAIN, ()),
    "right model, noise of 0.2 s": Case("plain", PLAIN, ()),
    "right model, noise of 1 s": Case("plain", PLAIN, ()),
    "offset": Case("offset", "inertia,rotor,viscous,coulomb", ("constant",)),
    "viscous": Case("plain", "inertia,rotor,coulomb,offset", ("viscous friction", "degressive friction")),
    "coulomb": Case("plain", "inertia,rotor,viscous,offset", ("Coulomb friction", "pre-sliding")),
    "cube-root": Case("cube-root", PLAIN, ("degressive friction",)),
    "stribeck": Case("stribeck", PLAIN, ("Stribeck friction",)),
    "viscous-asymmetry": Case("viscous-asymmetry", PLAIN, ("friction by direction",)),
    "dahl": Case("dahl", PLAIN, ("pre-sliding",)),
    "load-coulomb": Case("load-coulomb", PLAIN, ("friction by load", "pre-sliding by load")),
    "load-dahl": Case("load-dahl", "inertia,rotor,viscous,dahl,offset", ("friction by load", "pre-sliding by load")),
    "rotor": Case("rotor", "inertia,viscous,coulomb,offset", ("rotor inertia",)),
    "coupling": Case("coupling", PLAIN, ("coupling with a neighbour",)),
    "spring": Case("spring", PLAIN, ("spring", "gravity-like shape")),
    "gas-spring": Case("gas-spring", PLAIN, ("gravity-like shape", "spring")),
    "delay of 12 ms": Case("delay", PLAIN, ("delay",)),
    "ripple": Case("ripple", PLAIN, ("ripple",)),
    "warm-up": Case("warm-up", PLAIN, ("warm-up", "temperature")),
    "drift": Case("drift", PLAIN, ("drift",)),
    "elasticity": Case("elastic", PLAIN, ("elasticity", "delay")),
    "backlash": Case("backlash", PLAIN, ("backlash", "elasticity")),
}


def plant_of(kind: str, robot: Robot, rng: np.random.Generator) -> TrueParameters:
    """A random plant; kinds that only the log shows are plain."""
    known = {"delay", "rotor", "ripple", "drift", "offset", "warm-up", "elastic", "backlash"}
    truth = typical_plant(robot, "plain" if kind in known else kind, rng=rng)
    everywhere = np.ones(robot.n_v)
    if kind == "offset":
        return replace(truth, offset=0.5 * truth.coulomb)
    if kind == "rotor":
        return replace(truth, rotor=5.0 * truth.rotor)
    if kind == "warm-up":
        heat = FrictionHeat(
            heating=0.2 * everywhere, time_constant=1e3 * everywhere, viscous=-0.03 * everywhere,
            coulomb=-0.03 * everywhere, initial=20.0 * everywhere,
        )  # fmt: skip
        return replace(truth, heat=heat)
    if kind in {"elastic", "backlash"}:
        gap = 0.0 if kind == "elastic" else 5e-3
        elastic = ElasticJoints(
            joints=tuple(range(robot.n_v)), stiffness=(300.0 if kind == "elastic" else 1e4) * everywhere,
            damping=5.0 * everywhere, gap=np.array(gap),
        )  # fmt: skip
        return replace(truth, elasticity=elastic)
    return truth


def changed(recording: Recording, kind: str, level: np.ndarray) -> Recording:
    """The recording with what sensors and motors add to it; `level` is each joint's typical torque, (n_v,)."""
    tau, q, t = recording.tau, recording.q, recording.t
    if kind == "ripple":
        return replace(recording, tau=tau + 0.05 * level * np.sin(7.0 * q + 0.4))
    if kind == "drift":
        return replace(recording, tau=tau + 0.05 * level * (t / t[-1])[:, None])
    if kind == "delay":
        late = np.column_stack([np.interp(t - 12e-3, t, column) for column in tau.T])
        return replace(recording, tau=late)
    return recording


def run(
    robot: Robot, kind: str, truth: TrueParameters, rng: np.random.Generator, options: argparse.Namespace
) -> Recording:
    motion = random_fourier(robot, period=options.seconds, harmonics=5, rng=rng)
    motor_side = Encoder(side="motor") if kind in {"elastic", "backlash"} else Encoder()
    settings = ExperimentSettings(control_rate=1000.0, sample_rate=SAMPLE_RATE, timestep=1e-3, encoder=motor_side)
    recording = simulate(robot, motion, rng=rng, parameters=truth, settings=settings).recording
    if truth.heat is not None:
        recording = replace(recording, temperature=None)
    return changed(recording, kind, recording.tau.std(axis=0))


def noisy(recording: Recording, rng: np.random.Generator, *, level: float, memory: float) -> Recording:
    """The recording with noise of a part of each joint's torque, white or of first order with this memory [s]."""
    size = level * np.sqrt(np.mean(recording.tau**2, axis=0))
    pole = np.exp(-1.0 / (memory * SAMPLE_RATE)) if memory else 0.0
    lead = round(10 * memory * SAMPLE_RATE)
    white = rng.standard_normal((recording.n_t + lead, recording.n_v))
    noise = lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], white, axis=0)[lead:]
    return replace(recording, tau=recording.tau + size * noise)


def tested(name: str, case: Case, robot: Robot, seed: int, options: argparse.Namespace) -> LogResiduals:
    rng = np.random.default_rng(1000 * list(CASES).index(name) + seed)
    truth = plant_of(case.plant, robot, rng)
    memory = MEMORY.get(name, 0.0)
    runs = [noisy(run(robot, case.plant, truth, rng, options), rng, level=options.noise, memory=memory) for _ in "ab"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)
        estimate = identify(torque_model(robot, case.model), runs[:1])
    return residual_tests(estimate, runs[1:])[0]


def summary(name: str, case: Case, robot: Robot, options: argparse.Namespace) -> dict[str, object]:
    logs = [tested(name, case, robot, seed, options) for seed in range(options.seeds)]
    missing = [[joint.missing for joint in log.joints] for log in logs]
    other = [effect.effect for log in missing for joint in log for effect in joint if effect.effect not in case.right]
    share = [max((effect.share for joint in log for effect in joint), default=0.0) for log in missing]
    return {
        "case": name,
        "seeds": options.seeds,
        "anything": float(np.mean([any(joint.missing or joint.changed for joint in log.joints) for log in logs])),
        "first": float(np.mean([any(j and j[0].effect in case.right for j in log) for log in missing])),
        "named": float(np.mean([any(e.effect in case.right for j in log for e in (*j,)) for log in missing])),
        "median_share": float(np.median(share)),
        "others": {effect: other.count(effect) for effect in sorted(set(other))},
        "changed": sum(len(joint.changed) for log in logs for joint in log.joints),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--robot", default="two_link")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--noise", type=float, default=0.03, help="of each joint's RMS torque")
    parser.add_argument("--only", default="", help="cases whose name contains this")
    options = parser.parse_args()
    robot = load_robot(options.robot)
    rows = []
    if not options.json:
        print(f"{'case':28} {'anything %':>10} {'first %':>8} {'named %':>8} {'share %':>8}  others named (joints)")
    for name, case in CASES.items():
        if options.only not in name:
            continue
        rows.append(summary(name, case, robot, options))
        if not options.json:
            show(rows[-1])
    if options.json:
        print(json.dumps(rows))


def show(row: dict[str, object]) -> None:
    figures = [100.0 * float(row[key]) for key in ("anything", "first", "named", "median_share")]
    first = " ".join(f"{value:{width}.0f}" for value, width in zip(figures, (10, 8, 8, 8), strict=True))
    others = ", ".join(f"{name} {count}" for name, count in row["others"].items())
    changed = f"; changed {row['changed']}" if row["changed"] else ""
    print(f"{row['case']:28} {first}  {others}{changed}", flush=True)


if __name__ == "__main__":
    main()
