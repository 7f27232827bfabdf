"""Which inertial parameters hardly load any joint, by the nominal masses of the description."""

from __future__ import annotations

import numpy as np

from tauhat.dynamics.base import random_motion
from tauhat.dynamics.rigid_body import inertial_columns
from tauhat.dynamics.terms import Inertia
from tauhat.dynamics.terms.simplified import PRODUCTS, InertiaWithoutProducts
from tauhat.dynamics.tree import kernel_tree
from tauhat.errors import ModelError
from tauhat.robots.robot import Robot

_SEED = 20240317
_STATES = 400


def without_small_terms(robot: Robot, *, part: float = 0.01) -> InertiaWithoutProducts:
    """Return the simplified term that also leaves out what, after the nominal inertias, hardly loads any joint.

    A parameter is small when its own part of the torque, root mean square over random states inside the limits, is at
    most `part` of the whole rigid torque on every joint.

    Raises
    ------
    ModelError
        when the description carries no masses, or `part` is not between 0 and 1.
    """
    if not robot.has_inertia:
        raise ModelError("which terms are small cannot be told without nominal masses", where=robot.name)
    if not 0.0 <= part < 1.0:
        raise ModelError("the part of the torque that counts as small is out of range", expected="0 to 1", got=part)
    motion = random_motion(robot, _STATES, np.random.default_rng(_SEED))
    torques = inertial_columns(kernel_tree(robot), motion) * robot.inertia.ravel()[:, None, None]
    whole = np.sqrt(np.mean(torques.sum(axis=0) ** 2, axis=1))
    sizes = np.sqrt(np.mean(torques**2, axis=2))
    small = (sizes <= part * whole).all(axis=1)
    names = [item.name for item, is_small in zip(Inertia().parameters(robot), small, strict=True) if is_small]
    return InertiaWithoutProducts(dropped=tuple(name for name in names if name.split("_")[0] not in PRODUCTS))
