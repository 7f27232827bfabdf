"""An estimate written into the user's own URDF: inertials and joint dynamics change, every other byte stays."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ExportError, TauhatWarning
from tauhat.export.bodies import central_body, row
from tauhat.export.markup import Edit, Markup, Place, read_markup, with_attributes, with_child
from tauhat.export.parameters import StandardParameters
from tauhat.export.simulators import ToldParameters, told_parameters
from tauhat.export.urdf_links import LinkShares, check_same_kinematics, locked_positions, share_among_links
from tauhat.files import replace_file
from tauhat.robots.robot import Robot
from tauhat.robots.source import DescriptionSource
from tauhat.robots.urdf import robot_from_urdf, urdf_source
from tauhat.robots.urdf_description import UrdfDescription, describe_urdf
from tauhat.robots.urdf_tree import check_tree
from tauhat.robots.urdf_xml import parse_untrusted_xml

_AGREEMENT = 1e-9  # of a link's largest parameter: what may be lost on the way through the text
_WORDS = ("damping", "friction")
_MOMENTS = ("ixx", "ixy", "iyy", "ixz", "iyz", "izz")


@dataclass(frozen=True, slots=True, kw_only=True)
class FilledUrdf:
    """A URDF with identified parameters.

    content : the file
    filled : links that hold what was identified
    emptied : links fixed to those; their inertia is in them and is zero here
    kept : links behind joints that were locked; they keep the file's inertia
    left_out : what URDF has no word for, with the largest coefficient
    set_to_zero : what came out negative and cannot be, by name, with its value
    """

    content: bytes
    filled: tuple[str, ...]
    emptied: tuple[str, ...]
    kept: tuple[str, ...]
    left_out: Mapping[str, float]
    set_to_zero: Mapping[str, float]

    def save(self, path: str | Path) -> None:
        """Write the file whole or not at all.

        Raises
        ------
        OutputError
            when it cannot be written.
        """
        replace_file(path, lambda beside: beside.write_bytes(self.content))


def fill_urdf(source: str | Path, robot: Robot, parameters: StandardParameters) -> FilledUrdf:
    """Return the URDF with the parameters in its `<inertial>` and joint `<dynamics>`, and no other byte changed.

    The result is read back and compared before it is returned.

    Parameters
    ----------
    source : path of the URDF that the robot was made from, or its text (which begins with "<")
    robot : with the same joints, some of which may be locked
    parameters : of the robot; damping or dry friction that they do not have stays as it is in the file

    Raises
    ------
    ExportError
        the robot is not of this URDF, or a link is no body, naming it.
    RobotError
        the URDF cannot be read.

    Warns
    -----
    TauhatWarning
        when something is negative and is set to zero, and when damping and dry friction are far from the model's.
    """
    told = told_parameters(robot, parameters)
    content = urdf_source(source)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)  # about figures that are replaced
        description = describe_urdf(parse_untrusted_xml(content), where=content.where, default_name=content.name)
        check_tree(description)
        locked = locked_positions(description, robot, where=content.where)
        whole = robot_from_urdf(source, locked=locked, gravity=tuple(robot.gravity))
    check_same_kinematics(whole, robot, where=content.where)
    shares = share_among_links(description, robot, parameters)
    markup = read_markup(content.content, where=content.where, encoding=_known_encoding(content))
    edits = [*_link_edits(markup, description, shares), *_joint_edits(markup, robot, told)]
    written = markup.edited(edits)
    _check_written(markup.decoded(written), robot, parameters, locked)
    emptied = tuple(link for link in shares.emptied if description.links[link] is not None)
    return FilledUrdf(
        content=written,
        filled=tuple(shares.filled),
        emptied=emptied,
        kept=shares.kept,
        left_out=_untold(markup, robot, told),
        set_to_zero=told.set_to_zero,
    )


def _known_encoding(source: DescriptionSource) -> str:
    return "utf-8" if source.where == "text" else ""


def _link_edits(markup: Markup, description: UrdfDescription, shares: LinkShares) -> list[Edit]:
    edits: list[Edit] = []
    for link in markup.root.named("link"):
        name = link.texts["name"].strip()
        if name in shares.filled:
            edits += _with_inertia(markup, link, shares.filled[name])
        elif name in shares.emptied and (description.links[name] is not None or link.child("collision")):
            # Also where there was none: MuJoCo makes an inertia of its own from the collision geometry.
            edits += _with_inertia(markup, link, np.zeros(10))
    return edits


def _with_inertia(markup: Markup, link: Place, inertia: FloatArray) -> list[Edit]:
    body = central_body(inertia)
    tensor = [body.inertia["xyz".index(name[1]), "xyz".index(name[2])] for name in _MOMENTS]
    moments = {name: row(value) for name, value in zip(_MOMENTS, tensor, strict=True)}
    mass, xyz = {"value": row(body.mass)}, {"xyz": row(*body.com)}
    inertial = link.child("inertial")
    if inertial is None:
        lines = [
            "<inertial>",
            f'\t<origin{_written(xyz)} rpy="0 0 0"/>',
            f"\t<mass{_written(mass)}/>",
            f"\t<inertia{_written(moments)}/>",
            "</inertial>",
        ]
        return [with_child(markup, link, lines)]
    edits = [
        *with_attributes(_required(inertial, "mass"), mass),
        *with_attributes(_required(inertial, "inertia"), moments),
    ]
    origin = inertial.child("origin")
    if body.mass == 0.0:
        return edits
    if origin is None:
        return [*edits, with_child(markup, inertial, [f'<origin{_written(xyz)} rpy="0 0 0"/>'])]
    turned = {"rpy": "0 0 0"} if "rpy" in origin.attributes else {}
    return [*edits, *with_attributes(origin, xyz | turned)]


def _written(values: Mapping[str, str]) -> str:
    return "".join(f' {name}="{value}"' for name, value in values.items())


def _required(place: Place, tag: str) -> Place:
    child = place.child(tag)
    if child is None:
        raise ExportError(f"<{place.tag}> has no <{tag}>")
    return child


def _joint_edits(markup: Markup, robot: Robot, told: ToldParameters) -> list[Edit]:
    edits: list[Edit] = []
    places = {place.texts["name"].strip(): place for place in markup.root.named("joint")}
    for index, name in enumerate(robot.joint_names):
        friction = zip(_WORDS, told.friction.of_joint(index), strict=True)
        values = {word: row(value) for word, value in friction if value is not None}
        dynamics = places[name].child("dynamics")
        if dynamics is None and any(float(value) for value in values.values()):
            edits.append(with_child(markup, places[name], [f"<dynamics{_written(values)}/>"]))
        elif dynamics is not None:
            known = {"armature": row(told.rotor[index])} if "armature" in dynamics.attributes else {}
            edits += with_attributes(dynamics, values | known)
    return edits


def _untold(markup: Markup, robot: Robot, told: ToldParameters) -> dict[str, float]:
    """Return what the file cannot say -> its largest coefficient."""
    places = {place.texts["name"].strip(): place.child("dynamics") for place in markup.root.named("joint")}
    has_word = [
        place is not None and "armature" in place.attributes for place in (places[name] for name in robot.joint_names)
    ]
    rotor = float(np.where(has_word, 0.0, told.rotor).max())
    return {**told.left_out, **({"rotor": rotor} if rotor > 0.0 else {})}


def _check_written(text: str, robot: Robot, parameters: StandardParameters, locked: Mapping[str, float]) -> None:
    """Read the result back: the inertia behind every joint is what it should be."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)
        found = robot_from_urdf(text, locked=dict(locked))
    by_name = {joint.name: joint.inertia for joint in found.joints}
    for name, inertia in zip(robot.joint_names, parameters.inertia, strict=True):
        apart = float(np.abs(by_name[name] - inertia).max())
        if apart > _AGREEMENT * float(np.abs(inertia).max()):
            raise ExportError("the written inertia is not what was identified", where=f"joint {name}", got=apart)
