"""What a link is made of where the robot's description says so: solids for collisions, meshes by name only."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, TypeAlias
from urllib.parse import unquote

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import RobotError

SolidKind: TypeAlias = Literal["box", "cylinder", "sphere", "capsule", "mesh", "unreadable"]

SIZES: dict[SolidKind, int] = {"box": 3, "cylinder": 2, "sphere": 1, "capsule": 2, "mesh": 3, "unreadable": 0}
_PACKAGE_PATHS = ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Solid:
    """A solid fixed to a named frame of a robot.

    frame : name of the frame that carries it, in a URDF its link
    size : box: edges (3,); cylinder and capsule: radius and length along z (2,), a capsule's caps not counted; sphere:
        radius (1,) [m]; mesh: metres per unit of the file along each axis (3,)
    rotation, translation : (3, 3), (3,) [m] pose in that frame
    file, folder : of a mesh: its address as written, and the folder of the description ("" where it was text)
    defect : of an unreadable one: what is wrong with it
    """

    frame: str
    kind: SolidKind
    size: FloatArray
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    translation: FloatArray = field(default_factory=lambda: np.zeros(3))
    file: str = ""
    folder: str = ""
    defect: str = ""

    def __post_init__(self) -> None:
        where = f"solid of {self.frame}"
        if self.kind not in SIZES:
            raise RobotError("unknown kind of solid", where=where, expected=" | ".join(SIZES), got=self.kind)
        for name, shape in (("size", (SIZES[self.kind],)), ("rotation", (3, 3)), ("translation", (3,))):
            object.__setattr__(self, name, frozen(name, getattr(self, name), shape, where=where))
        if not (self.size > 0.0).all():
            raise RobotError("size is not positive", where=where, got=self.size.tolist())

    @property
    def path(self) -> Path | None:
        """Where the mesh file is; None where it cannot be found, or for solids that need none."""
        return find_mesh(self.file, folder=self.folder) if self.kind == "mesh" else None


def find_mesh(address: str, *, folder: str) -> Path | None:
    """Return the file that a mesh address of a URDF means, None where there is none.

    `package://NAME/REST` is looked for in the folders above the description, by that name or as their neighbour, and
    on the package paths of ROS; `file://` is taken as it stands, everything else beside the description.

    Parameters
    ----------
    folder : of the description, "" where it was given as text
    """
    try:
        return next((place for place in _places(address.strip(), folder) if place.is_file()), None)
    except (OSError, ValueError):
        return None


def _places(address: str, folder: str) -> list[Path]:
    scheme, separator, rest = address.partition("://")
    if not separator:
        return [Path(folder) / address] if folder or Path(address).is_absolute() else []
    if scheme == "file":
        return [Path(unquote(rest))]
    if scheme not in {"package", "model"}:
        return []
    package, _, inner = rest.partition("/")
    above = [Path(folder), *Path(folder).parents] if folder else []
    places = [place / inner for place in above if place.name == package]
    places += [place / package / inner for place in above]
    for variable in _PACKAGE_PATHS:
        for entry in filter(None, os.environ.get(variable, "").split(os.pathsep)):
            root = Path(entry)
            places += [root / package / inner, root / "share" / package / inner]
            places += [root / inner] if root.name == package else []
    return places
