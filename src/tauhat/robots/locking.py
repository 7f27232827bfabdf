"""Freezing joints at a position: a gripper's fingers, an axis that stands still."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace
from numbers import Real

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import RobotError, TauhatWarning
from tauhat.robots.joint import Joint
from tauhat.robots.naming import advice_on_name
from tauhat.robots.robot import Frame, Robot
from tauhat.robots.transforms import homogeneous, joint_pose, moved_inertia


def lock_joints(robot: Robot, positions: Mapping[str, float]) -> Robot:
    """Return the robot with some joints frozen; their links become part of the link that carries them.

    Parameters
    ----------
    positions : joint name -> position at which it is frozen [rad or m]

    Raises
    ------
    RobotError
        no joint of that name, or a position that is not finite.
    """
    if not positions:
        return robot
    _check_positions(robot, positions)
    carriers, poses = _rigid_groups(robot, positions)
    inertia = _merged_inertia(robot, carriers, poses)
    kept = [index for index, joint in enumerate(robot.joints) if joint.name not in positions]
    new_index = {-1: -1} | {old: new for new, old in enumerate(kept)}
    joints = []
    for index in kept:
        joint = robot.joints[index]
        placement = poses[joint.parent] @ homogeneous(joint.rotation, joint.translation)
        parent = new_index[carriers[joint.parent]]
        joints.append(_placed(joint, placement, parent, inertia[index]))
    frames = []
    for frame in robot.frames:
        pose = poses[frame.joint] @ homogeneous(frame.rotation, frame.translation)
        moved = {"rotation": pose[:3, :3], "translation": pose[:3, 3]}
        frames.append(Frame(name=frame.name, joint=new_index[carriers[frame.joint]], **moved))
    return replace(robot, joints=tuple(joints), frames=tuple(frames))


def _check_positions(robot: Robot, positions: Mapping[str, object]) -> None:
    joints = {joint.name: joint for joint in robot.joints}
    for name, position in positions.items():
        if name not in joints:
            advice = advice_on_name(str(name), joints)
            raise RobotError("no movable joint to lock", where=robot.name, got=name, remedy=advice)
        if not isinstance(position, Real) or not np.isfinite(float(position)):
            raise RobotError("locked at a position that is not a finite number", where=f"joint {name}", got=position)
        limits = joints[name].limits
        if not limits.lower <= float(position) <= limits.upper:
            message = (
                f"{name} is locked at {float(position):g}, outside its limits [{limits.lower:g}, {limits.upper:g}]"
            )
            warnings.warn(message, TauhatWarning, stacklevel=3)


def _rigid_groups(robot: Robot, positions: Mapping[str, float]) -> tuple[dict[int, int], dict[int, FloatArray]]:
    """Return, per joint, the still movable joint that carries its link (-1: base) and the link's pose on it."""
    carriers, poses = {-1: -1}, {-1: np.eye(4)}
    for index, joint in enumerate(robot.joints):
        if joint.name in positions:
            carriers[index] = carriers[joint.parent]
            poses[index] = poses[joint.parent] @ joint_pose(joint, positions[joint.name])
        else:
            carriers[index], poses[index] = index, np.eye(4)
    return carriers, poses


def _merged_inertia(robot: Robot, carriers: Mapping[int, int], poses: Mapping[int, FloatArray]) -> FloatArray:
    merged = np.zeros((robot.n_v, 10))
    for index, joint in enumerate(robot.joints):
        if carriers[index] == index:
            merged[index] += joint.inertia
        elif carriers[index] >= 0:
            merged[carriers[index]] += moved_inertia(joint.inertia, poses[index])
    return merged


def _placed(joint: Joint, placement: FloatArray, parent: int, inertia: FloatArray) -> Joint:
    return replace(joint, rotation=placement[:3, :3], translation=placement[:3, 3], parent=parent, inertia=inertia)
