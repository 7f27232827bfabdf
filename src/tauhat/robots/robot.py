"""The robot: a tree of one-degree-of-freedom joints, read-only, and its exact form as plain data."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import RobotError
from tauhat.robots.joint import Joint, Limits
from tauhat.robots.solid import Solid

EARTH = (0.0, 0.0, -9.81)
"""Acceleration of free fall in the base frame of an arm that stands upright [m/s^2]."""
_MOST_JOINTS = 100


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Frame:
    """A named frame fixed to a link: a URDF link, a flange, a tool.

    joint : index of the joint whose link carries it, -1 for the base
    rotation, translation : (3, 3), (3,) [m] pose in the joint frame (or in the base frame)
    """

    name: str
    joint: int
    rotation: FloatArray
    translation: FloatArray

    def __post_init__(self) -> None:
        where = f"frame {self.name}"
        object.__setattr__(self, "rotation", frozen("rotation", self.rotation, (3, 3), where=where))
        object.__setattr__(self, "translation", frozen("translation", self.translation, (3,), where=where))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Robot:
    """A kinematic tree with limits, nominal inertias and named frames. Immutable.

    joints : in topological order, a parent before its children
    gravity : (3,) acceleration of free fall in the base frame [m/s^2]
    frames : named frames on the links, the tool among them
    solids : what the links are made of, for collisions, where the description says so
    source : where it came from, for provenance
    """

    name: str
    joints: tuple[Joint, ...]
    gravity: FloatArray = field(default_factory=lambda: np.array(EARTH))
    frames: tuple[Frame, ...] = ()
    solids: tuple[Solid, ...] = ()
    source: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "joints", tuple(self.joints))
        object.__setattr__(self, "frames", tuple(self.frames))
        object.__setattr__(self, "solids", tuple(self.solids))
        object.__setattr__(self, "gravity", frozen("gravity", self.gravity, (3,), where=self.name))
        if not self.joints:
            raise RobotError("no movable joint", where=self.name, remedy="are all joints fixed or locked?")
        if self.n_v > _MOST_JOINTS:
            raise RobotError("absurd number of joints", where=self.name, expected=f"<= {_MOST_JOINTS}", got=self.n_v)
        _refuse_duplicates(self.name, self.joint_names)
        _check_frames(self)
        for index, joint in enumerate(self.joints):
            if not -1 <= joint.parent < index:
                raise RobotError("joints are not in topological order", where=f"{self.name}, joint {joint.name}")

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return len(self.joints)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints in order."""
        return tuple(joint.name for joint in self.joints)

    @property
    def parents(self) -> tuple[int, ...]:
        """Index of each joint's parent, -1 for the base."""
        return tuple(joint.parent for joint in self.joints)

    @property
    def inertia(self) -> FloatArray:
        """Nominal inertial parameters, (n_v, 10)."""
        return np.array([joint.inertia for joint in self.joints])

    @property
    def has_inertia(self) -> bool:
        """Whether the description carries nominal masses at all."""
        return bool((self.inertia[:, 0] > 0).any())

    @property
    def lower(self) -> FloatArray:
        """Lower position limits, (n_v,) [rad or m]."""
        return np.array([joint.limits.lower for joint in self.joints])

    @property
    def upper(self) -> FloatArray:
        """Upper position limits, (n_v,) [rad or m]."""
        return np.array([joint.limits.upper for joint in self.joints])

    @property
    def velocity_limit(self) -> FloatArray:
        """Largest speeds, (n_v,) [rad/s or m/s]."""
        return np.array([joint.limits.velocity for joint in self.joints])

    @property
    def effort_limit(self) -> FloatArray:
        """Largest torques, (n_v,) [Nm or N]."""
        return np.array([joint.limits.effort for joint in self.joints])

    def subtree(self, joint: int) -> tuple[int, ...]:
        """Return the joints that move with `joint`, itself first: the links its torque depends on."""
        members = {joint}
        for index in range(joint + 1, self.n_v):
            if self.joints[index].parent in members:
                members.add(index)
        return tuple(sorted(members))

    def with_gravity(self, gravity: Iterable[float]) -> Robot:
        """Return the same robot mounted otherwise, e.g. `(0, 0, 9.81)` for a ceiling.

        Parameters
        ----------
        gravity : acceleration of free fall in the base frame [m/s^2]
        """
        return replace(self, gravity=np.array(list(gravity), dtype=np.float64))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data that JSON can hold and `from_dict` reads back exactly, without the solids.

        Nothing that is estimated rests on the solids, and their meshes are files that need not follow the data.
        """
        return {
            "name": self.name,
            "gravity": self.gravity.tolist(),
            "joints": [_joint_to_dict(joint) for joint in self.joints],
            "frames": [_frame_to_dict(frame) for frame in self.frames],
            "source": self.source,
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Robot:
        """Return the robot that `to_dict` described.

        Raises
        ------
        RobotError
            when a field is missing, unknown or of the wrong kind.
        """
        try:
            joints = tuple(_joint_from_dict(item) for item in data["joints"])
            frames = tuple(Frame(**item) for item in data["frames"])
            return cls(name=data["name"], joints=joints, gravity=data["gravity"], frames=frames, source=data["source"])
        except (KeyError, TypeError, AttributeError) as error:
            raise RobotError("robot data is damaged", got=f"{type(error).__name__}: {error}") from error

    @property
    def fingerprint(self) -> str:
        """Hash of what a model rests on: joint names, order, axes, placements (to 1e-9) and gravity."""
        parts: list[object] = [np.round(self.gravity, 9).tolist()]
        for joint in self.joints:
            numbers = np.concatenate([joint.rotation.ravel(), joint.translation, joint.axis])
            rounded = (np.round(numbers, 9) + 0.0).tolist()
            parts.append([joint.name, joint.kind, joint.parent, rounded])
        return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:16]


def _refuse_duplicates(robot: str, names: tuple[str, ...]) -> None:
    doubled = sorted({name for name in names if names.count(name) > 1})
    if doubled:
        raise RobotError("joint names are not unique", where=robot, got=", ".join(doubled))


def _check_frames(robot: Robot) -> None:
    names = tuple(frame.name for frame in robot.frames)
    doubled = sorted({name for name in names if names.count(name) > 1})
    if doubled:
        raise RobotError("frame names are not unique", where=robot.name, got=", ".join(doubled))
    for frame in robot.frames:
        if not -1 <= frame.joint < robot.n_v:
            raise RobotError(
                "a frame is fixed to a joint that is not there", where=f"frame {frame.name}", got=frame.joint
            )
    for solid in robot.solids:
        if solid.frame not in names:
            raise RobotError("a solid is fixed to a frame that is not there", where=robot.name, got=solid.frame)


def _joint_to_dict(joint: Joint) -> dict[str, Any]:
    data = {name: getattr(joint, name) for name in Joint.__dataclass_fields__}
    for name in ("rotation", "translation", "axis", "inertia"):
        data[name] = data[name].tolist()
    limits = asdict(joint.limits)
    data["limits"] = {name: (value if np.isfinite(value) else None) for name, value in limits.items()}
    return data


def _joint_from_dict(data: Mapping[str, Any]) -> Joint:
    unlimited = asdict(Limits())
    limits = {name: (unlimited[name] if value is None else value) for name, value in data["limits"].items()}
    return Joint(**{**data, "limits": Limits(**limits)})


def _frame_to_dict(frame: Frame) -> dict[str, Any]:
    return {
        "name": frame.name,
        "joint": frame.joint,
        "rotation": frame.rotation.tolist(),
        "translation": frame.translation.tolist(),
    }
