"""Joint positions that bring a frame to a pose, and how far an arm is from a singularity."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, frozen, read_only
from tauhat.errors import RobotError
from tauhat.robots.kinematics import Pose, named_frame, pinocchio_model
from tauhat.robots.robot import Robot

LEAST_SINGULAR_VALUE = 0.01  # of the Jacobian, in metres and radians, below which a pose counts as singular
_REACHED = 1e-11  # [m, rad] left over when a pose is reached
_MOST_STEPS = 200
_LARGEST_STEP = 0.5  # [rad or m] of all joints together, so that the search stays on the seed's branch
_FIRST_DAMPING = 1e-2


class Placement(NamedTuple):
    """Where a frame is at one position and how the joints move it, in base axes.

    rotation : (3, 3)
    translation : (3,) [m]
    jacobian : (6, n_v) linear velocity of the origin, then angular velocity, by joint speed
    """

    rotation: FloatArray
    translation: FloatArray
    jacobian: FloatArray

    def distance_to(self, rotation: FloatArray, translation: FloatArray) -> FloatArray:
        """Return the way to another pose, (6,): translation [m], then rotation vector [rad], in base axes."""
        import pinocchio

        turn = pinocchio.log3(rotation @ self.rotation.T)
        return np.concatenate([translation - self.translation, turn])


class FrameKinematics:
    """Pose, Jacobian and drift of one frame, position by position; it owns work space and is no data.

    frame : name of one of `robot.frames`, or of a joint for that joint's own frame

    Raises
    ------
    RobotError
        no frame of that name.
    """

    __slots__ = ("_data", "_index", "_model", "_robot")

    def __init__(self, robot: Robot, frame: str) -> None:
        import pinocchio

        target = named_frame(robot, frame)
        placement = pinocchio.SE3(np.array(target.rotation), np.array(target.translation))
        kind = pinocchio.FrameType.OP_FRAME
        self._robot = robot
        self._model: Any = pinocchio_model(robot)
        self._index = self._model.addFrame(pinocchio.Frame("followed frame", target.joint + 1, placement, kind))
        self._data: Any = self._model.createData()

    def at(self, q: FloatArray) -> Placement:
        """Return the frame's placement at q, (n_v,) [rad or m]."""
        import pinocchio

        pinocchio.computeJointJacobians(self._model, self._data, q)
        pose = pinocchio.updateFramePlacement(self._model, self._data, self._index)
        axes = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
        jacobian = pinocchio.getFrameJacobian(self._model, self._data, self._index, axes)
        return Placement(pose.rotation.copy(), pose.translation.copy(), jacobian)

    def drift(self, q: FloatArray, dq: FloatArray) -> FloatArray:
        """Return the frame's acceleration while no joint accelerates, (6,): of the origin, then angular.

        q, dq : (n_v,) [rad or m, and per second]
        """
        import pinocchio

        pinocchio.forwardKinematics(self._model, self._data, q, dq, np.zeros(self._robot.n_v))
        axes = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
        return np.asarray(
            pinocchio.getFrameClassicalAcceleration(self._model, self._data, self._index, axes).vector.copy()
        )


def singularity_distance(robot: Robot, q: FloatArray, *, frame: str) -> float:
    """Return the smallest singular value of a frame's Jacobian: zero where the arm loses a direction.

    Parameters
    ----------
    q : (n_v,) [rad or m]

    Source: Yoshikawa, "Manipulability of robotic mechanisms", 1985; here in metres and radians.
    """
    position = frozen("q", q, (robot.n_v,), where=robot.name)
    return smallest_singular_value(FrameKinematics(robot, frame).at(position).jacobian)


def smallest_singular_value(jacobian: FloatArray) -> float:
    """Return the smallest singular value of a matrix."""
    return float(np.linalg.svd(jacobian, compute_uv=False)[-1])


class PoseSolver:
    """Joint positions for poses of one frame, pose by pose; it owns work space and is no data.

    Damped least squares: each step minimises `|J dq - e|^2 + damping |dq|^2`; damping falls while the error does and
    grows when a step fails. Steps are short, so that the arm keeps the configuration of the seed where it can. Turns by
    2 pi bring revolute joints back inside their limits.

    frame : name of one of `robot.frames`, or of a joint for that joint's own frame
    singular : smallest singular value of the Jacobian that is accepted

    Raises
    ------
    RobotError
        no frame of that name.

    Source: Nakamura and Hanafusa, "Inverse kinematic solutions with singularity robustness", 1986.
    """

    __slots__ = ("_kinematics", "_robot", "_singular", "_where")

    def __init__(self, robot: Robot, frame: str, *, singular: float = LEAST_SINGULAR_VALUE) -> None:
        self._robot = robot
        self._kinematics = FrameKinematics(robot, frame)
        self._singular = singular
        self._where = f"{robot.name}, frame {frame}"

    def position(self, pose: Pose, seed: FloatArray) -> FloatArray:
        """Return joint positions that bring the frame to the pose, on the seed's branch, (n_v,) [rad or m].

        Parameters
        ----------
        pose : of the frame in the base frame, at one position
        seed : (n_v,) where the search starts [rad or m]

        Raises
        ------
        RobotError
            when the pose is not reached from the seed, only outside a joint's limits, or only in a singular position.
        """
        start = frozen("seed", seed, (self._robot.n_v,), where=self._robot.name)
        rotation = frozen("rotation", pose.rotation, (3, 3), where="pose")
        translation = frozen("translation", pose.translation, (3,), where="pose")
        where = self._where
        found = _search(self._kinematics, np.array(start), rotation, translation)
        placement = self._kinematics.at(found)
        error = placement.distance_to(rotation, translation)
        if np.abs(error).max() > 10.0 * _REACHED:
            metres, angle = np.linalg.norm(error[:3]), np.linalg.norm(error[3:])
            left = f"{1e3 * metres:.4g} mm and {angle:.3g} rad away at the nearest"
            raise RobotError("the pose is not reached", where=where, got=left, remedy="a nearer pose, or another seed")
        least = smallest_singular_value(placement.jacobian)
        if least < self._singular:
            raise RobotError(
                "the pose is reached in a singular position only", where=where,
                expected=f"smallest singular value >= {self._singular:g}", got=f"{least:.2g}",
                remedy="another pose or seed",
            )  # fmt: skip
        return read_only(_inside(self._robot, found, where))


def inverse_kinematics(
    robot: Robot, pose: Pose, *, seed: FloatArray, frame: str, singular: float = LEAST_SINGULAR_VALUE
) -> FloatArray:
    """Return joint positions that bring the frame to the pose, on the seed's branch, (n_v,) [rad or m].

    As `PoseSolver`, for one pose.

    Parameters
    ----------
    pose : of the frame in the base frame, at one position
    seed : (n_v,) where the search starts [rad or m]
    singular : smallest singular value of the Jacobian that is accepted

    Raises
    ------
    RobotError
        when there is no such frame, or the pose is not reached from the seed, only outside a joint's limits, or only in
        a singular position.
    """
    return PoseSolver(robot, frame, singular=singular).position(pose, seed)


def _search(kinematics: FrameKinematics, q: FloatArray, rotation: FloatArray, translation: FloatArray) -> FloatArray:
    damping = _FIRST_DAMPING
    placement = kinematics.at(q)
    error = placement.distance_to(rotation, translation)
    for _ in range(_MOST_STEPS):
        if np.abs(error).max() < _REACHED:
            break
        weighted = np.vstack([placement.jacobian, np.sqrt(damping) * np.eye(q.size)])
        step = np.linalg.lstsq(weighted, np.concatenate([error, np.zeros(q.size)]), rcond=None)[0]
        step *= min(1.0, _LARGEST_STEP / max(float(np.linalg.norm(step)), _REACHED))
        tried = kinematics.at(q + step)
        left = tried.distance_to(rotation, translation)
        if np.linalg.norm(left) < np.linalg.norm(error):
            q, placement, error, damping = q + step, tried, left, 0.1 * damping
        else:
            damping = 10.0 * max(damping, _REACHED)
    return q


def _inside(robot: Robot, q: FloatArray, where: str) -> FloatArray:
    """Return the position with revolute joints turned by 2 pi into their limits."""
    turned = q.copy()
    for index, joint in enumerate(robot.joints):
        lower, upper = joint.limits.lower, joint.limits.upper
        if joint.kind == "revolute" and q[index] < lower:
            turned[index] += 2.0 * np.pi * np.ceil((lower - q[index]) / (2.0 * np.pi))
        elif joint.kind == "revolute" and q[index] > upper:
            turned[index] -= 2.0 * np.pi * np.ceil((q[index] - upper) / (2.0 * np.pi))
        if not lower <= turned[index] <= upper:
            raise RobotError(
                f"the pose is reached outside the limits of {joint.name} only", where=where,
                expected=f"{lower:g} to {upper:g}", got=f"{q[index]:.4g}", remedy="another pose or seed",
            )  # fmt: skip
    return turned
