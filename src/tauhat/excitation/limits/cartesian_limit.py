"""The tool stays inside a box and below a speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.dynamics.motion import Motion, MotionGradient
from tauhat.errors import ExcitationError
from tauhat.excitation.limits.link_poses import (
    LinkPoses,
    ancestors,
    cross,
    dot,
    joint_forces,
    link_poses,
    no_wrenches,
)
from tauhat.excitation.limits.motion_limit import MotionLimit, Pull
from tauhat.robots.naming import advice_on_name
from tauhat.robots.robot import Frame, Robot

_STANDSTILL = 1e-12  # [m/s] below this the direction of a velocity means nothing


def tool_frame(robot: Robot, name: str | None = None) -> Frame:
    """Return the named frame; by default the robot's last frame, or its last link where it has none.

    Raises
    ------
    ExcitationError
        when there is no such frame.
    """
    if name is None and robot.frames:
        return robot.frames[-1]
    frames = {
        joint: Frame(name=joint, joint=index, rotation=np.eye(3), translation=np.zeros(3))
        for index, joint in enumerate(robot.joint_names)
    }
    frames |= {frame.name: frame for frame in robot.frames}
    wanted = robot.joint_names[-1] if name is None else name
    if wanted not in frames:
        raise ExcitationError("no such frame", where="tool", got=wanted[:60], remedy=advice_on_name(wanted, frames))
    return frames[wanted]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ToolBox(MotionLimit):
    """The origin of the tool frame stays between two corners, in base axes.

    frame : the tool
    lower, upper : (3,) corners in the base frame [m]
    """

    robot: Robot
    frame: Frame
    lower: FloatArray
    upper: FloatArray

    def __post_init__(self) -> None:
        for name in ("lower", "upper"):
            object.__setattr__(self, name, frozen(name, getattr(self, name), (3,), where="tool box"))
        if not (self.lower < self.upper).all():
            got = f"{self.lower.tolist()}, {self.upper.tolist()}"
            raise ExcitationError("lower above upper", where="tool box", expected="lower < upper", got=got)

    @property
    def name(self) -> str:
        """The words tool box."""
        return "tool box"

    @property
    def parts(self) -> tuple[str, ...]:
        """The six faces."""
        return tuple(f"{side} {axis} of the tool" for side in ("lowest", "highest") for axis in "xyz")

    @property
    def half(self) -> FloatArray:
        """Half edges, (3,) [m]."""
        return np.asarray(0.5 * (self.upper - self.lower))

    def evaluate(self, motion: Motion) -> tuple[FloatArray, Pull]:
        """Return the distance from each face in half edges, (6, n_t), and its pullback."""
        poses = link_poses(self.robot, motion.q)
        place = poses.point(self.frame.joint, self.frame.translation)

        def pull(bars: FloatArray) -> MotionGradient:
            wrenches = no_wrenches(self.robot, motion.n_t)
            wrenches.add(self.frame.joint, place, (bars[:3] - bars[3:]).T / self.half)
            still = np.zeros_like(motion.q)
            return MotionGradient(joint_forces(self.robot, poses, wrenches), still, still.copy())

        return np.concatenate([(place - self.lower) / self.half, (self.upper - place) / self.half], axis=1).T, pull

    def missing(self, row: int, margin: float) -> str:
        """Return how far outside the tool is."""
        return f"{-1e3 * margin * self.half[row % 3]:.4g} mm outside"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ToolSpeed(MotionLimit):
    """The origin of the tool frame moves no faster than `largest`.

    frame : the tool
    largest : [m/s]
    """

    robot: Robot
    frame: Frame
    largest: float

    def __post_init__(self) -> None:
        if not 0.0 < self.largest < np.inf:
            raise ExcitationError("not a speed", where="tool speed", expected="> 0 m/s", got=self.largest)

    @property
    def name(self) -> str:
        """The words tool speed."""
        return "tool speed"

    @property
    def parts(self) -> tuple[str, ...]:
        """The tool."""
        return ("tool",)

    def evaluate(self, motion: Motion) -> tuple[FloatArray, Pull]:
        """Return `1 - |v| / largest`, (1, n_t), and its pullback.

        With `J_k` the velocity of the tool per speed of joint k: `dv/d(dq_j) = J_j`, and turning joint j turns all that
        it carries, `dv/dq_j = axis_j x (v - v_before) + w_before x J_j` (no first term on a prismatic joint).
        """
        poses = link_poses(self.robot, motion.q)
        chain = ancestors(self.robot, self.frame.joint)
        columns = _columns(self.robot, poses, self.frame, chain)
        velocity = np.einsum("ktx,kt->tx", columns, motion.dq[list(chain)])
        speed = np.sqrt(dot(velocity, velocity))

        def pull(bars: FloatArray) -> MotionGradient:
            force = velocity * (-bars[0] / (self.largest * np.maximum(speed, _STANDSTILL)))[:, None]
            q, dq = np.zeros_like(motion.q), np.zeros_like(motion.q)
            before, turning = np.zeros_like(velocity), np.zeros_like(velocity)
            for joint, column in zip(chain, columns, strict=True):
                change = cross(turning, column)
                if self.robot.joints[joint].kind == "revolute":
                    change = change + cross(poses.axis[joint], velocity - before)
                    turning = turning + motion.dq[joint][:, None] * poses.axis[joint]
                before = before + motion.dq[joint][:, None] * column
                q[joint], dq[joint] = dot(change, force), dot(column, force)
            return MotionGradient(q, dq, np.zeros_like(q))

        return (1.0 - speed / self.largest)[None, :], pull

    def missing(self, row: int, margin: float) -> str:  # noqa: ARG002 - one row
        """Return the speed."""
        return f"{(1.0 - margin) * self.largest:.3g} of {self.largest:.3g} m/s"


def _columns(robot: Robot, poses: LinkPoses, frame: Frame, chain: tuple[int, ...]) -> FloatArray:
    """Return the tool's velocity per speed of each joint of its chain, (n_chain, n_t, 3)."""
    place = poses.point(frame.joint, frame.translation)
    columns = np.zeros((len(chain), *place.shape))
    for row, joint in enumerate(chain):
        axis = poses.axis[joint]
        sliding = robot.joints[joint].kind == "prismatic"
        columns[row] = axis if sliding else cross(axis, place - poses.origin[joint])
    return columns
