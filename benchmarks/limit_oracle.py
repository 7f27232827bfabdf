"""What a motion leaves of its limits, by Pinocchio and coal alone, at times that no design has looked at.

Of the library only data is used: which capsules and solids stand for the links, which pairs count, how far the limits
reach. Kinematics and torque are Pinocchio's, distances are coal's, one sample at a time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import coal
import numpy as np
import pinocchio

from tauhat.arrays import FloatArray
from tauhat.excitation import FourierSeries, LimitSet
from tauhat.excitation.limits import (
    Body,
    HalfSpace,
    MotionLimit,
    ObstacleLimit,
    SelfCollision,
    ToolBox,
    ToolSpeed,
    TorqueLimit,
)
from tauhat.robots import Frame, Robot, pinocchio_model

FINER = 10  # times as many samples as the design holds its limits on
DESIGN_SAMPLES = 2000
NEAR = {True: 0.03, False: 0.01}  # part of a relative limit, or metres, within which the finer grid is looked at
_PLANE = 100.0  # [m] edge of the box that stands for a half space


@dataclass(frozen=True, kw_only=True)
class Shape:
    """A coal solid on a joint, -1 for the base."""

    geometry: Any
    joint: int
    rotation: FloatArray
    translation: FloatArray

    @classmethod
    def of_part(cls, body: Body, index: int) -> Shape:
        """Capsules by their ends, solids as they stand."""
        if index >= len(body.capsules):
            solid = body.solids[index - len(body.capsules)]
            return cls(geometry=solid.shape, joint=solid.link, rotation=solid.rotation, translation=solid.translation)
        capsule = body.capsules[index]
        along = capsule.end - capsule.start
        turn = pinocchio.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), along / np.linalg.norm(along)).matrix()
        geometry = coal.Capsule(capsule.radius, capsule.length)
        return cls(
            geometry=geometry, joint=capsule.link, rotation=turn, translation=0.5 * (capsule.start + capsule.end)
        )


@dataclass(frozen=True, kw_only=True)
class Travel:
    """Where Pinocchio says the robot is: (n_t, n_v, 3, 3), (n_t, n_v, 3), torque (n_t, n_v), tools by name."""

    rotation: FloatArray
    translation: FloatArray
    torque: FloatArray
    place: dict[str, FloatArray]
    velocity: dict[str, FloatArray]

    def of(self, shape: Shape) -> tuple[FloatArray, FloatArray]:
        """Pose of a shape at each sample."""
        if shape.joint < 0:
            n_t = len(self.torque)
            return np.broadcast_to(shape.rotation, (n_t, 3, 3)), np.broadcast_to(shape.translation, (n_t, 3))
        turn = self.rotation[:, shape.joint]
        return turn @ shape.rotation, self.translation[:, shape.joint] + turn @ shape.translation


class Oracle:
    """The limits of a set along a motion, and what has to be left of them."""

    def __init__(self, limits: LimitSet, *, margin: float) -> None:
        self.limits, self.robot, self.margin = limits, limits.robot, margin
        self.model = pinocchio_model(self.robot)
        self.data = self.model.createData()
        frames = [limit.frame for limit in limits.others if isinstance(limit, ToolBox | ToolSpeed)]
        self.frames = {frame.name: self._index(frame) for frame in frames}

    def worst(self, motion: FourierSeries) -> dict[str, float]:
        """The least left of each limit beyond its reserve, on a grid ten times finer wherever it may be near."""
        if not self.limits.others:
            return {}
        step = motion.period / (FINER * DESIGN_SAMPLES)
        coarse = FINER * np.arange(DESIGN_SAMPLES) + FINER // 2  # between the samples of the design
        left = self.left(motion, step * coarse)
        near = np.zeros(DESIGN_SAMPLES, dtype=bool)
        for limit in self.limits.others:
            near |= left[limit.name] < NEAR[limit.relative]
        fine = np.unique((coarse[near][:, None] + np.arange(-FINER, FINER + 1)).ravel())
        finer = self.left(motion, step * fine)
        return {name: float(min(left[name].min(), finer[name].min(initial=np.inf))) for name in left}

    def left(self, motion: FourierSeries, t: FloatArray) -> dict[str, FloatArray]:
        """What is left of each limit beyond its reserve, in parts of it or in metres, at the times t."""
        samples = motion.sample(t)
        travel = self._travel(samples.q, samples.dq, samples.ddq)
        return {limit.name: self._left(limit, travel, samples.dq, samples.ddq) for limit in self.limits.others}

    def _travel(self, q: FloatArray, dq: FloatArray, ddq: FloatArray) -> Travel:
        n_t, n_v = q.shape
        rotation, translation, torque = np.empty((n_t, n_v, 3, 3)), np.empty((n_t, n_v, 3)), np.empty((n_t, n_v))
        place = {name: np.empty((n_t, 3)) for name in self.frames}
        velocity = {name: np.empty((n_t, 3)) for name in self.frames}
        axes = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
        for k in range(n_t):
            state = q[k].copy(), dq[k].copy()
            torque[k] = pinocchio.rnea(self.model, self.data, *state, ddq[k].copy())
            pinocchio.forwardKinematics(self.model, self.data, *state)
            for joint in range(n_v):
                pose = self.data.oMi[joint + 1]
                rotation[k, joint], translation[k, joint] = pose.rotation, pose.translation
            for name, index in self.frames.items():
                place[name][k] = pinocchio.updateFramePlacement(self.model, self.data, index).translation
                velocity[name][k] = pinocchio.getFrameVelocity(self.model, self.data, index, axes).linear
        return Travel(rotation=rotation, translation=translation, torque=torque, place=place, velocity=velocity)

    def _left(self, limit: MotionLimit, travel: Travel, dq: FloatArray, ddq: FloatArray) -> FloatArray:
        match limit:
            case TorqueLimit():
                own = np.array([(joint.rotor_inertia, joint.viscous, joint.coulomb) for joint in self.robot.joints]).T
                needed = np.abs(travel.torque + own[0] * ddq + own[1] * dq) + own[2]
                return (1.0 - needed / limit.largest).min(axis=1) - self.margin
            case ToolBox():
                place, half = travel.place[limit.frame.name], 0.5 * (limit.upper - limit.lower)
                inside = np.minimum(place - limit.lower, limit.upper - place) / half
                return inside.min(axis=1) - self.margin
            case ToolSpeed():
                speed = np.linalg.norm(travel.velocity[limit.frame.name], axis=1)
                return 1.0 - speed / limit.largest - self.margin
            case SelfCollision():
                pairs = [[Shape.of_part(limit.body, index) for index in pair] for pair in limit.pairs]
            case ObstacleLimit():
                solid = limit.obstacle
                standing = Shape(geometry=solid.shape, joint=-1, rotation=solid.rotation, translation=solid.translation)
                pairs = [[Shape.of_part(limit.body, index), standing] for index in limit.moving]
            case HalfSpace():
                pairs = [[shape, _below(limit)] for shape in _on_plane(limit)]
            case _:
                raise TypeError(limit.name)
        gaps = [_distance(travel, *pair, within=limit.clearance + 2.0 * NEAR[False]) for pair in pairs]
        return np.min(gaps, axis=0) - limit.clearance

    def _index(self, frame: Frame) -> int:
        frames = self.model.frames
        return next(k for k, own in enumerate(frames) if own.name == frame.name and own.parentJoint == frame.joint + 1)


def _below(limit: HalfSpace) -> Shape:
    """The half space below a plane as a huge box."""
    first = np.linalg.svd(limit.normal[None])[2][1]
    turn = np.column_stack([first, np.cross(limit.normal, first), limit.normal])
    centre = (limit.offset - 0.5 * _PLANE) * limit.normal
    return Shape(geometry=coal.Box(_PLANE, _PLANE, _PLANE), joint=-1, rotation=turn, translation=centre)


def _on_plane(limit: HalfSpace) -> list[Shape]:
    """The ends of capsules as balls, and the solids."""
    body = limit.body
    balls = [
        Shape(
            geometry=coal.Sphere(body.capsules[index].radius),
            joint=body.capsules[index].link,
            rotation=np.eye(3),
            translation=place,
        )
        for index, place in limit.points
    ]
    solids = [
        Shape(geometry=solid.shape, joint=solid.link, rotation=solid.rotation, translation=solid.translation)
        for solid in limit.solids
    ]
    return balls + solids


def _distance(travel: Travel, first: Shape, second: Shape, *, within: float) -> FloatArray:
    """Signed distance at each sample by coal; infinite where balls around both are further apart than `within`."""
    poses = [travel.of(shape) for shape in (first, second)]
    middles, reach = [], within
    for shape, (rotation, translation) in zip((first, second), poses, strict=True):
        shape.geometry.computeLocalAABB()
        middles.append(translation + rotation @ shape.geometry.aabb_center)
        reach += shape.geometry.aabb_radius
    gaps = np.full(len(middles[0]), np.inf)
    request = coal.DistanceRequest()
    request.enable_signed_distance = True
    request.gjk_tolerance = 1e-9
    for k in np.flatnonzero(np.linalg.norm(middles[0] - middles[1], axis=1) < reach):
        places = [coal.Transform3s(np.array(rotation[k]), np.array(translation[k])) for rotation, translation in poses]
        result = coal.DistanceResult()
        gaps[k] = coal.distance(first.geometry, places[0], second.geometry, places[1], request, result)
    return gaps


def joint_margins(motion: FourierSeries, robot: Robot, *, margin: float, jerk: FloatArray | None) -> dict[str, float]:
    """The least left of each joint limit beyond its reserve on 20 001 samples; only limits that are stated count."""
    samples = motion.sample(np.linspace(0.0, motion.period, FINER * DESIGN_SAMPLES + 1))
    reserve = 0.5 * margin * (robot.upper - robot.lower)
    inner = [(samples.q - robot.lower - reserve), (robot.upper - reserve - samples.q)]
    left = {"position": float(min(part.min() for part in inner))}
    left["velocity"] = float((1.0 - margin - np.abs(samples.dq) / robot.velocity_limit).min())
    acceleration = np.array([joint.limits.acceleration for joint in robot.joints])
    left["acceleration"] = float((1.0 - margin - np.abs(samples.ddq) / acceleration).min())
    if jerk is not None:
        change = np.diff(samples.ddq, axis=0) / np.diff(samples.t)[:, None]
        left["jerk"] = float((1.0 - margin - np.abs(change) / jerk).min())
    return left
