"""Robots whose axes are parallel, perpendicular, meeting or coaxial as often as not, under any gravity."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from sample_arms import random_joint
from tauhat.robots import Robot

GRAVITIES = ((0.0, 0.0, 0.0), (0.0, 0.0, -9.81), (9.81, 0.0, 0.0), (0.0, 6.0, -6.0), (3.0, -5.0, 7.0))


def structured_arm(
    seed: int, n_v: int, *, gravity: tuple[float, ...], branching: float = 0.0, sliding: float = 0.3
) -> Robot:
    """Return an arm, or with `branching` a tree; one joint in five is skew."""
    rng = np.random.default_rng(seed)
    joints = []
    for index in range(n_v):
        parent = int(rng.integers(-1, index)) if index and rng.random() < branching else index - 1
        kind = "prismatic" if rng.random() < sliding else "revolute"
        turned = np.eye(3)[rng.permutation(3)]
        turned = turned * np.sign(np.linalg.det(turned))
        if rng.random() < 0.2:
            turned = Rotation.from_rotvec([0.7, -0.4, 0.5]).as_matrix() @ turned
        joint = random_joint(rng, index=index, parent=parent, kind=kind)
        place = rng.choice([0.0, 0.0, 0.3, -0.5], 3)
        axis = np.eye(3)[2 if rng.random() < 0.6 else rng.integers(3)]
        joints.append(replace(joint, rotation=turned, translation=place, axis=axis))
    return Robot(name="structured", joints=tuple(joints), gravity=np.array(gravity))
