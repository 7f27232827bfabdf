"""Which link of a URDF gets which part of an identified body.

What is identified belongs to a joint: the sum of all links that are rigidly connected behind it. The link that the
joint moves gets the whole, and the links fixed to it nothing, because no motion can tell how it is shared. Links behind
a joint that was locked keep the file's figures, which are taken off the whole: they would otherwise be moving links
without mass, which simulators refuse.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ExportError, TauhatWarning
from tauhat.export.parameters import StandardParameters, body_defect
from tauhat.robots.joint import inertia_at_origin
from tauhat.robots.robot import Robot
from tauhat.robots.transforms import homogeneous, moved_inertia, rotation_from_rpy
from tauhat.robots.urdf_description import UrdfDescription, UrdfInertial, UrdfJoint

_SAME_PLACE = 1e-6  # [m, or entries of a rotation] how far two placements may differ


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkShares:
    """What each link of a URDF is to hold.

    filled : link name -> (10,) inertial parameters about its own frame
    emptied : links fixed to those, whose inertia is in them
    kept : links behind locked joints, which stay as they are
    """

    filled: Mapping[str, FloatArray]
    emptied: tuple[str, ...]
    kept: tuple[str, ...]


def share_among_links(description: UrdfDescription, robot: Robot, parameters: StandardParameters) -> LinkShares:
    """Return what each moving link of the URDF is to hold; links on the base are never mentioned."""
    above = {joint.child: joint for joint in description.joints}
    moving = {joint.name: joint.child for joint in description.joints}
    filled: dict[str, FloatArray] = {}
    emptied: list[str] = []
    kept: list[str] = []
    for index, joint in enumerate(robot.joints):
        carrier = moving[joint.name]
        followers = [frame.name for frame in robot.frames if frame.joint == index and frame.name != carrier]
        hanging = [link for link in followers if not _is_fixed_to(link, carrier, above)]
        rest = parameters.inertia[index] - _total(hanging, description, link_poses(robot))
        if hanging and body_defect(rest):
            _warn_of_emptied(joint.name, hanging)
            hanging, rest = [], parameters.inertia[index]
        filled[carrier] = rest
        kept += hanging
        emptied += [link for link in followers if link not in hanging]
    return LinkShares(filled=filled, emptied=tuple(emptied), kept=tuple(kept))


def _is_fixed_to(link: str, carrier: str, above: Mapping[str, UrdfJoint]) -> bool:
    while link != carrier:
        if above[link].kind != "fixed":
            return False
        link = above[link].parent
    return True


def _total(links: list[str], description: UrdfDescription, poses: Mapping[str, FloatArray]) -> FloatArray:
    """Return the file's inertia of some links, about the frame of the joint that carries them."""
    total = np.zeros(10)
    for link in links:
        inertial = description.links[link]
        if inertial is not None:
            total += moved_inertia(_about_link_frame(inertial), poses[link])
    return total


def _about_link_frame(inertial: UrdfInertial) -> FloatArray:
    turn = rotation_from_rpy(*inertial.origin.rpy)
    tensor = turn @ inertial.tensor @ turn.T
    return inertia_at_origin(mass=inertial.mass, com=inertial.origin.xyz, inertia_at_com=tensor)


def _warn_of_emptied(joint: str, links: list[str]) -> None:
    names = ", ".join(links)
    message = (
        f"{names}: the inertia in the file is larger than all that was identified behind {joint}, and is set to zero; "
        "simulators need these joints fixed"
    )
    warnings.warn(message, TauhatWarning, stacklevel=4)


def link_poses(robot: Robot) -> dict[str, FloatArray]:
    """Return link name -> (4, 4) pose in the frame of the joint that carries it."""
    return {frame.name: homogeneous(frame.rotation, frame.translation) for frame in robot.frames}


def locked_positions(description: UrdfDescription, robot: Robot, *, where: str) -> dict[str, float]:
    """Return the positions at which the URDF's other joints are locked in the robot [rad or m].

    Raises
    ------
    ExportError
        when the robot has joints or links that the URDF has not.
    """
    _check_names(description, robot, where)
    poses = link_poses(robot)
    locked = [joint for joint in description.joints if joint.kind != "fixed" and joint.name not in robot.joint_names]
    return {joint.name: _position(joint, poses) for joint in locked}


def _check_names(description: UrdfDescription, robot: Robot, where: str) -> None:
    movable = {joint.name for joint in description.joints if joint.kind != "fixed"}
    frames = {frame.name for frame in robot.frames}
    for what, missing in (
        ("joints", sorted(set(robot.joint_names) - movable)),
        ("links", sorted(set(description.links) - frames)),
    ):
        if missing:
            raise ExportError(
                f"the model was not identified with this URDF: {what} differ",
                where=where,
                got=", ".join(missing[:6]),
                remedy="give the URDF that `identify` was given",
            )


def _position(joint: UrdfJoint, poses: Mapping[str, FloatArray]) -> float:
    origin = homogeneous(rotation_from_rpy(*joint.origin.rpy), joint.origin.xyz)
    moved = np.linalg.solve(poses[joint.parent] @ origin, poses[joint.child])
    if joint.kind == "prismatic":
        return float(joint.axis @ moved[:3, 3])
    turn = moved[:3, :3]
    sine = 0.5 * joint.axis @ (turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1])
    return float(np.arctan2(sine, 0.5 * (np.trace(turn) - 1.0)))


def check_same_kinematics(found: Robot, robot: Robot, *, where: str) -> None:
    """Refuse a URDF whose joints are not placed as those of the robot.

    Raises
    ------
    ExportError
        naming the first joint that differs.
    """
    by_name = {joint.name: joint for joint in found.joints}
    for joint in robot.joints:
        other = by_name[joint.name]
        parents = [
            arm.joints[part.parent].name if part.parent >= 0 else "" for arm, part in ((robot, joint), (found, other))
        ]
        apart = max(
            float(np.abs(getattr(joint, name) - getattr(other, name)).max())
            for name in ("rotation", "translation", "axis")
        )
        if parents[0] != parents[1] or joint.kind != other.kind or apart > _SAME_PLACE:
            raise ExportError(
                f"the model was not identified with this URDF: joint {joint.name} is placed otherwise",
                where=where,
                got=f"{apart:.3g} apart" if apart > _SAME_PLACE else other.kind,
                remedy="give the URDF that `identify` was given",
            )
