"""Poses of frames, and the same robot as a Pinocchio model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tauhat.arrays import FloatArray, frozen, read_only
from tauhat.errors import ArrayError, RobotError
from tauhat.robots.joint import Joint, central_inertia
from tauhat.robots.naming import advice_on_name
from tauhat.robots.robot import Frame, Robot
from tauhat.robots.transforms import rotation_about


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pose:
    """Where a frame is, in the base frame: at one position, or at each of n_t.

    rotation : (3, 3) or (n_t, 3, 3)
    translation : (3,) or (n_t, 3) [m]
    """

    rotation: FloatArray
    translation: FloatArray


def forward_kinematics(robot: Robot, q: ArrayLike, *, frame: str) -> Pose:
    """Return the pose of a named frame in the base frame.

    Parameters
    ----------
    q : (n_v,) or (n_t, n_v) [rad or m]
    frame : name of one of `robot.frames`, or of a joint for that joint's own frame

    Raises
    ------
    RobotError
        no frame of that name.
    ArrayError
        `q` of the wrong shape or not finite.
    """
    target = named_frame(robot, frame)
    single = _depth(q, robot) == 1
    batch = frozen("q", [q] if single else q, (None, robot.n_v), where=robot.name)
    rotation = np.broadcast_to(target.rotation, (len(batch), 3, 3))
    translation = np.broadcast_to(target.translation, (len(batch), 3))
    index = target.joint
    while index >= 0:
        joint = robot.joints[index]
        turned, shifted = _joint_motion(joint, batch[:, index])
        rotation, translation = turned @ rotation, shifted + np.einsum("tij,tj->ti", turned, translation)
        index = joint.parent
    rotation, translation = np.array(rotation), np.array(translation)
    if single:
        rotation, translation = rotation[0], translation[0]
    return Pose(rotation=read_only(rotation), translation=read_only(translation))


def _depth(q: ArrayLike, robot: Robot) -> int:
    expected = f"({robot.n_v},) or (n_t, {robot.n_v})"
    try:
        depth = np.ndim(q)
    except ValueError as error:
        raise ArrayError("q is not an array of numbers", where=robot.name, expected=expected) from error
    if depth not in {1, 2}:
        raise ArrayError("q has the wrong shape", where=robot.name, expected=expected, got=np.shape(q))
    return depth


def named_frame(robot: Robot, name: str) -> Frame:
    """Return one of `robot.frames`, or a joint's own frame, by its name.

    Raises
    ------
    RobotError
        no frame of that name.
    """
    frames = {joint.name: _joint_frame(index, joint) for index, joint in enumerate(robot.joints)}
    frames |= {frame.name: frame for frame in robot.frames}
    if name not in frames:
        raise RobotError("no such frame", where=robot.name, got=name, remedy=advice_on_name(name, frames))
    return frames[name]


def _joint_frame(index: int, joint: Joint) -> Frame:
    return Frame(name=joint.name, joint=index, rotation=np.eye(3), translation=np.zeros(3))


def _joint_motion(joint: Joint, position: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return rotations (n_t, 3, 3) and translations (n_t, 3) of a joint's link frame in its parent's."""
    if joint.kind == "revolute":
        turned = joint.rotation @ rotation_about(joint.axis, position)
        return turned, np.broadcast_to(joint.translation, (len(position), 3))
    shifted = joint.translation + np.outer(position, joint.rotation @ joint.axis)
    return np.broadcast_to(joint.rotation, (len(position), 3, 3)), shifted


def pinocchio_model(robot: Robot) -> Any:
    """Return the robot as a `pinocchio.Model`: rigid links, joint order, limits, frames and gravity.

    Rotor inertia and friction are left out: they are terms of a torque model, not of the rigid body.
    """
    import pinocchio

    model = pinocchio.Model()
    model.name = robot.name
    model.gravity.linear = np.array(robot.gravity)
    for joint in robot.joints:
        revolute = joint.kind == "revolute"
        kind = pinocchio.JointModelRevoluteUnaligned if revolute else pinocchio.JointModelPrismaticUnaligned
        placement = pinocchio.SE3(np.array(joint.rotation), np.array(joint.translation))
        index = model.addJoint(joint.parent + 1, kind(np.array(joint.axis)), placement, joint.name)
        mass, com, inertia_at_com = central_inertia(joint.inertia)
        model.appendBodyToJoint(index, pinocchio.Inertia(mass, com, inertia_at_com), pinocchio.SE3.Identity())
    for frame in robot.frames:
        placement = pinocchio.SE3(np.array(frame.rotation), np.array(frame.translation))
        model.addFrame(pinocchio.Frame(frame.name, frame.joint + 1, placement, pinocchio.FrameType.OP_FRAME))
    model.lowerPositionLimit, model.upperPositionLimit = robot.lower, robot.upper
    model.velocityLimit, model.effortLimit = robot.velocity_limit, robot.effort_limit
    return model
