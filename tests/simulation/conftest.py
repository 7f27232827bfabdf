"""Robots for simulated experiments: random geometry, physical links, friction."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tauhat.robots.joint import Joint, Limits, inertia_at_origin
from tauhat.robots.robot import Robot


def random_rotation(rng: np.random.Generator) -> np.ndarray:
    orthogonal = np.linalg.qr(rng.standard_normal((3, 3))).Q
    return orthogonal * np.sign(np.linalg.det(orthogonal))


def random_link(rng: np.random.Generator, mass: float) -> np.ndarray:
    root = 0.06 * rng.standard_normal((3, 3))
    second = mass * (root @ root.T + 1e-3 * np.eye(3))
    central = np.trace(second) * np.eye(3) - second
    return inertia_at_origin(mass=mass, com=0.1 * rng.standard_normal(3), inertia_at_com=central)


@pytest.fixture
def make_robot() -> Callable[..., Robot]:
    """A robot of random geometry: a chain, or the tree that `parents` says; `friction` scales viscous and Coulomb."""

    def make(seed: int = 0, *, parents: tuple[int, ...] = (-1, 0, 1, 2, 3, 4), **options: Any) -> Robot:
        rng = np.random.default_rng(seed)
        prismatic, friction = options.get("prismatic", ()), options.get("friction", 1.0)
        limits = Limits(lower=-2.0, upper=2.0, velocity=2.0, effort=options.get("effort", 300.0))
        joints = []
        for index, parent in enumerate(parents):
            axis = rng.standard_normal(3)
            size = 1.0 / (index + 1)
            joints.append(
                Joint(
                    name=f"axis {index}",
                    kind="prismatic" if index in prismatic else "revolute",
                    parent=parent,
                    rotation=random_rotation(rng),
                    translation=0.2 * rng.standard_normal(3),
                    axis=axis / np.linalg.norm(axis),
                    inertia=random_link(rng, 0.5 + 4.0 * size),
                    limits=limits,
                    rotor_inertia=0.4 * size,
                    viscous=3.0 * friction * size,
                    coulomb=6.0 * friction * size,
                )
            )
        return Robot(name="arm", joints=tuple(joints), gravity=np.array([1.0, -2.0, -9.0]))

    return make
