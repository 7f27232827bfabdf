"""Homogeneous transforms and what they do to inertial parameters."""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.robots.joint import Joint, central_inertia, inertia_at_origin


def homogeneous(rotation: FloatArray, translation: FloatArray) -> FloatArray:
    """Return the (4, 4) transform with this rotation and translation [m]."""
    transform = np.eye(4)
    transform[:3, :3] = rotation
    transform[:3, 3] = translation
    return transform


def turn_x(angle: float) -> FloatArray:
    """Return the (4, 4) rotation about x by `angle` [rad]."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0, 0.0], [0.0, cosine, -sine, 0.0], [0.0, sine, cosine, 0.0], [0.0, 0.0, 0.0, 1.0]])


def turn_z(angle: float) -> FloatArray:
    """Return the (4, 4) rotation about z by `angle` [rad]."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, -sine, 0.0, 0.0], [sine, cosine, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


def shift(x: float, y: float, z: float) -> FloatArray:
    """Return the (4, 4) translation by `x, y, z` [m]."""
    return homogeneous(np.eye(3), np.array([x, y, z]))


def rotation_from_rpy(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Return the (3, 3) rotation `Rz(yaw) Ry(pitch) Rx(roll)`, URDF's fixed-axis angles [rad]."""
    cosine, sine = np.cos(pitch), np.sin(pitch)
    about_y = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
    rotation: FloatArray = turn_z(yaw)[:3, :3] @ about_y @ turn_x(roll)[:3, :3]
    return rotation


def rotation_about(axis: FloatArray, angle: FloatArray) -> FloatArray:
    """Return the (n_t, 3, 3) rotations about a unit `axis` (3,) by each `angle` (n_t,) [rad].

    Rodrigues' formula: `E + sin(angle) K + (1 - cos(angle)) K K`, with `K` the cross product matrix of the axis.
    """
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sine, versine = np.sin(angle)[:, None, None], (1.0 - np.cos(angle))[:, None, None]
    rotation: FloatArray = np.eye(3) + sine * cross + versine * (cross @ cross)
    return rotation


def quaternion(rotation: FloatArray) -> FloatArray:
    """Return the unit quaternion (w, x, y, z), w >= 0, of a rotation matrix.

    The squares of its parts follow from the diagonal; the largest part gives the others without loss.
    """
    trace = float(np.trace(rotation))
    squares = np.array([1.0 + trace, *(1.0 - trace + 2.0 * np.diag(rotation))])  # four times each part's square
    sums, differences = rotation + rotation.T, rotation - rotation.T
    turns = np.array([differences[2, 1], differences[0, 2], differences[1, 0]])
    products = np.block([[squares[0], turns], [turns[:, None], sums]])
    products[np.diag_indices(4)] = squares
    row = products[int(np.argmax(squares))]
    found = row / np.linalg.norm(row)
    return np.asarray(found if found[0] >= 0.0 else -found)


def rotation_vector(rotation: FloatArray) -> FloatArray:
    """Return the axis times the angle, at most pi, of a rotation matrix, (3,) [rad]."""
    scalar, *vector = quaternion(rotation)
    size = float(np.linalg.norm(vector))
    if size == 0.0:
        return np.zeros(3)
    return np.asarray(2.0 * np.arctan2(size, scalar) / size * np.array(vector))


def rotation_of_vector(vector: FloatArray) -> FloatArray:
    """Return the (3, 3) rotation about the axis of a vector by its length [rad]."""
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return np.eye(3)
    return np.asarray(rotation_about(vector / angle, np.array([angle]))[0])


def joint_pose(joint: Joint, position: float) -> FloatArray:
    """Return the (4, 4) pose of the joint's link frame in its parent's joint frame at `position` [rad or m]."""
    placement = homogeneous(joint.rotation, joint.translation)
    if joint.kind == "prismatic":
        return placement @ homogeneous(np.eye(3), position * joint.axis)
    return placement @ homogeneous(rotation_about(joint.axis, np.array([position]))[0], np.zeros(3))


def moved_inertia(parameters: FloatArray, pose: FloatArray) -> FloatArray:
    """Return ten inertial parameters given in a frame as seen from the frame in which it has the (4, 4) `pose`."""
    mass, com, inertia_at_com = central_inertia(parameters)
    rotation, translation = pose[:3, :3], pose[:3, 3]
    return inertia_at_origin(
        mass=mass, com=rotation @ com + translation, inertia_at_com=rotation @ inertia_at_com @ rotation.T
    )
