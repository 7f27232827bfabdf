"""Robot descriptions: the kinematic tree with limits and nominal inertias, and where it comes from."""

from tauhat.robots.dh import robot_from_dh
from tauhat.robots.fitting import check_joint_order, fit_to_joints
from tauhat.robots.inertia_change import inertia_change
from tauhat.robots.inertia_checks import inertia_defect
from tauhat.robots.inverse_kinematics import inverse_kinematics, singularity_distance
from tauhat.robots.joint import Joint, JointKind, Limits, central_inertia, inertia_at_origin
from tauhat.robots.kinematics import Pose, forward_kinematics, pinocchio_model
from tauhat.robots.library import builtin_names, describe_builtins, load_robot
from tauhat.robots.locking import lock_joints
from tauhat.robots.modified_dh import ModifiedDh, ModifiedDhRow, modified_dh, with_modified_frames
from tauhat.robots.robot import EARTH, Frame, Robot
from tauhat.robots.solid import Solid
from tauhat.robots.urdf import robot_from_urdf

__all__ = [
    "EARTH",
    "Frame",
    "Joint",
    "JointKind",
    "Limits",
    "ModifiedDh",
    "ModifiedDhRow",
    "Pose",
    "Robot",
    "Solid",
    "builtin_names",
    "central_inertia",
    "check_joint_order",
    "describe_builtins",
    "fit_to_joints",
    "forward_kinematics",
    "inertia_at_origin",
    "inertia_change",
    "inertia_defect",
    "inverse_kinematics",
    "load_robot",
    "lock_joints",
    "modified_dh",
    "pinocchio_model",
    "robot_from_dh",
    "robot_from_urdf",
    "singularity_distance",
    "with_modified_frames",
]
