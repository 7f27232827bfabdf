"""The moves of a controller's program, as plain data: to joint positions, or in a line to a pose of the tool."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import ExcitationError
from tauhat.robots.kinematics import Pose

SAME = 1e-9  # [m, rad] within which two targets are one
_ORTHOGONAL = 1e-6  # of a target's rotation matrix
LARGEST_PART = 0.4  # of a way that a zone takes: a fifth is left between two zones for changing speed


@dataclass(frozen=True, slots=True, kw_only=True)
class Zone:
    """How near a motion passes by a target instead of stopping there: within a radius, or on a part of its ways.

    radius : of the tool around the target [m]; no more than 0.4 of either way is taken
    part : of the ways to and from the target, at most 0.4
    """

    radius: float | None = None
    part: float | None = None

    def __post_init__(self) -> None:
        if (self.radius is None) == (self.part is None):
            raise ExcitationError("a zone is a radius or a part", got=f"radius {self.radius}, part {self.part}")
        if self.radius is not None and not 0.0 < self.radius < np.inf:
            raise ExcitationError("radius of a zone", expected="above zero", got=self.radius)
        if self.part is not None and not 0.0 < self.part <= LARGEST_PART:
            raise ExcitationError("part of a zone", expected=f"0 < part <= {LARGEST_PART}", got=self.part)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointMove:
    """A move in which all joints start and arrive together, on a straight line in joint space.

    target : (n_v,) [rad or m]
    speed, acceleration : parts of the joint limits, in (0, 1]; jerk takes the part of the acceleration
    zone : how the target is passed by; without one the motion stops there
    dwell : how long it stands there [s]
    """

    target: FloatArray
    speed: float = 1.0
    acceleration: float = 1.0
    zone: Zone | None = None
    dwell: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "target", frozen("target", self.target, (None,), where="joint move"))
        _check_override(self)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LineMove:
    """A move that takes the tool along a straight line while it turns about one axis.

    target : pose of the tool in the base frame, or the joint positions that have it, (n_v,) [rad or m]
    speed, acceleration : parts of the tool limits, in (0, 1]; jerk takes the part of the acceleration
    zone : how the target is passed by; without one the motion stops there
    dwell : how long it stands there [s]
    """

    target: Pose | FloatArray
    speed: float = 1.0
    acceleration: float = 1.0
    zone: Zone | None = None
    dwell: float = 0.0

    def __post_init__(self) -> None:
        target = self.target
        if isinstance(target, Pose):
            rotation = frozen("rotation", target.rotation, (3, 3), where="line move")
            translation = frozen("translation", target.translation, (3,), where="line move")
            if np.abs(rotation.T @ rotation - np.eye(3)).max() > _ORTHOGONAL or np.linalg.det(rotation) < 0.0:
                raise ExcitationError("target of a line move", expected="a rotation matrix", got=rotation.tolist())
            object.__setattr__(self, "target", Pose(rotation=rotation, translation=translation))
        else:
            object.__setattr__(self, "target", frozen("target", target, (None,), where="line move"))
        _check_override(self)


Move: TypeAlias = JointMove | LineMove
"""A step of a program."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ToolLimits:
    """What line moves may ask of the tool before the joints are looked at.

    speed, acceleration, jerk : of the frame's origin [m/s, m/s^2, m/s^3]
    turn_speed, turn_acceleration, turn_jerk : of its orientation [rad/s, rad/s^2, rad/s^3]
    """

    speed: float = 0.25
    acceleration: float = 2.0
    jerk: float = 40.0
    turn_speed: float = 1.5
    turn_acceleration: float = 12.0
    turn_jerk: float = 240.0

    def __post_init__(self) -> None:
        values = [self.speed, self.acceleration, self.jerk, self.turn_speed, self.turn_acceleration, self.turn_jerk]
        if not all(0.0 < value < np.inf for value in values):
            raise ExcitationError("tool limits", expected="finite numbers above zero", got=values)


def _check_override(move: JointMove | LineMove) -> None:
    for name, value in (("speed", move.speed), ("acceleration", move.acceleration)):
        if not 0.0 < value <= 1.0:
            raise ExcitationError(f"{name} of a move", expected="a part of the limit, in (0, 1]", got=value)
    if not 0.0 <= move.dwell < np.inf:
        raise ExcitationError("dwell of a move", expected="a time of at least 0", got=move.dwell)
    if move.zone is not None and move.dwell > 0.0:
        raise ExcitationError(
            "a move that dwells at its target cannot pass it by", remedy="leave out the zone or the dwell"
        )


def move_to_dict(move: Move) -> dict[str, Any]:
    """Return plain data that JSON can hold and `move_from_dict` reads back exactly."""
    target = move.target
    held: Any = target.tolist() if isinstance(target, np.ndarray) else {
        "rotation": target.rotation.tolist(), "translation": target.translation.tolist(),
    }  # fmt: skip
    zone = None if move.zone is None else {"radius": move.zone.radius, "part": move.zone.part}
    kind = "line" if isinstance(move, LineMove) else "joint"
    rest = {"speed": move.speed, "acceleration": move.acceleration, "zone": zone, "dwell": move.dwell}
    return {"kind": kind, "target": held, **rest}


def move_from_dict(data: Mapping[str, Any]) -> Move:
    """Return the move that `move_to_dict` described.

    Raises
    ------
    ExcitationError
        when a field is missing, unknown or of the wrong kind.
    """
    fields = dict(data)
    try:
        kind, target, zone = fields.pop("kind"), fields.pop("target"), fields.pop("zone")
        kinds: dict[str, Callable[..., Move]] = {"joint": JointMove, "line": LineMove}
        held = Pose(**target) if isinstance(target, Mapping) else target
        return kinds[kind](target=held, zone=None if zone is None else Zone(**zone), **fields)
    except (KeyError, TypeError) as error:
        raise ExcitationError("data of a move is damaged", got=f"{type(error).__name__}: {error}") from error
