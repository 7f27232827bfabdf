"""A URDF as plain checked data: links with their inertias, joints with their limits, one tree."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, TypeAlias
from xml.etree.ElementTree import Element

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import RobotError, TauhatWarning
from tauhat.robots.inertia_checks import warn_of_impossible_inertia
from tauhat.robots.joint import Limits
from tauhat.robots.urdf_numbers import length_triple, limit_number, number, numbers, range_of, required_child

UrdfJointKind: TypeAlias = Literal["revolute", "prismatic", "fixed"]

_KINDS: dict[str, UrdfJointKind] = {
    "revolute": "revolute",
    "continuous": "revolute",
    "prismatic": "prismatic",
    "fixed": "fixed",
}
_LARGEST_ANGLE = 2.001 * np.pi  # [rad] a placement turned farther than this is in degrees
_LARGEST_MOMENT = 1e9  # [kg m^2]
_SHORTEST_AXIS = 1e-6
_LONGEST_NAME = 200
_MOST_ELEMENTS = 2000  # links, or joints


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Placement:
    """A URDF `<origin>`: translation (3,) [m] and roll, pitch, yaw (3,) [rad]."""

    xyz: FloatArray
    rpy: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UrdfInertial:
    """A link's mass [kg], where its centre is, and its central tensor (3, 3) [kg m^2] in that placement's axes."""

    mass: float
    origin: Placement
    tensor: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Mimic:
    """A joint that follows another: `q = multiplier q_leader + offset`."""

    leader: str
    multiplier: float
    offset: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UrdfJoint:
    """A joint between two named links; `axis` (3,) is a unit vector, friction and rotor inertia are nominal."""

    name: str
    kind: UrdfJointKind
    parent: str
    child: str
    origin: Placement
    axis: FloatArray
    limits: Limits
    viscous: float
    coulomb: float
    rotor_inertia: float
    mimic: Mimic | None


@dataclass(frozen=True, slots=True, kw_only=True)
class UrdfDescription:
    """A whole URDF: link name -> inertial (None where the file has none), and the joints in file order."""

    name: str
    links: dict[str, UrdfInertial | None]
    joints: tuple[UrdfJoint, ...]


def describe_urdf(root: Element, *, where: str, default_name: str) -> UrdfDescription:
    """Return the checked content of a parsed URDF; geometry is not looked at.

    Raises
    ------
    RobotError
        not a robot, doubled or missing names, unsupported joints, impossible numbers.
    """
    if root.tag != "robot":
        raise RobotError("not a URDF", where=where, expected="<robot> as the outermost element", got=f"<{root.tag}>")
    name = root.get("name", "").strip()[:_LONGEST_NAME] or default_name
    links = {link: _inertial(element, link) for link, element in _named(root, "link", where)}
    joints = tuple(_joint(element, joint) for joint, element in _named(root, "joint", where))
    return UrdfDescription(name=name, links=links, joints=joints)


def _named(root: Element, tag: str, where: str) -> Iterator[tuple[str, Element]]:
    seen: set[str] = set()
    for element in root.findall(tag):
        name = element.get("name", "").strip()
        if not name:
            raise RobotError(f"a <{tag}> without a name", where=where)
        if len(name) > _LONGEST_NAME:
            raise RobotError(f"a <{tag}> with an absurdly long name", where=where, got=f"{name[:40]}...")
        if len(seen) >= _MOST_ELEMENTS:
            raise RobotError(f"absurd number of <{tag}> elements", where=where, expected=f"<= {_MOST_ELEMENTS}")
        if name in seen:
            raise RobotError(f"two <{tag}> elements have the same name", where=where, got=name)
        seen.add(name)
        yield name, element


def _inertial(link: Element, name: str) -> UrdfInertial | None:
    element = link.find("inertial")
    if element is None:
        return None
    where = f"link {name}"
    mass = number(required_child(element, "mass", where), "value", where=where)
    if mass < 0:
        raise RobotError("negative mass", where=where, got=f"{mass:g} kg", remedy="a mass is zero or positive")
    moments = required_child(element, "inertia", where)
    xx, yy, zz = (number(moments, key, where=where) for key in ("ixx", "iyy", "izz"))
    xy, xz, yz = (number(moments, key, where=where, default=0.0) for key in ("ixy", "ixz", "iyz"))
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if np.abs(tensor).max() > _LARGEST_MOMENT:
        remedy = "moments of inertia are kg m^2"
        raise RobotError("absurd inertia", where=where, got=f"{np.abs(tensor).max():g} kg m^2", remedy=remedy)
    warn_of_impossible_inertia(where, mass, tensor)
    return UrdfInertial(mass=mass, origin=_placement(element, where), tensor=tensor)


def _placement(element: Element, where: str) -> Placement:
    origin = element.find("origin")
    rpy = numbers(origin, "rpy", (0.0, 0.0, 0.0), where=where)
    largest = float(np.abs(rpy).max())
    if largest > _LARGEST_ANGLE:
        message = f"{where}: <origin> turned by {largest:g} rad; angles are radians, are these degrees?"
        warnings.warn(message, TauhatWarning, stacklevel=2)
    return Placement(xyz=length_triple(origin, where), rpy=rpy)


def _joint(element: Element, name: str) -> UrdfJoint:
    where = f"joint {name}"
    kind = _kind(element.get("type", ""), where)
    dynamics = element.find("dynamics")
    return UrdfJoint(
        name=name,
        kind=kind,
        parent=required_child(element, "parent", where).get("link", "").strip(),
        child=required_child(element, "child", where).get("link", "").strip(),
        origin=_placement(element, where),
        axis=_axis(element, where) if kind != "fixed" else np.array([1.0, 0.0, 0.0]),
        limits=Limits() if kind == "fixed" else _limits(element, where),
        viscous=_not_negative(dynamics, "damping", where),
        coulomb=_not_negative(dynamics, "friction", where),
        rotor_inertia=_not_negative(dynamics, "armature", where),
        mimic=_mimic(element, where),
    )


def _kind(kind: str, where: str) -> UrdfJointKind:
    if kind in {"floating", "planar"}:
        remedy = "make it fixed, or a chain of revolute and prismatic joints"
        raise RobotError(f"{kind} joints are not supported", where=where, remedy=remedy)
    if kind not in _KINDS:
        raise RobotError("unknown type of joint", where=where, expected=" | ".join(_KINDS), got=kind[:40] or "none")
    return _KINDS[kind]


def _axis(element: Element, where: str) -> FloatArray:
    axis = numbers(element.find("axis"), "xyz", (1.0, 0.0, 0.0), where=where)
    length = float(np.linalg.norm(axis))
    if not _SHORTEST_AXIS < length < 1.0 / _SHORTEST_AXIS:
        raise RobotError("the joint's axis has no direction", where=where, got=axis.tolist())
    return axis / length


def _limits(element: Element, where: str) -> Limits:
    limit = element.find("limit")
    continuous = element.get("type") == "continuous"
    lower, upper = (-np.inf, np.inf) if continuous else range_of(limit, element, where)
    velocity, effort, acceleration = (
        _positive_limit(limit, key, where) for key in ("velocity", "effort", "acceleration")
    )
    return Limits(lower=lower, upper=upper, velocity=velocity, effort=effort, acceleration=acceleration)


def _positive_limit(limit: Element | None, key: str, where: str) -> float:
    if limit is None or key not in limit.attrib:
        return float(np.inf)
    value = limit_number(limit, key, where=where)
    if value < 0:
        raise RobotError(f"the {key} limit is negative", where=where, got=f"{value:g}")
    if value == 0:
        warnings.warn(f"{where}: {key} limit 0 taken as not given", TauhatWarning, stacklevel=2)
        return float(np.inf)
    return value


def _not_negative(dynamics: Element | None, key: str, where: str) -> float:
    value = number(dynamics, key, where=where, default=0.0)
    if value < 0:
        raise RobotError(f"<dynamics> {key} is negative", where=where, got=f"{value:g}")
    return value


def _mimic(element: Element, where: str) -> Mimic | None:
    mimic = element.find("mimic")
    if mimic is None:
        return None
    multiplier = number(mimic, "multiplier", where=where, default=1.0)
    offset = number(mimic, "offset", where=where, default=0.0)
    return Mimic(leader=mimic.get("joint", "").strip(), multiplier=multiplier, offset=offset)
