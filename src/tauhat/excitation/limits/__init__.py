"""Limits of a motion: of single joints, of torque, of the tool, of collisions; and the file that states them."""

from tauhat.excitation.limits.capsules import Body, Capsule, link_capsules, robot_body
from tauhat.excitation.limits.cartesian_limit import ToolBox, ToolSpeed, tool_frame
from tauhat.excitation.limits.collision_limit import FAR, DistanceLimit, HalfSpace, SelfCollision
from tauhat.excitation.limits.joint_limits import MotionLimits, motion_limits
from tauhat.excitation.limits.limit_set import LimitSet
from tauhat.excitation.limits.limits_file import load_limits, parse_limits
from tauhat.excitation.limits.motion_limit import MotionLimit
from tauhat.excitation.limits.obstacle_limit import Obstacle, ObstacleLimit, box_obstacle, mesh_obstacle
from tauhat.excitation.limits.solids import LinkSolid, link_solid
from tauhat.excitation.limits.torque_limit import TorqueLimit

__all__ = [
    "FAR",
    "Body",
    "Capsule",
    "DistanceLimit",
    "HalfSpace",
    "LimitSet",
    "LinkSolid",
    "MotionLimit",
    "MotionLimits",
    "Obstacle",
    "ObstacleLimit",
    "SelfCollision",
    "ToolBox",
    "ToolSpeed",
    "TorqueLimit",
    "box_obstacle",
    "link_capsules",
    "link_solid",
    "load_limits",
    "mesh_obstacle",
    "motion_limits",
    "parse_limits",
    "robot_body",
    "tool_frame",
]
