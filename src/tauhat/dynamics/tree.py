"""The robot as the one array that the kernels read: a record a link.

One structured array rather than an array a quantity: a kernel hands one argument inward, and counts one reference.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import read_only
from tauhat.robots.robot import Robot

LINK = np.dtype(
    [
        ("parent", np.int64),
        ("prismatic", np.bool_),
        ("abc", np.float64, (3, 9)),
        ("place", np.float64, (3,)),
        ("axis", np.float64, (3,)),
        ("gravity", np.float64, (3,)),
    ],
    align=True,
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KernelTree:
    """Constant geometry of a robot in kernel form.

    links : (n_v,) of LINK, whose fields are
        parent : -1 for the base
        prismatic : whether the joint slides
        abc : (3, 9) such that R(q) = abc[0] + abc[1] cos q + abc[2] sin q, row-major
        place : (3,) joint origin in the parent frame at q = 0 [m]
        axis : (3,) joint axis in the joint frame
        gravity : (3,) in the base frame, the same of every link [m/s^2]
    """

    links: NDArray[np.void]


def kernel_tree(robot: Robot) -> KernelTree:
    """Return the robot's geometry as kernels read it.

    Rodrigues: `Rot(e, q) = e e' + (E - e e') cos q + [e]x sin q`, premultiplied by the placement.
    """
    links = np.zeros(robot.n_v, dtype=LINK)
    for index, joint in enumerate(robot.joints):
        along = np.outer(joint.axis, joint.axis)
        e0, e1, e2 = joint.axis
        cross = np.array([[0.0, -e2, e1], [e2, 0.0, -e0], [-e1, e0, 0.0]])
        parts = (along, np.eye(3) - along, cross) if joint.kind == "revolute" else (np.eye(3),)
        for k, part in enumerate(parts):
            links["abc"][index, k] = (joint.rotation @ part).ravel()
    links["parent"] = robot.parents
    links["prismatic"] = [joint.kind == "prismatic" for joint in robot.joints]
    links["place"] = [joint.translation for joint in robot.joints]
    links["axis"] = [joint.axis for joint in robot.joints]
    links["gravity"] = robot.gravity
    return KernelTree(links=read_only(links))
