"""A MuJoCo model (MJCF) of a robot with its identified parameters."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ExportError
from tauhat.export.bodies import central_body, row
from tauhat.export.exported import ExportedText
from tauhat.export.links import named_links
from tauhat.export.parameters import StandardParameters
from tauhat.export.simulators import ToldParameters, told_parameters
from tauhat.robots.joint import Joint
from tauhat.robots.robot import Robot
from tauhat.robots.transforms import quaternion
from tauhat.simulation.plant import FRICTION_IMPEDANCE, FRICTION_TIME_STEPS

_TIMESTEP = 1e-3  # [s]


def mjcf(robot: Robot, parameters: StandardParameters) -> ExportedText:
    """Return an MJCF with the robot's joint frames as bodies and its other frames as sites.

    Rotor inertia becomes armature, friction damping and friction loss (`StandardParameters.plain_friction`) with nearly
    rigid contact, as in the library's own plant. Position limits become ranges, torque limits the range of the
    actuators' force.

    Raises
    ------
    ExportError
        when a link is no body or has no mass, naming it, or the parameters are of another robot.

    Warns
    -----
    TauhatWarning
        when something is negative and is set to zero, and when damping and dry friction are far from the model's.
    """
    told = told_parameters(robot, parameters)
    links = named_links(robot)
    root = Element("mujoco", model=robot.name)
    SubElement(root, "compiler", angle="radian", autolimits="true", balanceinertia="false")
    option = {"gravity": row(*robot.gravity), "timestep": row(_TIMESTEP), "integrator": "implicitfast"}
    SubElement(root, "option", option)
    stiff = {"solreffriction": row(FRICTION_TIME_STEPS * _TIMESTEP, 1.0), "solimpfriction": row(*FRICTION_IMPEDANCE)}
    SubElement(SubElement(root, "default"), "joint", stiff)
    world = SubElement(root, "worldbody")
    bodies: dict[int, Element] = {-1: world}
    for index, joint in enumerate(robot.joints):
        place = _placed(joint.rotation, joint.translation)
        body = SubElement(bodies[joint.parent], "body", {"name": links.moving[index], **place})
        _add_inertial(body, joint.name, told.inertia[index])
        _add_joint(body, joint, index, told)
        bodies[index] = body
    for frame in links.others:
        SubElement(bodies[frame.joint], "site", {"name": frame.name, **_placed(frame.rotation, frame.translation)})
    indent(root)
    text = tostring(root, encoding="unicode") + "\n"
    return ExportedText(text=text, left_out=told.left_out, set_to_zero=told.set_to_zero)


def _placed(rotation: FloatArray, translation: FloatArray) -> dict[str, str]:
    return {"pos": row(*translation), "quat": row(*quaternion(rotation))}


def _add_inertial(element: Element, joint: str, inertia: FloatArray) -> None:
    body = central_body(inertia)
    if body.mass <= 0.0:
        remedy = "MuJoCo needs a mass on every moving link"
        raise ExportError("the link has no mass", where=f"link of joint {joint}", remedy=remedy)
    moments, axes = np.linalg.eigh(body.inertia)
    axes = axes * np.sign(np.linalg.det(axes))
    moments[2] = min(moments[2], moments[0] + moments[1])  # MuJoCo refuses a flat body for one rounding error
    place = {"pos": row(*body.com), "quat": row(*quaternion(axes))}
    SubElement(element, "inertial", {**place, "mass": row(body.mass), "diaginertia": row(*moments)})


def _add_joint(element: Element, joint: Joint, index: int, told: ToldParameters) -> None:
    values = {
        "name": joint.name,
        "type": "hinge" if joint.kind == "revolute" else "slide",
        "axis": row(*joint.axis),
        "armature": row(told.rotor[index]),
    }
    for word, value in zip(("damping", "frictionloss"), told.friction.of_joint(index), strict=True):
        if value is not None:
            values[word] = row(value)
    if np.isfinite([joint.limits.lower, joint.limits.upper]).all():
        values["range"] = row(joint.limits.lower, joint.limits.upper)
    if np.isfinite(joint.limits.effort):
        values["actuatorfrcrange"] = row(-joint.limits.effort, joint.limits.effort)
    SubElement(element, "joint", values)
