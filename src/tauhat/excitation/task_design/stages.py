"""Stages of a calibration in a region: what each is for, and how fast it may move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

import numpy as np

from tauhat.errors import ExcitationError
from tauhat.excitation.task_design.blocks import Block, block_named
from tauhat.excitation.waypoints.moves import LARGEST_PART

MoveKind: TypeAlias = Literal["joint", "line"]
"""How via-points are joined: straight in joint space, or in lines of the tool."""

Range: TypeAlias = tuple[float, float]
LEAST_RADIUS = 1e-3  # [m] of a zone: a smaller one is a stop
_PACE_STEP = 0.01  # controllers take whole per cent
_MOST_POINTS = 100


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskStage:
    """A program of moves through via-points of the region, run over and over.

    name : what files and reports call it
    counted : blocks of columns that it is for; the others count as unknown
    points : via-points of the program; it begins and ends at home
    seconds : how long it is recorded; the program is repeated as often as it fits, and must fit once
    speed, acceleration : least and largest part of the limits that a move may ask for, in (0, 1]
    zone : largest part of a way that a fly-by zone takes, 0 to stop at every point
    radius : largest radius of a zone [m], for controllers that know no parts of a way; zones are parts where not stated
    dwell : how long it stands at the points where it stops [s]
    moves : how points are joined
    weight : of its readings beside those of the other stages, when these are combined
    """

    name: str
    counted: tuple[Block, ...]
    points: int = 10
    seconds: float = 30.0
    speed: Range = (0.3, 1.0)
    acceleration: Range = (0.3, 1.0)
    zone: float = LARGEST_PART
    radius: float | None = None
    dwell: float = 0.0
    moves: MoveKind = "joint"
    weight: float = 1.0

    def __post_init__(self) -> None:
        where = f"stage {self.name}"
        if not self.name.replace("-", "").replace("_", "").isalnum():
            raise ExcitationError("name of a stage", expected="letters, digits, - and _", got=self.name[:60])
        object.__setattr__(self, "counted", tuple(block_named(block) for block in self.counted))
        if not self.counted or len(set(self.counted)) < len(self.counted):
            raise ExcitationError("columns of a stage", where=where, expected="one block or more, none twice")
        if not 1 <= self.points <= _MOST_POINTS:
            raise ExcitationError("via-points", where=where, expected=f"1 to {_MOST_POINTS}", got=self.points)
        if self.moves not in get_args(MoveKind):
            raise ExcitationError("moves", where=where, expected=" or ".join(get_args(MoveKind)), got=self.moves)
        self._check_pace(where)

    def runs(self, duration: float) -> int:
        """Return how often a program of this duration [s] fits into the stage's time, at least once."""
        return max(1, int(self.seconds // duration))

    def _check_pace(self, where: str) -> None:
        for name in ("seconds", "weight"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise ExcitationError(name, where=where, expected="a number above zero", got=getattr(self, name))
        for name in ("speed", "acceleration"):
            low, high = (float(value) for value in getattr(self, name))
            object.__setattr__(self, name, (low, high))
            if not _PACE_STEP <= low <= high <= 1.0:
                expected = f"parts, {_PACE_STEP:g} <= least <= largest <= 1"
                raise ExcitationError(name, where=where, expected=expected, got=[low, high])
        if not 0.0 <= self.zone <= LARGEST_PART:
            raise ExcitationError("zone", where=where, expected=f"a part of a way, 0 to {LARGEST_PART}", got=self.zone)
        if self.radius is not None and not LEAST_RADIUS <= self.radius < np.inf:
            expected = f"a length of at least {LEAST_RADIUS:g} m"
            raise ExcitationError("radius of zones", where=where, expected=expected, got=self.radius)
        if not 0.0 <= self.dwell < np.inf:
            raise ExcitationError("dwell", where=where, expected="a time of at least 0 s", got=self.dwell)


def two_stages(*, points: int = 10, seconds: float = 30.0) -> tuple[TaskStage, TaskStage]:
    """Return a fast stage for the inertial columns, and a slow one for gravity and friction.

    Parameters
    ----------
    points : via-points of each
    seconds : recorded of each
    """
    fast = TaskStage(
        name="fast", counted=("inertial",), points=points, seconds=seconds, speed=(0.4, 1.0), acceleration=(0.4, 1.0)
    )
    slow = TaskStage(
        name="slow", counted=("gravity", "friction"), points=points, seconds=seconds, speed=(0.02, 0.4),
        acceleration=(0.1, 0.5),
    )  # fmt: skip
    return fast, slow


def one_stage(*, points: int = 20, seconds: float = 60.0) -> tuple[TaskStage]:
    """Return one stage for all columns, as long as both of `two_stages`."""
    whole = TaskStage(
        name="whole", counted=("inertial", "gravity", "friction"), points=points, seconds=seconds, speed=(0.02, 1.0),
        acceleration=(0.1, 1.0),
    )  # fmt: skip
    return (whole,)
