"""Base parameters by the closed-form rules of Gautier and Khalil: no random motion, no rank decision on a regressor.

For each joint a rule names the few combinations of its link's ten parameters that the torques can show (`_RULES`, in
modified DH frames with z along the joint's axis). What is left of a link is carried by the link before it in every
motion, so it moves there through the constant transform between the two frames. From tip to base:

    base parameters of link j    = S_j x_j                       S_j spans the rule's rows, unit on the kept parameters
    parameters of the link before += A_j (x_j - E_j S_j x_j)      A_j: change of frame at q = 0

The rules, with a the axis of the first revolute joint on the way from the base ("first"):

| joint | what its link shows |
|---|---|
| prismatic, before any revolute one | m |
| prismatic, all revolute axes before it parallel, along a too | m |
| prismatic, all revolute axes before it parallel, across a | m and the two parts of the first moment across a |
| prismatic, beyond two revolute axes of different direction | m, mx, my, mz |
| revolute, first or parallel to all before, swung | Izz, mx, my |
| revolute, first or parallel to all before, not swung | Izz |
| revolute, beyond or itself a second direction | Ixx - Iyy, Ixy, Ixz, Iyz, Izz, mx, my |
| the same about a fixed point on its axis, without gravity | the same of the tensor about that point, without mx, my |

"Swung": gravity or a prismatic joint before it is not along a, or a revolute axis before it is another line. The page
docs/methods/parameterisations.md proves that the rules are complete, for trees as well.

Source: Gautier, Khalil, "Direct calculation of minimum set of inertial parameters of serial robots", 1990; Khalil,
Dombre, "Modeling, identification and control of robots", 2002, ch. 9; proof of completeness after Wensing, Niemeyer,
Slotine, "A geometric characterization of observability in inertial parameter identification", 2024.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray, IntArray, read_only
from tauhat.dynamics.base import BaseParameters
from tauhat.dynamics.selection import in_terms_of, independent_columns
from tauhat.dynamics.terms import INERTIAL_SYMBOLS, Inertia
from tauhat.dynamics.terms.inertia import INERTIAL_UNITS
from tauhat.robots.inertia_change import inertia_change
from tauhat.robots.joint import JointKind
from tauhat.robots.modified_dh import modified_dh
from tauhat.robots.robot import Robot
from tauhat.robots.transforms import homogeneous

PREFERENCE = ("Ixx", "Ixy", "Ixz", "Iyz", "Izz", "mx", "my", "mz", "Iyy", "m")  # as in the numeric base set
_ANGLE = 1e-4  # [rad] axes closer than this are parallel
_LENGTH = 1e-6  # [m] lines closer than this meet
_STILL = 1e-9  # [m/s^2] less gravity than this is none
_UNITS = dict(zip(INERTIAL_SYMBOLS, np.eye(10), strict=True))
_BENDING = _UNITS["Ixx"] - _UNITS["Iyy"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Axis:
    """A joint's axis at q = 0: kind, and the pose (4, 4) of its DH frame in the base frame."""

    kind: JointKind
    pose: FloatArray

    @property
    def direction(self) -> FloatArray:
        return self.pose[:3, 2]

    @property
    def point(self) -> FloatArray:
        return self.pose[:3, 3]

    def along(self, direction: FloatArray) -> bool:
        """Return whether the axis is parallel to a vector."""
        return bool(np.linalg.norm(np.cross(self.direction, direction)) <= _ANGLE * np.linalg.norm(direction))

    def distance(self, point: FloatArray) -> float:
        return float(np.linalg.norm(np.cross(self.direction, point - self.point)))


def closed_form_base(robot: Robot) -> BaseParameters:
    """Return the base parameters of the rigid links, exact and without sampling; serial arms and trees.

    They are those of `base_parameters(torque_model(robot, "inertia"))`: the same parameters are kept, the others
    regroup with the same weights. Axes closer than 1e-4 rad count as parallel, lines closer than 1e-6 m as meeting.
    """
    table = modified_dh(robot)
    rows, kept = [], []
    carried = [np.eye(10, 10 * robot.n_v, k=10 * joint) for joint in range(robot.n_v)]
    order = [INERTIAL_SYMBOLS.index(symbol) for symbol in PREFERENCE]
    ways = _ways(robot, [row.placement for row in table.rows])
    for index in reversed(range(robot.n_v)):
        shown = _rule(ways[index], robot.gravity) @ inertia_change(table.links[index])
        chosen = independent_columns(shown, INERTIAL_UNITS, order)
        own = in_terms_of(shown, chosen) @ carried[index]
        rows.append(own)
        kept.append(10 * index + chosen)
        joint = robot.joints[index]
        if joint.parent >= 0:
            rest = carried[index].copy()
            rest[chosen] -= own
            carried[joint.parent] += inertia_change(homogeneous(joint.rotation, joint.translation)) @ rest
    names = tuple(parameter.name for parameter in Inertia().parameters(robot))
    return base_of_projection(names, np.vstack(rows[::-1]), np.concatenate(kept[::-1]))


def base_of_projection(names: tuple[str, ...], projection: FloatArray, kept: IntArray) -> BaseParameters:
    """Return the base set whose parameters are `projection @ all parameters`, unit on the columns `kept`."""
    weights = in_terms_of(projection, kept)
    silent = ~weights.any(axis=0)
    dependent = np.setdiff1d(np.flatnonzero(~silent), kept)
    return BaseParameters(
        names=names,
        independent=read_only(np.array(kept, dtype=np.intp)),
        dependent=read_only(dependent),
        regrouping=read_only(weights[:, dependent]),
        unidentifiable=read_only(np.flatnonzero(silent)),
    )


def _ways(robot: Robot, placements: list[FloatArray]) -> list[tuple[_Axis, ...]]:
    """Return for each joint the axes on the way from the base to it, itself last."""
    ways: list[tuple[_Axis, ...]] = []
    for joint, placement in zip(robot.joints, placements, strict=True):
        before = ways[joint.parent] if joint.parent >= 0 else ()
        carrier = before[-1].pose if before else np.eye(4)
        ways.append((*before, _Axis(kind=joint.kind, pose=carrier @ placement)))
    return ways


def _rule(way: tuple[_Axis, ...], gravity: FloatArray) -> FloatArray:
    """Return the combinations (n, 10) of the last link's parameters that the torques show, in its DH frame."""
    own = way[-1]
    turning = [axis for axis in way if axis.kind == "revolute"]
    first = turning[0] if turning else None
    tilted = first is not None and not all(axis.along(first.direction) for axis in turning)
    if own.kind == "prismatic":
        return _shown_by_sliding(own, None if tilted else first, tilted=bool(tilted))
    if not tilted:
        symbols = ("Izz", "mx", "my") if _is_swung(way, gravity) else ("Izz",)
        return np.array([_UNITS[symbol] for symbol in symbols])
    height = _pivot_height(way, gravity)
    tensor = [_BENDING, *(_UNITS[symbol] for symbol in ("Ixy", "Ixz", "Iyz", "Izz"))]
    if height is None:
        return np.array([*tensor, _UNITS["mx"], _UNITS["my"]])
    tensor[2] = tensor[2] + height * _UNITS["mx"]
    tensor[3] = tensor[3] + height * _UNITS["my"]
    return np.array(tensor)


def _shown_by_sliding(own: _Axis, only: _Axis | None, *, tilted: bool) -> FloatArray:
    """Return the rows of a prismatic joint's link; `only` is the one direction of all revolute axes before it."""
    moments = np.array([_UNITS[symbol] for symbol in ("mx", "my", "mz")])
    if tilted:
        return np.vstack([_UNITS["m"], moments])
    if only is None or own.along(only.direction):
        return _UNITS["m"][None]
    along = own.pose[:3, :3].T @ only.direction
    across = np.linalg.svd(along[None])[2][1:]
    return np.vstack([_UNITS["m"], across @ moments])


def _is_swung(way: tuple[_Axis, ...], gravity: FloatArray) -> bool:
    """Return whether something pulls at the first moment of a link that only turns about one direction."""
    own, before = way[-1], way[:-1]
    if np.linalg.norm(gravity) > _STILL and not own.along(gravity):
        return True
    slid = any(axis.kind == "prismatic" and not axis.along(own.direction) for axis in before)
    return slid or any(axis.kind == "revolute" and axis.distance(own.point) > _LENGTH for axis in before)


def _pivot_height(way: tuple[_Axis, ...], gravity: FloatArray) -> float | None:
    """Return how far along the last axis the point lies that all axes share, if gravity does not tell it apart [m]."""
    own, before = way[-1], way[:-1]
    if np.linalg.norm(gravity) > _STILL or any(axis.kind == "prismatic" for axis in way):
        return None
    first = way[0]
    other = next(axis for axis in way if not axis.along(first.direction))
    normal = np.cross(first.direction, other.direction)
    across = np.cross(normal, other.direction)
    reach = across @ (other.point - first.point) / (across @ first.direction)
    meeting = first.point + reach * first.direction
    if any(axis.distance(meeting) > _LENGTH for axis in (*before, own)):
        return None
    return float((meeting - own.point) @ own.direction)
