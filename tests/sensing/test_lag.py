"""The observer is late: the wrench is solved where the arm was then, and what changed since is in its error."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
import pinocchio
import pytest
from scipy.signal import lfilter
from sensed_arms import frictionless

from tauhat.recordings import Recording
from tauhat.robots.kinematics import pinocchio_model
from tauhat.sensing import OBSERVERS, ForceSensor, SensedLog, SensedWrench, WrenchSolver, observer_named

RATE, SECONDS = 500.0, 6.0
ERROR, MEMORY = 0.5, 0.3  # of the model [Nm], and how long it is alike [s]
T = np.arange(int(SECONDS * RATE)) / RATE
MODELS = {name: replace(frictionless(name), rms=np.full(frictionless(name).n_v, ERROR)) for name in ("ur5e", "panda")}


class Fast(NamedTuple):
    """A log of a fast motion in which something pushes, (n_t, 6), and what a sensor makes of it."""

    sensed: SensedLog
    wrench: np.ndarray


def motion(rng: np.random.Generator, n_v: int, pace: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return position, velocity and acceleration of sines about a random place; pace 2 means up to 4 rad/s."""
    q, dq, ddq = (np.zeros((T.size, n_v)) for _ in range(3))
    for k in (1, 2, 3):
        size, phase = rng.uniform(-0.6, 0.6, n_v) / k, rng.uniform(0.0, 6.0, n_v)
        rate = pace * k * rng.uniform(0.7, 1.3, n_v)
        swing = rate * T[:, None] + phase
        q, dq = q + size * np.sin(swing), dq + size * rate * np.cos(swing)
        ddq = ddq - size * rate**2 * np.sin(swing)
    return q + rng.uniform(-1.2, 1.2, n_v), dq, ddq


def pushes(rng: np.random.Generator, constant: bool) -> np.ndarray:
    sizes = np.repeat([25.0, 2.0], 3)
    if constant:
        return np.tile(sizes * rng.normal(size=6), (T.size, 1))
    wrench = np.zeros((T.size, 6))
    for start in np.arange(1.0, SECONDS, 1.2):
        rising, falling = (T - start) / 0.15, (start + 0.8 - T) / 0.15
        wrench += (np.clip(rising, 0.0, 1.0) * np.clip(falling, 0.0, 1.0))[:, None] * sizes * rng.normal(size=6)
    return wrench


@cache
def sensed(name: str, seed: int, *, constant: bool, pace: float = 2.0, observer: str = "momentum") -> Fast:
    model, rng = MODELS[name], np.random.default_rng(seed)
    state, wrench = motion(rng, model.n_v, pace), pushes(rng, constant)
    pinned, solver = pinocchio_model(model.robot), WrenchSolver(robot=model.robot)
    data = pinned.createData()
    free = np.array([pinocchio.rnea(pinned, data, *row) for row in zip(*state, strict=True)])
    external = np.array([solver.jacobian(q)[0].T @ w for q, w in zip(state[0], wrench, strict=True)])
    kept = np.exp(-1.0 / RATE / MEMORY)
    error = lfilter([ERROR * np.sqrt(1.0 - kept**2)], [1.0, -kept], rng.normal(size=external.shape), axis=0)
    log = Recording(t=T, q=state[0], tau=free - external + error)
    return Fast(ForceSensor(model=model, rate=RATE, observer=observer_named(observer)).along(log), wrench)


def force_errors(runs: list[Fast]) -> tuple[np.ndarray, np.ndarray]:
    """Return errors of the force and their size in standard errors, behind the first second."""
    late = T > 1.0
    errors = np.concatenate([(run.sensed.wrench - run.wrench)[late, :3] for run in runs])
    return errors, errors / np.concatenate([run.sensed.wrench_std[late, :3] for run in runs])


def at_once(run: Fast, name: str) -> SensedWrench:
    """Return the wrench solved at the position behind the filter alone, without the lag in its variance."""
    own = run.sensed
    passed = own.q + np.gradient(own.q, 1.0 / RATE, axis=0) / 20.0  # undoes a low-pass of first order at 20 1/s
    solver = WrenchSolver(robot=MODELS[name].robot)
    return solver.along(passed, own.tau, np.square(own.tau_std))


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("constant", [True, False])
def test_in_fast_motion_error_bars_contain_the_force(name, constant):
    _, parts = force_errors([sensed(name, seed, constant=constant) for seed in range(4)])
    inside = float(np.mean(np.abs(parts) < 1.96))
    assert inside > (0.95 if constant else 0.91)


@pytest.mark.parametrize("observer", [name for name in OBSERVERS if name not in {"momentum", "thermal"}])
def test_with_every_observer_error_bars_contain_the_force(observer):
    _, parts = force_errors([sensed("ur5e", seed, constant=True, observer=observer) for seed in range(2)])
    assert np.mean(np.abs(parts) < 1.96) > 0.93


def test_solving_where_the_arm_was_is_better_than_where_it_is():
    runs = [sensed("panda", seed, constant=True) for seed in range(4)]
    errors, parts = force_errors(runs)
    once = [at_once(run, "panda") for run in runs]
    others = [replace(r.sensed, wrench=o.wrench, wrench_std=o.standard_errors) for r, o in zip(runs, once, strict=True)]
    plain = [Fast(sensed=o, wrench=r.wrench) for r, o in zip(runs, others, strict=True)]
    worse, missed = force_errors(plain)
    assert np.sqrt(np.mean(errors**2)) < np.sqrt(np.mean(worse**2))
    assert np.mean(np.abs(missed) < 1.96) < 0.92
    assert np.mean(np.abs(parts) < 1.96) > 0.95
    assert np.quantile(np.abs(missed), 0.999) > 2.0 * np.quantile(np.abs(parts), 0.999)


def test_nothing_is_blown_up_near_singularities():
    for name in MODELS:
        runs = [sensed(name, seed, constant=constant) for seed in range(4) for constant in (True, False)]
        errors, _ = force_errors(runs)
        assert np.abs(errors).max() < 300.0
        assert np.quantile(np.abs(errors), 0.5) < 10.0


def test_what_changed_within_the_lag_is_in_the_wrench_and_not_in_the_torque():
    run = sensed("ur5e", 0, constant=False).sensed
    grown = np.abs(run.lag).max(axis=1)
    during, calm = grown > 1.0, grown < 0.1
    assert during.any()
    assert calm.any()
    settled = T > 1.0
    assert run.tau_std[settled].max() < 1.1 * ERROR
    solver = WrenchSolver(robot=MODELS["ur5e"].robot)
    without = solver.along(run.q, run.tau, np.square(run.tau_std)).standard_errors
    assert (run.wrench_std[during & settled] >= without[during & settled] - 1e-9).all()
    grown_bar = (run.wrench_std / without)[during & settled].max(axis=1)
    assert np.median(grown_bar) > 1.5  # all but where joints tell nothing and the largest wrench is the bar
    assert run.wrench_std[calm & settled] == pytest.approx(without[calm & settled], rel=0.1)
