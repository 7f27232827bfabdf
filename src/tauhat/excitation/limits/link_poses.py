"""Where the links are along a motion, and how forces on them pull on the joints."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.robots.robot import Robot
from tauhat.robots.transforms import rotation_about


class LinkPoses(NamedTuple):
    """World poses of all links, samples before axes: what positions and their gradients are made of.

    rotation : (n_v, n_t, 3, 3)
    origin : (n_v, n_t, 3) of the joint frames [m]
    axis : (n_v, n_t, 3) unit vectors
    """

    rotation: FloatArray
    origin: FloatArray
    axis: FloatArray

    def point(self, link: int, place: FloatArray) -> FloatArray:
        """Return where a point of a link is, (n_t, 3), from its place in the link frame, (3,) [m]; -1 is the base."""
        if link < 0:
            return np.broadcast_to(place, self.origin.shape[1:])
        return np.asarray(self.origin[link] + self.rotation[link] @ place)


class Wrenches(NamedTuple):
    """Forces on links and their moments about the base's origin, to be added to.

    force, moment : (n_v, n_t, 3)
    """

    force: FloatArray
    moment: FloatArray

    def add(self, link: int, point: FloatArray, force: FloatArray) -> None:
        """Add a force (n_t, 3) at a point (n_t, 3) of a link; one on the base moves nothing."""
        if link >= 0:
            self.force[link] += force
            self.moment[link] += cross(point, force)


def link_poses(robot: Robot, q: FloatArray) -> LinkPoses:
    """Return the poses of all links at the positions q, (n_v, n_t) [rad or m]."""
    n_t = q.shape[1]
    poses = LinkPoses(np.empty((robot.n_v, n_t, 3, 3)), np.empty((robot.n_v, n_t, 3)), np.empty((robot.n_v, n_t, 3)))
    for index, joint in enumerate(robot.joints):
        turned = joint.rotation @ rotation_about(joint.axis, q[index]) if joint.kind == "revolute" else joint.rotation
        shifted: FloatArray = joint.translation
        if joint.kind == "prismatic":
            shifted = joint.translation + q[index][:, None] * (joint.rotation @ joint.axis)
        if joint.parent < 0:
            poses.rotation[index], poses.origin[index] = turned, shifted
        else:
            carrier = poses.rotation[joint.parent]
            poses.rotation[index] = carrier @ turned
            poses.origin[index] = poses.origin[joint.parent] + np.squeeze(
                carrier @ np.broadcast_to(shifted, (n_t, 3))[:, :, None], axis=2
            )
        poses.axis[index] = poses.rotation[index] @ joint.axis
    return poses


def no_wrenches(robot: Robot, n_t: int) -> Wrenches:
    """Return wrenches of zero."""
    return Wrenches(np.zeros((robot.n_v, n_t, 3)), np.zeros((robot.n_v, n_t, 3)))


def joint_forces(robot: Robot, poses: LinkPoses, wrenches: Wrenches) -> FloatArray:
    """Return what wrenches on the links do along the joints, (n_v, n_t): the gradient with respect to q.

    Principle of virtual work: `axis . (moment - origin x force)` of all that a revolute joint carries, `axis . force`
    of all that a prismatic one does.
    """
    force, moment = wrenches.force.copy(), wrenches.moment.copy()
    gradient = np.zeros(force.shape[:2])
    for index in range(robot.n_v - 1, -1, -1):
        joint, axis = robot.joints[index], poses.axis[index]
        along = force[index]
        if joint.kind == "revolute":
            along = moment[index] - cross(poses.origin[index], force[index])
        gradient[index] = dot(axis, along)
        if joint.parent >= 0:
            force[joint.parent] += force[index]
            moment[joint.parent] += moment[index]
    return gradient


def ancestors(robot: Robot, link: int) -> tuple[int, ...]:
    """Return the joints that move a link, from the base outwards."""
    chain: list[int] = []
    while link >= 0:
        chain.append(link)
        link = robot.joints[link].parent
    return tuple(reversed(chain))


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the cross products of rows, (..., 3)."""
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    u, v, w = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)


def dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the scalar products of rows, (...)."""
    return np.asarray(np.einsum("...i,...i->...", a, b))
