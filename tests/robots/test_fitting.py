"""Fitting a robot to the joints of a log."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from tauhat.errors import RecordingError, TauhatWarning
from tauhat.robots.fitting import check_joint_order, fit_to_joints
from tauhat.robots.joint import Joint, JointKind
from tauhat.robots.robot import Robot


def arm(*joints: tuple[str, JointKind, int]) -> Robot:
    made = tuple(
        Joint(
            name=name, kind=kind, parent=parent, rotation=np.eye(3), translation=np.zeros(3), axis=np.array([0, 0, 1.0])
        )
        for name, kind, parent in joints
    )
    return Robot(name="arm", joints=made)


SERIAL = arm(("a", "revolute", -1), ("b", "revolute", 0), ("c", "revolute", 1))
TWO_FINGERS = arm(("a", "revolute", -1), ("b", "revolute", 0), ("left", "prismatic", 1), ("right", "prismatic", 1))
ONE_FINGER = arm(("a", "revolute", -1), ("b", "revolute", 0), ("finger", "prismatic", 1))
UNNAMED = ("joint_1", "joint_2")


def test_a_log_with_all_joints_leaves_the_robot_as_it_is() -> None:
    assert fit_to_joints(SERIAL, ("a", "b", "c")) is SERIAL
    assert fit_to_joints(SERIAL, ("x", "y", "z")) is SERIAL


def test_joints_that_the_names_leave_out_are_locked_with_a_warning() -> None:
    with pytest.warns(TauhatWarning, match=r"run: b of arm locked at 0"):
        fitted = fit_to_joints(SERIAL, ("a", "c"), where="run")
    assert fitted.joint_names == ("a", "c")


@pytest.mark.parametrize("robot", [TWO_FINGERS, ONE_FINGER])
def test_a_gripper_is_locked_when_it_explains_the_difference(robot: Robot) -> None:
    with pytest.warns(TauhatWarning, match="gripper"):
        assert fit_to_joints(robot, UNNAMED).joint_names == ("a", "b")


@pytest.mark.parametrize(
    ("robot", "count"),
    [
        (SERIAL, 2),  # the last joint of an arm is no gripper
        (TWO_FINGERS, 1),  # b and its fingers are not one either
        (TWO_FINGERS, 3),  # nor is one finger of two
        (SERIAL, 0),
        (SERIAL, 5),
    ],
)
def test_a_difference_that_nothing_explains_leaves_the_robot_as_it_is(robot: Robot, count: int) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert fit_to_joints(robot, tuple(f"joint_{k + 1}" for k in range(count))) is robot


def test_numbered_names_prove_nothing_about_which_joint_is_missing() -> None:
    robot = arm(("rail", "revolute", -1), ("joint_1", "revolute", 0), ("joint_2", "revolute", 1))
    assert fit_to_joints(robot, UNNAMED) is robot


@pytest.mark.parametrize("names", [("b", "a", "c"), ("c", "a")])
def test_another_order_is_refused(names: tuple[str, ...]) -> None:
    with pytest.raises(RecordingError, match=r"another order; expected a, .*got " + ", ".join(names)):
        fit_to_joints(SERIAL, names)


def test_names_of_another_world_have_no_order() -> None:
    check_joint_order(SERIAL, ("c", "b", "elbow"))
    check_joint_order(SERIAL, ("a", "b", "c"))
