"""The force sensor's step and batch, against the same observer and wrench written with Pinocchio calls in Python.

    python benchmarks/sensing.py [--quick] [--json] [--robot NAME]

One step: momentum observer, wrench of six components and its covariance, for the seven joints of a Panda with viscous
and Coulomb friction, `advance` called from Python sample by sample as a control loop would. The peer does the same with
`crba`, `computeCoriolisMatrix`, `computeGeneralizedGravity`, `computeFrameJacobian` and NumPy, the filter and the
observer in the same exact discrete form, so that both give the same numbers: the largest difference is printed. Aim:
median <= 15 us, 99.9 % < 100 us. On a machine that is busy with other work the wall clock holds their turns too; the
processor time of the thread beside it does not. Then one hour at 1 kHz in one call, on one thread: aim 60 s on two cores.
`--quick`: a minute in place of the hour.
"""

from __future__ import annotations

import argparse
import gc
import json
import resource
import time
from collections.abc import Callable

import numpy as np
import pinocchio as pin

from tauhat.dynamics.passive_kernel import ELEMENT, SIGN, VISCOUS, joint_elements
from tauhat.recordings import Recording
from tauhat.robots import load_robot, pinocchio_model
from tauhat.sensing import ForceSensor, SensedModel
from tauhat.sensing.causal_filter import CausalFilter

RATE, STEPS = 1000.0, 20_000
LEVELS = (0.5, 0.999, 1.0)
WIDTH, LARGEST = 0.02, np.repeat([300.0, 60.0], 3)


def arm(name: str) -> SensedModel:
    robot = load_robot(name)
    n_v = robot.n_v
    sliding = [(VISCOUS, j, 1.0, 2.0) for j in range(n_v)] + [(SIGN, j, WIDTH, 3.0) for j in range(n_v)]
    return SensedModel(
        robot=robot, inertia=robot.inertia, rotor=np.full(n_v, 0.3), sliding=joint_elements(sliding),
        bristles=np.zeros(0, dtype=ELEMENT), rms=np.full(n_v, 0.5), slow=np.full(n_v, 0.02),
    )  # fmt: skip


def motion(n_t: int, n_v: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return positions of a smooth motion, and torques of about the right size; what they are does not change the time."""
    t = np.arange(n_t) / RATE
    rng = np.random.default_rng(seed)
    q, tau = np.empty((n_t, n_v)), np.empty((n_t, n_v))
    for j in range(n_v):
        phase, speed = rng.uniform(0.0, 6.0), rng.uniform(0.5, 1.5)
        q[:, j] = 0.6 * np.sin(speed * t + phase)
        tau[:, j] = 10.0 * np.cos(speed * t + phase)
    return q, tau


def peer(model: SensedModel) -> Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, ...]]:
    """Return the same sensor as a closure over Pinocchio."""
    pinned = pinocchio_model(model.robot)
    data, n_v, h = pinned.createData(), model.n_v, 1.0 / RATE
    frame = pinned.getFrameId(model.robot.frames[-1].name)
    axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    numbers = CausalFilter(cutoff=10.0, step=h).numbers
    phi, before, now = numbers[:4].reshape(2, 2), numbers[4:6, None], numbers[6:8, None]
    kept, weight = np.exp(-20.0 * h), 1.0 / np.square(model.rms)
    prior = np.diag(1.0 / LARGEST**2)
    state: dict[str, np.ndarray] = {}

    def step(q: np.ndarray, tau: np.ndarray) -> tuple[np.ndarray, ...]:
        if not state:
            zero = np.zeros(n_v)
            state.update(q=q, tau=tau, y=np.stack([q, zero]), T=np.stack([tau, zero]), r=zero)
        y = state["y"] = phi @ state["y"] + before * state["q"] + now * q
        T = state["T"] = phi @ state["T"] + before * state["tau"] + now * tau
        state["q"], state["tau"] = q, tau
        mass = pin.crba(pinned, data, y[0])
        coriolis = pin.computeCoriolisMatrix(pinned, data, y[0], y[1])
        gravity = pin.computeGeneralizedGravity(pinned, data, y[0])
        p = mass @ y[1] + model.rotor @ y[1]
        drive = T[0] + coriolis.T @ y[1] - gravity - 2.0 * y[1] - 3.0 * np.tanh(y[1] / WIDTH)
        e = (p - state.get("p", p)) / h - 0.5 * (drive + state.get("drive", drive))
        state["p"], state["drive"] = p, drive
        r = state["r"] = kept * state["r"] + (1.0 - kept) * e
        jacobian = pin.computeFrameJacobian(pinned, data, y[0], frame, axes)
        covariance = np.linalg.inv((jacobian * weight) @ jacobian.T + prior)
        return r, covariance @ (jacobian @ (weight * r)), covariance

    return step


def times(step: Callable[[np.ndarray, np.ndarray], object], q: np.ndarray, tau: np.ndarray) -> dict[str, float]:
    """Return median and high quantiles of a call [us]; garbage is collected before, not between.

    By the clock on the wall, and by the processor time of the thread, which other programs do not lengthen.
    """
    for k in range(200):
        step(q[k], tau[k])
    found = {}
    for name, clock in (("wall", time.perf_counter_ns), ("processor", time.thread_time_ns)):
        taken = np.empty(len(q))
        gc.collect()
        gc.disable()
        for k in range(len(q)):
            begin = clock()
            step(q[k], tau[k])
            taken[k] = clock() - begin
        gc.enable()
        found |= dict(
            zip(
                (f"{name}_median", f"{name}_999", f"{name}_largest"),
                np.quantile(taken / 1e3, LEVELS).tolist(),
                strict=True,
            )
        )
    return found


def stepping(model: SensedModel) -> dict[str, object]:
    q, tau = motion(STEPS, model.n_v)
    sensor = ForceSensor(model=model, rate=RATE)
    memory = sensor.start()

    def ours(position: np.ndarray, torque: np.ndarray) -> object:
        nonlocal memory
        memory, sensed = sensor.advance(memory, position, torque)
        return sensed

    def apart() -> float:
        own, other = sensor.start(), peer(model)
        found = []
        for k in range(2000):
            own, sensed = sensor.advance(own, q[k], tau[k])
            found.append(np.abs(sensed.tau - other(q[k], tau[k])[0]).max() / np.abs(sensed.tau).max())
        return float(max(found[1:]))

    return {"difference": apart(), "ours": times(ours, q, tau), "pinocchio": times(peer(model), q, tau)}


def batch(model: SensedModel, seconds: float) -> dict[str, float]:
    n_t = int(seconds * RATE)
    q, tau = motion(n_t, model.n_v)
    recording = Recording(t=np.arange(n_t) / RATE, q=q, tau=tau)
    del q, tau
    sensor = ForceSensor(model=model, rate=RATE)
    sensor.along(recording.rows(0, 100))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    begin, used = time.perf_counter(), time.process_time()
    found = sensor.along(recording)
    wall, used = time.perf_counter() - begin, time.process_time() - used
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {
        "seconds_of_log": seconds, "samples": found.n_t, "wall_s": wall, "processor_s": used,
        "us_per_sample": 1e6 * wall / n_t, "recording_mb": 8 * 15 * n_t / 1e6, "more_mb": (peak - before) / 1024,
        "peak_mb": peak / 1024,
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a minute in place of the hour")
    parser.add_argument("--json", action="store_true", help="one JSON document")
    parser.add_argument("--robot", default="panda")
    options = parser.parse_args()
    model = arm(options.robot)
    result = {"step": stepping(model), "batch": batch(model, 60.0 if options.quick else 3600.0)}
    if options.json:
        print(json.dumps(result, indent=1))
        return
    step, whole = result["step"], result["batch"]
    print(f"{'one step with wrench and covariance':38} {'median us':>10} {'99.9 % us':>10} {'largest us':>11}")
    for name in ("ours", "pinocchio"):
        for clock in ("wall", "processor"):
            row = [step[name][f"{clock}_{quantile}"] for quantile in ("median", "999", "largest")]
            print(f"{name + ', ' + clock + ' time':38} {row[0]:10.1f} {row[1]:10.1f} {row[2]:11.1f}")
    print(f"largest difference of torque between both: {step['difference']:.1e} of it\n")
    print(
        f"{whole['samples']} samples ({whole['seconds_of_log']:.0f} s at 1 kHz): {whole['wall_s']:.1f} s, "
        f"{whole['us_per_sample']:.2f} us a sample, one thread; memory beside the recording's "
        f"{whole['recording_mb']:.0f} MB: {whole['more_mb']:.0f} MB, peak {whole['peak_mb']:.0f} MB"
    )


if __name__ == "__main__":
    main()
