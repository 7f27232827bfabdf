"""What programs for controllers ask of an arm, and what they may print of it."""

from __future__ import annotations

from tauhat.export.comments import plain_letters
from tauhat.robots.robot import Robot

SIX_JOINTS = 6
_LONGEST_NAME = 60


def has_six_revolute_joints(robot: Robot) -> bool:
    """Return whether a robot is such an arm as most controllers move."""
    return [joint.kind for joint in robot.joints] == ["revolute"] * SIX_JOINTS


def kinds_of_joints(robot: Robot) -> str:
    """Return how many joints of each kind a robot has, in words."""
    kinds = [joint.kind for joint in robot.joints]
    return f"{kinds.count('revolute')} revolute, {kinds.count('prismatic')} prismatic"


def harmless_name(robot: Robot) -> str:
    """Return a robot's name so that it cannot end a comment of one line."""
    return plain_letters(robot.name)[:_LONGEST_NAME]
