"""Names and frames of a robot's links, for formats that describe links rather than joints."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from tauhat.robots.robot import Frame, Robot

_SAME_PLACE = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedLinks:
    """What to call the links.

    base : the link that stands still
    moving : of each joint
    others : frames that are not the frame of a link themselves
    """

    base: str
    moving: tuple[str, ...]
    others: tuple[Frame, ...]

    def carrier(self, joint: int) -> str:
        """Return the link that a joint moves, the base for -1."""
        return self.base if joint < 0 else self.moving[joint]


def named_links(robot: Robot) -> NamedLinks:
    """Return names for all links: those of frames that coincide with them, else made from the joint's."""
    own: dict[int, str] = {}
    for frame in robot.frames:
        if _is_identity(frame):
            own.setdefault(frame.joint, frame.name)
    taken = {frame.name for frame in robot.frames}
    for index, name in enumerate(("base_link", *(f"{joint}_link" for joint in robot.joint_names)), start=-1):
        if index not in own:
            own[index] = _free(name, taken)
            taken.add(own[index])
    others = tuple(frame for frame in robot.frames if own[frame.joint] != frame.name)
    return NamedLinks(base=own[-1], moving=tuple(own[index] for index in range(robot.n_v)), others=others)


def _is_identity(frame: Frame) -> bool:
    turned = float(np.abs(frame.rotation - np.eye(3)).max())
    return max(turned, float(np.abs(frame.translation).max())) < _SAME_PLACE


def _free(name: str, taken: Iterable[str]) -> str:
    while name in taken:
        name += "_"
    return name
