"""The `<collision>` elements of a URDF as plain solids: what cannot be read is kept with the reason."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import RobotError
from tauhat.robots.solid import Solid, SolidKind
from tauhat.robots.transforms import rotation_from_rpy
from tauhat.robots.urdf_numbers import length_triple, number, numbers

_MOST_SOLIDS = 2000
_LARGEST = 1e3  # [m]
_LONGEST_ADDRESS = 1000


def urdf_solids(root: Element, *, where: str, folder: str) -> tuple[Solid, ...]:
    """Return the solids of all links in file order; no file is opened.

    Geometry that makes no sense is no error, because most of what a robot is used for does not need it: it becomes a
    solid of the kind `unreadable`, and who needs it is told why.

    Parameters
    ----------
    folder : where the URDF lies, "" where it was given as text

    Raises
    ------
    RobotError
        absurdly many of them.
    """
    solids: list[Solid] = []
    for link, element in _collisions(root):
        if len(solids) >= _MOST_SOLIDS:
            raise RobotError("absurd number of <collision> elements", where=where, expected=f"<= {_MOST_SOLIDS}")
        try:
            solids.append(_solid(element, link, folder))
        except RobotError as error:
            defect = f"{error.what}{f', got {error.got}' if error.got else ''}"
            solids.append(Solid(frame=link, kind="unreadable", size=np.empty(0), defect=defect))
    return tuple(solids)


def _collisions(root: Element) -> Iterator[tuple[str, Element]]:
    for link in root.findall("link"):
        for element in link.findall("collision"):
            yield link.get("name", "").strip(), element


def _solid(element: Element, link: str, folder: str) -> Solid:
    where = f"link {link}"
    geometry = element.find("geometry")
    shapes: list[Element] = [] if geometry is None else list(geometry)
    if len(shapes) != 1:
        raise RobotError("<collision> needs one geometry", where=where, got=len(shapes))
    kind, size = _size(shapes[0], where)
    origin = element.find("origin")
    return Solid(
        frame=link,
        kind=kind,
        size=size,
        rotation=rotation_from_rpy(*numbers(origin, "rpy", (0.0, 0.0, 0.0), where=where)),
        translation=length_triple(origin, where),
        file=shapes[0].get("filename", "")[:_LONGEST_ADDRESS] if kind == "mesh" else "",
        folder=folder if kind == "mesh" else "",
    )


def _size(shape: Element, where: str) -> tuple[SolidKind, FloatArray]:
    kind: SolidKind
    match shape.tag:
        case "box":
            kind, size = "box", _required_triple(shape, where)
        case "sphere":
            kind, size = "sphere", np.array([number(shape, "radius", where=where)])
        case "cylinder" | "capsule":
            kind = "cylinder" if shape.tag == "cylinder" else "capsule"
            size = np.array([number(shape, key, where=where) for key in ("radius", "length")])
        case "mesh":
            kind, size = "mesh", numbers(shape, "scale", (1.0, 1.0, 1.0), where=where)
        case _:
            raise RobotError("unknown geometry", where=where, got=f"<{shape.tag[:40]}>")
    if not ((size > 0.0) & (size < _LARGEST)).all():
        raise RobotError(f"the size of the <{kind}> is absurd", where=where, got=size.tolist())
    return kind, size


def _required_triple(shape: Element, where: str) -> FloatArray:
    if "size" not in shape.attrib:
        raise RobotError("<box> has no size", where=where)
    return numbers(shape, "size", (0.0, 0.0, 0.0), where=where)
