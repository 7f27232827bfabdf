"""Physically consistent fits on synthetic evidence, and what a body is, straight from the definitions."""

from __future__ import annotations

import numpy as np

from synthetic_evidence import Sample
from tauhat.dynamics import torque_model
from tauhat.dynamics.model import TorqueModel
from tauhat.estimation import (
    ConsistentSolution,
    EntropicPull,
    GaussianPull,
    PhysicalConstraints,
    WeightedLeastSquares,
    consistent,
)
from tauhat.estimation.consistency_problem import ConsistencyProblem, consistency_problem
from tauhat.robots import Joint, Robot

PULLS = (GaussianPull(), EntropicPull())


def solved(sample: Sample, constraints: PhysicalConstraints | None = None) -> ConsistentSolution:
    weights = WeightedLeastSquares().solve(sample.evidence).weights
    return consistent(sample.evidence, sample.model, sample.base, weights=weights, constraints=constraints)


def problem(sample: Sample, constraints: PhysicalConstraints) -> ConsistencyProblem:
    weights = WeightedLeastSquares().solve(sample.evidence).weights
    return consistency_problem(sample.evidence, sample.model, sample.base, weights=weights, constraints=constraints)


def second_moments(parameters: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Return mass, centre and the second moments of mass about the centre, straight from their definitions."""
    mass, centre = parameters[0], parameters[1:4] / parameters[0]
    xx, xy, yy, xz, yz, zz = parameters[4:]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    about_origin = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    return float(mass), centre, about_origin - mass * np.outer(centre, centre)


def assert_physical(sample: Sample, standard: np.ndarray) -> None:
    n_v = sample.model.robot.n_v
    for body in standard[: 10 * n_v].reshape(-1, 10):
        mass, _, moments = second_moments(body)
        assert mass > 0
        assert np.linalg.eigvalsh(moments).min() > 0
    assert standard[10 * n_v : 13 * n_v].min() >= 0  # rotor inertia, viscous and Coulomb friction


def pendulum(mass: float = 1.0) -> TorqueModel:
    """Return one link on a joint about z with gravity across: base parameters Izz, mx, my."""
    inertia = np.array([mass, 0.1, 0.0, 0.0, 0.2, 0.0, 0.2, 0.0, 0.0, 0.3])
    joint = Joint(
        name="swing", kind="revolute", parent=-1, rotation=np.eye(3), translation=np.zeros(3),
        axis=np.array([0.0, 0.0, 1.0]), inertia=inertia,
    )  # fmt: skip
    return torque_model(Robot(name="pendulum", joints=(joint,), gravity=np.array([0.0, -9.81, 0.0])), "inertia")
