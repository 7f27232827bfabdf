"""Modified Denavit-Hartenberg frames of any robot, whatever frames its description came in."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.robots.joint import Joint, JointKind
from tauhat.robots.robot import Frame, Robot
from tauhat.robots.transforms import homogeneous, moved_inertia, shift, turn_x, turn_z

PARALLEL = 1e-5  # [rad] axes closer than this are taken as parallel: 1.5708 for pi/2 is a rounded right angle
_COAXIAL = 1e-10  # [m] parallel axes closer than this have no common normal of their own


@dataclass(frozen=True, slots=True, kw_only=True)
class ModifiedDhRow:
    """One joint: how its DH frame lies in its parent's.

    At q = 0 the pose is `RotZ(gamma) TransZ(epsilon) RotX(alpha) TransX(a) RotZ(theta) TransZ(d)`. `gamma`
    and `epsilon` are zero unless the parent is the base or carries another joint before this one. The position adds to
    `theta` on a revolute joint and to `d` on a prismatic one.

    parent : index of the row it hangs on, -1 for the base
    gamma, alpha, theta : [rad]
    epsilon, a, d : [m]
    """

    name: str
    kind: JointKind
    parent: int
    gamma: float
    epsilon: float
    alpha: float
    a: float
    theta: float
    d: float

    @property
    def placement(self) -> FloatArray:
        """Pose (4, 4) of the joint's DH frame in its parent's at q = 0."""
        hand_over = turn_z(self.gamma) @ shift(0.0, 0.0, self.epsilon)
        return np.asarray(hand_over @ _entry(self.alpha, self.a) @ turn_z(self.theta) @ shift(0.0, 0.0, self.d))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModifiedDh:
    """The modified DH description of a robot.

    rows : one a joint, in the robot's order
    links : (n_v, 4, 4) pose of each joint's own frame in its DH frame, constant
    tilt : largest angle between axes that was rounded off to make them parallel [rad]
    """

    rows: tuple[ModifiedDhRow, ...]
    links: FloatArray
    tilt: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "links", frozen("links", self.links, (len(self.rows), 4, 4)))


class _Normal(NamedTuple):
    """How to get from a frame to an axis: turn and shift along z to the common normal, then along it, and the tilt."""

    gamma: float
    epsilon: float
    alpha: float
    a: float
    tilt: float


def modified_dh(robot: Robot, *, parallel: float = PARALLEL) -> ModifiedDh:
    """Return the modified DH frames of a serial arm or a tree, with the robot's own frames placed in them.

    Every DH frame is fixed to its link: z along the joint's axis, x along the common normal to the axis of the next
    joint it carries. Where that normal is not unique the free numbers are zero: `d` between parallel axes, `theta` too
    between coaxial ones. On a tree the first joint that a link carries fixes its frame, the others are reached by
    `gamma` and `epsilon`.

    Parameters
    ----------
    parallel : axes closer than this are taken as parallel [rad]; the frames are then true to this angle (`tilt`)

    Source: Khalil, Kleinfinger, "A new geometric notation for open and closed-loop robots", 1986.
    """
    own = _poses_at_zero(robot)
    first = {joint.parent: index for index, joint in reversed(list(enumerate(robot.joints)))}
    poses: dict[int, FloatArray] = {-1: np.eye(4)}
    rows, tilts = [], [0.0]
    for index, joint in enumerate(robot.joints):
        carrier, child = poses[joint.parent], first.get(index)
        normal = _normal(carrier, own[index], joint.axis, parallel)
        if joint.parent >= 0 and first[joint.parent] == index:
            normal = normal._replace(gamma=0.0, epsilon=0.0)  # by choice of the parent's frame, up to rounding
        entry = carrier @ turn_z(normal.gamma) @ shift(0.0, 0.0, normal.epsilon) @ _entry(normal.alpha, normal.a)
        ahead = None if child is None else _normal(entry, own[child], robot.joints[child].axis, parallel)
        row = _row(joint, normal, ahead)
        rows.append(row)
        poses[index] = carrier @ row.placement
        tilts.append(normal.tilt)
    links = np.array([_inverse(poses[index]) @ own[index] for index in range(robot.n_v)])
    return ModifiedDh(rows=tuple(rows), links=links, tilt=max(tilts))


def _row(joint: Joint, normal: _Normal, ahead: _Normal | None) -> ModifiedDhRow:
    """Return the row of a joint that is reached by `normal`; `ahead` leads from it to the first joint it carries."""
    return ModifiedDhRow(
        name=joint.name,
        kind=joint.kind,
        parent=joint.parent,
        gamma=normal.gamma,
        epsilon=normal.epsilon,
        alpha=normal.alpha,
        a=normal.a,
        theta=ahead.gamma if ahead else 0.0,
        d=ahead.epsilon if ahead else 0.0,
    )


def with_modified_frames(robot: Robot, *, parallel: float = PARALLEL) -> Robot:
    """Return the same robot with its joint frames replaced by modified DH frames; inertias and frames move along."""
    table = modified_dh(robot, parallel=parallel)
    joints, frames = [], []
    for joint, row, link in zip(robot.joints, table.rows, table.links, strict=True):
        placement, inertia = row.placement, moved_inertia(joint.inertia, link)
        placed = replace(joint, rotation=placement[:3, :3], translation=placement[:3, 3], inertia=inertia)
        joints.append(replace(placed, axis=np.array([0.0, 0.0, 1.0])))
    for frame in robot.frames:
        pose = homogeneous(frame.rotation, frame.translation)
        pose = pose if frame.joint < 0 else table.links[frame.joint] @ pose
        frames.append(Frame(name=frame.name, joint=frame.joint, rotation=pose[:3, :3], translation=pose[:3, 3]))
    return replace(robot, joints=tuple(joints), frames=tuple(frames))


def _entry(alpha: float, a: float) -> FloatArray:
    return np.asarray(turn_x(alpha) @ shift(a, 0.0, 0.0))


def _poses_at_zero(robot: Robot) -> list[FloatArray]:
    """Return the pose (4, 4) of every joint frame in the base frame at q = 0."""
    poses: list[FloatArray] = []
    for joint in robot.joints:
        carrier = poses[joint.parent] if joint.parent >= 0 else np.eye(4)
        poses.append(carrier @ homogeneous(joint.rotation, joint.translation))
    return poses


def _normal(frame: FloatArray, other: FloatArray, axis: FloatArray, parallel: float) -> _Normal:
    """Return the way from the z axis of `frame` to the `axis` through the origin of `other` along their common normal.

    With the axis u and its point w in the coordinates of `frame`, the normal is `n = z x u / |z x u|`; it meets z at
    the height at which the point `w + s u` has no part along `z x n`.
    """
    direction = frame[:3, :3].T @ other[:3, :3] @ axis
    point = frame[:3, :3].T @ (other[:3, 3] - frame[:3, 3])
    x, y, z = (float(part) for part in direction)
    sine = float(np.hypot(x, y))
    if sine <= parallel:
        alpha, distance = (0.0 if z > 0 else float(np.pi)), float(np.hypot(point[0], point[1]))
        if distance <= _COAXIAL:
            return _Normal(0.0, 0.0, alpha, 0.0, sine)
        return _Normal(float(np.arctan2(point[1], point[0])), 0.0, alpha, distance, sine)
    normal, across = np.array([-y, x, 0.0]) / sine, np.array([-x, -y, 0.0]) / sine
    height = float(point[2] + (across @ point) / sine * z)
    return _Normal(float(np.arctan2(x, -y)), height, float(np.arctan2(sine, z)), float(normal @ point), 0.0)


def _inverse(pose: FloatArray) -> FloatArray:
    return homogeneous(pose[:3, :3].T, -pose[:3, :3].T @ pose[:3, 3])
