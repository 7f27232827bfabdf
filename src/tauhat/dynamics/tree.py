"""The robot as the flat arrays that the kernels read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray, read_only
from tauhat.robots.robot import Robot


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KernelTree:
    """Constant geometry of a robot in kernel form.

    parents : (n_v,) -1 for the base
    prismatic : (n_v,) bool
    abc : (n_v, 3, 9) such that R(q) = abc[:, 0] + abc[:, 1] cos q + abc[:, 2] sin q, row-major
    place : (n_v, 3) joint origin in the parent frame at q = 0 [m]
    axis : (n_v, 3) joint axis in the joint frame
    gravity : (3,) [m/s^2]
    """

    parents: NDArray[np.int64]
    prismatic: NDArray[np.bool_]
    abc: FloatArray
    place: FloatArray
    axis: FloatArray
    gravity: FloatArray

    @property
    def geometry(self) -> tuple[NDArray[np.generic], ...]:
        """The leading arguments that every kernel takes."""
        return self.parents, self.prismatic, self.abc, self.place, self.axis, self.gravity


def kernel_tree(robot: Robot) -> KernelTree:
    """Return the robot's geometry as kernel arrays.

    Rodrigues: `Rot(e, q) = e e' + (E - e e') cos q + [e]x sin q`, premultiplied by the placement.
    """
    abc = np.zeros((robot.n_v, 3, 9))
    for index, joint in enumerate(robot.joints):
        along = np.outer(joint.axis, joint.axis)
        e0, e1, e2 = joint.axis
        cross = np.array([[0.0, -e2, e1], [e2, 0.0, -e0], [-e1, e0, 0.0]])
        parts = (along, np.eye(3) - along, cross) if joint.kind == "revolute" else (np.eye(3),)
        for k, part in enumerate(parts):
            abc[index, k] = (joint.rotation @ part).ravel()
    return KernelTree(
        parents=read_only(np.array(robot.parents, dtype=np.int64)),
        prismatic=read_only(np.array([joint.kind == "prismatic" for joint in robot.joints])),
        abc=read_only(abc),
        place=read_only(np.array([joint.translation for joint in robot.joints])),
        axis=read_only(np.array([joint.axis for joint in robot.joints])),
        gravity=read_only(np.array(robot.gravity)),
    )
