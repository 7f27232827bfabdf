"""Evidence of a known truth on random states, without recordings and filters between."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from tauhat.dynamics import BaseParameters, TorqueModel, base_parameters, torque_model
from tauhat.dynamics.base import random_motion
from tauhat.estimation import Evidence
from tauhat.estimation.block import Block
from tauhat.robots import Robot, load_robot
from tauhat.simulation.parameters import perturbed


@dataclass(frozen=True)
class Sample:
    """A model, the evidence of noisy torque, and the standard parameters that made it."""

    model: TorqueModel
    base: BaseParameters
    evidence: Evidence
    truth: np.ndarray


@lru_cache
def base_of(model: TorqueModel) -> BaseParameters:
    """Return the base parameters, worked out once for each model object."""
    return base_parameters(model)


@lru_cache
def plain_model(name: str) -> TorqueModel:
    """Return the plain model of a built-in arm."""
    return torque_model(load_robot(name))


def sampled(model: TorqueModel, truth: np.ndarray, *, noise: float, seed: int = 0, n_t: int = 400) -> Sample:
    """Return evidence on random states; `noise` in parts of each joint's torque."""
    base = base_of(model)
    rng = np.random.default_rng(seed)
    layout = model.layout(base.independent)
    columns, _ = model.columns(random_motion(model.robot, n_t, rng), layout)
    values = base.projection @ truth
    place = np.full(model.n_p, -1)
    place[base.independent] = np.arange(base.n_b)
    parts = [layout.of_joint(joint) for joint in range(model.robot.n_v)]
    supports = tuple(place[layout.parameters[part]] for part in parts)
    factors = []
    for part, support in zip(parts, supports, strict=True):
        torque = columns[part].T @ values[support]
        torque = torque + noise * torque.std() * rng.normal(size=n_t)
        factors.append(np.column_stack([columns[part].T, torque]))
    block = Block(factors=tuple(factors), n_t=n_t).reduced()
    return Sample(model, base, Evidence(supports=supports, n_b=base.n_b, blocks=(block,)), truth)


def plain_truth(robot: Robot, *, seed: int = 0, spread: float = 0.2) -> np.ndarray:
    """Return standard parameters of the plain model near the nominal ones, every link a body."""
    body = perturbed(robot, np.random.default_rng(seed), spread=spread)
    ones = np.ones(robot.n_v)
    return np.concatenate([body.inertia.ravel(), body.rotor + 0.1, 3.0 * ones, 5.0 * ones, 0.2 * ones])


@lru_cache
def arm(name: str, noise: float, seed: int = 0) -> Sample:
    """Return a built-in arm's evidence in the plain model."""
    model = plain_model(name)
    return sampled(model, plain_truth(model.robot, seed=seed), noise=noise, seed=seed)


def given(model: TorqueModel, values: np.ndarray, *, sharpness: float = 1.0, n_t: int = 1000) -> Sample:
    """Return evidence of one joint that says of its base parameters just `values`, each as sharply as the other."""
    base = base_parameters(model)
    factor = sharpness * np.column_stack([np.eye(base.n_b), values])
    factor = np.vstack([factor, np.zeros(base.n_b + 1)])
    factor[-1, -1] = np.sqrt(n_t)
    block = Block(factors=(factor,), n_t=n_t)
    evidence = Evidence(supports=(np.arange(base.n_b),), n_b=base.n_b, blocks=(block,))
    return Sample(model, base, evidence, values)
