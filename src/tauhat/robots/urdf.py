"""Robots from URDF: checked here, put together by Pinocchio."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import RobotError, TauhatWarning
from tauhat.robots.inertia_checks import warn_of_massless_links
from tauhat.robots.joint import Joint
from tauhat.robots.locking import lock_joints
from tauhat.robots.robot import EARTH, Frame, Robot
from tauhat.robots.source import DescriptionSource, source_from_file, source_from_text
from tauhat.robots.urdf_description import Placement, UrdfDescription, UrdfInertial, UrdfJoint, describe_urdf
from tauhat.robots.urdf_solids import urdf_solids
from tauhat.robots.urdf_tree import check_tree
from tauhat.robots.urdf_xml import parse_untrusted_xml

_MOST_BYTES = 20_000_000


def robot_from_urdf(
    source: str | Path, *, locked: Mapping[str, float] | None = None, gravity: Sequence[float] = EARTH
) -> Robot:
    """Return the robot that a URDF describes; meshes need not exist, they are never loaded here.

    Fixed joints are merged into the links that carry them, every URDF link stays as a frame, joints come in
    Pinocchio's order, continuous joints turn without limits. `<dynamics damping friction>` become nominal friction,
    the attribute `armature`, where present, the nominal rotor inertia. `<collision>` geometry becomes the solids.

    Parameters
    ----------
    source : path of a file, or the URDF itself (text that begins with "<")
    locked : joint name -> position at which to freeze it [rad or m], for instance a gripper's fingers
    gravity : acceleration of free fall in the base frame (3,) [m/s^2]

    Raises
    ------
    RobotError
        what the file says is malformed, hostile, not a tree, or no robot with mass.
    """
    content = urdf_source(source)
    root = parse_untrusted_xml(content)
    description = describe_urdf(root, where=content.where, default_name=content.name)
    check_tree(description)
    whole = _assembled(description, gravity, source=Path(content.where).name)
    folder = "" if content.where == "text" else str(Path(source).absolute().parent)
    whole = replace(whole, solids=urdf_solids(root, where=content.where, folder=folder))
    robot = lock_joints(whole, _frozen_positions(description, dict(locked or {})))
    if not robot.has_inertia:
        remedy = "add <inertial> to the links, or describe the kinematics by a DH table"
        raise RobotError("no moving link has a mass", where=robot.name, remedy=remedy)
    warn_of_massless_links(robot)
    return robot


def urdf_source(source: str | Path) -> DescriptionSource:
    """Return the bytes of a URDF given by its path or as text that begins with "<"."""
    if isinstance(source, str):
        text = source.lstrip("\ufeff \t\r\n")
        if text.startswith("<"):
            return source_from_text(text, most_bytes=_MOST_BYTES)
    return source_from_file(source, most_bytes=_MOST_BYTES)


def _frozen_positions(description: UrdfDescription, locked: dict[str, float]) -> dict[str, float]:
    """Return the positions of all joints to freeze: the caller's, and those that mimic another joint."""
    movable = {joint.name for joint in description.joints if joint.kind != "fixed"}
    frozen = dict(locked)
    for joint in description.joints:
        mimic = joint.mimic
        if mimic is None or joint.kind == "fixed" or joint.name in locked:
            continue
        if mimic.leader not in movable:
            raise RobotError("mimics a joint that is missing", where=f"joint {joint.name}", got=repr(mimic.leader[:60]))
        frozen[joint.name] = mimic.multiplier * locked.get(mimic.leader, 0.0) + mimic.offset
        if mimic.leader not in locked:
            message = f"{joint.name} mimics {mimic.leader}: locked at {frozen[joint.name]:g} instead of following it"
            warnings.warn(message, TauhatWarning, stacklevel=3)
    return frozen


def _assembled(description: UrdfDescription, gravity: Sequence[float], *, source: str) -> Robot:
    """Return the robot with all its joints, as Pinocchio merges and orders it."""
    import pinocchio

    links = {f"link{number}": name for number, name in enumerate(description.links)}
    joints = _numbered_joints(description)
    text = _essential_urdf(description, links, joints)
    try:
        model = pinocchio.buildModelFromXML(text)
    except (ValueError, RuntimeError) as error:
        raise RobotError("Pinocchio refuses the URDF", where=description.name, got=error) from error
    return Robot(
        name=description.name,
        joints=tuple(_joint_of(model, index, joints[model.names[index]]) for index in range(1, model.njoints)),
        gravity=np.array(gravity, dtype=np.float64),
        frames=tuple(_frame_of(frame, links[frame.name]) for frame in model.frames if frame.name in links),
        source=source,
    )


def _numbered_joints(description: UrdfDescription) -> dict[str, UrdfJoint]:
    """Return number -> joint, numbered so that Pinocchio, which sorts siblings by name, keeps their order."""
    ranked = sorted(description.joints, key=lambda joint: joint.name.encode())
    return {f"joint{rank:06d}": joint for rank, joint in enumerate(ranked)}


def _essential_urdf(description: UrdfDescription, links: Mapping[str, str], joints: Mapping[str, UrdfJoint]) -> str:
    """Return the URDF reduced to what dynamics needs, under numbers for names: nothing in it can trip its parser."""
    numbers = {name: number for number, name in links.items()}
    root = Element("robot", name="robot")
    for number, name in links.items():
        _add_link(root, number, description.links[name])
    for number, joint in joints.items():
        element = SubElement(root, "joint", name=number, type=joint.kind)
        SubElement(element, "parent", link=numbers[joint.parent])
        SubElement(element, "child", link=numbers[joint.child])
        _add_origin(element, joint.origin)
        SubElement(element, "axis", xyz=_row(joint.axis))
        SubElement(element, "limit", lower="-1", upper="1", effort="1", velocity="1")
    return tostring(root, encoding="unicode")


def _add_link(root: Element, number: str, inertial: UrdfInertial | None) -> None:
    link = SubElement(root, "link", name=number)
    if inertial is None:
        return
    element = SubElement(link, "inertial")
    _add_origin(element, inertial.origin)
    SubElement(element, "mass", value=repr(inertial.mass))
    moments = {
        f"i{'xyz'[row]}{'xyz'[column]}": repr(float(inertial.tensor[row, column]))
        for row in range(3)
        for column in range(row, 3)
    }
    SubElement(element, "inertia", moments)


def _add_origin(element: Element, origin: Placement) -> None:
    SubElement(element, "origin", xyz=_row(origin.xyz), rpy=_row(origin.rpy))


def _row(values: FloatArray) -> str:
    return " ".join(repr(float(value)) for value in values)


def _joint_of(model: Any, index: int, joint: UrdfJoint) -> Joint:
    placement = model.jointPlacements[index]
    return Joint(
        name=joint.name,
        kind="prismatic" if joint.kind == "prismatic" else "revolute",
        parent=int(model.parents[index]) - 1,
        rotation=placement.rotation,
        translation=placement.translation,
        axis=joint.axis,
        inertia=model.inertias[index].toDynamicParameters(),
        limits=joint.limits,
        rotor_inertia=joint.rotor_inertia,
        viscous=joint.viscous,
        coulomb=joint.coulomb,
    )


def _frame_of(frame: Any, name: str) -> Frame:
    return Frame(
        name=name,
        joint=int(frame.parentJoint) - 1,
        rotation=frame.placement.rotation,
        translation=frame.placement.translation,
    )
