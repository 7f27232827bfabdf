"""A new URDF for any robot: kinematics, limits, inertials, joint dynamics, no shapes."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.export.bodies import central_body, row
from tauhat.export.exported import ExportedText
from tauhat.export.links import named_links
from tauhat.export.parameters import StandardParameters
from tauhat.export.simulators import ToldParameters, told_parameters
from tauhat.robots.joint import Joint
from tauhat.robots.robot import Robot

_UNLIMITED = 1e6  # URDF demands a number for effort, speed and a slide's range


def new_urdf(robot: Robot, parameters: StandardParameters) -> ExportedText:
    """Return a URDF with the robot's joint frames as link frames; other frames are links without mass.

    URDF has no gravity: a robot that is not mounted upright needs its gravity set in the simulator.

    Raises
    ------
    ExportError
        when a link is no body, naming it, or the parameters are of another robot.

    Warns
    -----
    TauhatWarning
        when something is negative and is set to zero, and when damping and dry friction are far from the model's.
    """
    told = told_parameters(robot, parameters)
    links = named_links(robot)
    root = Element("robot", name=robot.name)
    SubElement(root, "link", name=links.base)
    for index, joint in enumerate(robot.joints):
        _add_link(root, links.moving[index], told.inertia[index])
        element = _add_joint(root, joint.name, _kind(joint), (links.carrier(joint.parent), links.moving[index]))
        _add_origin(element, joint.rotation, joint.translation)
        SubElement(element, "axis", xyz=row(*joint.axis))
        _add_limit(element, joint)
        _add_dynamics(element, told, index)
    for frame in links.others:
        SubElement(root, "link", name=frame.name)
        element = _add_joint(root, f"{frame.name}_fixed", "fixed", (links.carrier(frame.joint), frame.name))
        _add_origin(element, frame.rotation, frame.translation)
    indent(root)
    text = f'<?xml version="1.0"?>\n{tostring(root, encoding="unicode")}\n'
    return ExportedText(text=text, left_out=told.left_out, set_to_zero=told.set_to_zero)


def _add_link(root: Element, name: str, inertia: FloatArray) -> None:
    link = SubElement(root, "link", name=name)
    if not np.abs(inertia).max() > 0.0:
        return
    body = central_body(inertia)
    element = SubElement(link, "inertial")
    SubElement(element, "origin", xyz=row(*body.com), rpy="0 0 0")
    SubElement(element, "mass", value=row(body.mass))
    places = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    SubElement(element, "inertia", {name: row(body.inertia[place]) for name, place in places.items()})


def _kind(joint: Joint) -> str:
    if joint.kind == "prismatic":
        return "prismatic"
    return "revolute" if np.isfinite([joint.limits.lower, joint.limits.upper]).all() else "continuous"


def _add_joint(root: Element, name: str, kind: str, links: tuple[str, str]) -> Element:
    element = SubElement(root, "joint", name=name, type=kind)
    SubElement(element, "parent", link=links[0])
    SubElement(element, "child", link=links[1])
    return element


def _add_origin(element: Element, rotation: FloatArray, translation: FloatArray) -> None:
    SubElement(element, "origin", xyz=row(*translation), rpy=row(*rpy_from_rotation(rotation)))


def _add_limit(element: Element, joint: Joint) -> None:
    limits = joint.limits
    values = {"effort": limits.effort, "velocity": limits.velocity}
    if _kind(joint) != "continuous":
        values = {"lower": limits.lower, "upper": limits.upper} | values
    SubElement(element, "limit", {name: row(_finite(value)) for name, value in values.items()})


def _add_dynamics(element: Element, told: ToldParameters, index: int) -> None:
    known = zip(("damping", "friction"), told.friction.of_joint(index), strict=True)
    values = {word: row(value or 0.0) for word, value in known}
    rotor = float(told.rotor[index])
    SubElement(element, "dynamics", values | ({"armature": row(rotor)} if rotor > 0.0 else {}))


def _finite(value: float) -> float:
    return float(np.clip(value, -_UNLIMITED, _UNLIMITED))


def rpy_from_rotation(rotation: FloatArray) -> tuple[float, float, float]:
    """Return roll, pitch, yaw [rad] with `rotation = Rz(yaw) Ry(pitch) Rx(roll)`, exact at pitch of a quarter turn too.

    The roll is taken after the yaw is undone, so that an arbitrary yaw there does no harm.
    """
    yaw = np.arctan2(rotation[1, 0], rotation[0, 0])
    cosine, sine = np.cos(yaw), np.sin(yaw)
    pitch = np.arctan2(-rotation[2, 0], cosine * rotation[0, 0] + sine * rotation[1, 0])
    across = cosine * rotation[1] - sine * rotation[0]
    return float(np.arctan2(-across[2], across[1])), float(pitch), float(yaw)
