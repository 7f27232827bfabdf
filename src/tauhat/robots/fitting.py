"""Fitting a robot to a log: joints that the log does not have are locked, joints in another order are refused."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

from tauhat.errors import RecordingError, TauhatWarning
from tauhat.robots.locking import lock_joints
from tauhat.robots.robot import Robot


def fit_to_joints(robot: Robot, names: Sequence[str], *, where: str = "log") -> Robot:
    """Return the robot with the joints that a log lacks locked at zero, or the robot itself where none can be told.

    Locked are the joints that the log's names leave out; where the names say nothing, a gripper at the end of the arm,
    when the rest is exactly as many joints as the log has.

    Parameters
    ----------
    names : of the log's joints, in its order; `joint_1, joint_2, ...` count as no names
    where : what messages call the log

    Raises
    ------
    RecordingError
        when the log has the robot's joints in another order.

    Warns
    -----
    TauhatWarning
        names the joints that are locked.
    """
    check_joint_order(robot, names, where=where)
    if len(names) >= robot.n_v:
        return robot
    left_out = _left_out(robot, names)
    locked = left_out or _gripper(robot, len(names))
    if not locked:
        return robot
    reason = "the log's names leave them out" if left_out else f"the log has {len(names)} joints and they are a gripper"
    message = f"{where}: {', '.join(locked)} of {robot.name} locked at 0: {reason}; choose other positions with --lock"
    warnings.warn(message, TauhatWarning, stacklevel=2)
    return lock_joints(robot, dict.fromkeys(locked, 0.0))


def check_joint_order(robot: Robot, names: Sequence[str], *, where: str = "log") -> None:
    """Refuse a log whose names are the robot's in another order.

    Raises
    ------
    RecordingError
        naming both orders.
    """
    if not _all_named(robot, names):
        return
    expected = [name for name in robot.joint_names if name in set(names)]
    if list(names) != expected:
        raise RecordingError(
            "the log has the robot's joints in another order",
            where=where,
            expected=", ".join(expected),
            got=", ".join(names),
            remedy="put the columns and [joints] names of the map in the robot's order",
        )


def _all_named(robot: Robot, names: Sequence[str]) -> bool:
    unnamed = list(names) == [f"joint_{index + 1}" for index in range(len(names))]
    return not unnamed and set(names) <= set(robot.joint_names)


def _left_out(robot: Robot, names: Sequence[str]) -> tuple[str, ...]:
    if not _all_named(robot, names):
        return ()
    return tuple(name for name in robot.joint_names if name not in names)


def _gripper(robot: Robot, count: int) -> tuple[str, ...]:
    """Return the joints beyond the first `count` when they are a gripper on a serial arm, else nothing.

    A gripper hangs on the arm's last joint by several joints, or by one of another kind than that joint.
    """
    serial = robot.parents[:count] == tuple(range(-1, count - 1))
    beyond = robot.joints[count:]
    roots = [joint for joint in beyond if joint.parent < count]
    on_the_tip = all(joint.parent == count - 1 for joint in roots)
    if not (count and serial and on_the_tip):
        return ()
    branching = len(roots) > 1
    other_kind = roots[0].kind != robot.joints[count - 1].kind
    return tuple(joint.name for joint in beyond) if branching or other_kind else ()
