"""From genes to a program of moves: via-points in the region, speeds, accelerations, zones."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.excitation.task_design.reach import Reach
from tauhat.excitation.task_design.stages import LEAST_RADIUS, Range, TaskStage
from tauhat.excitation.waypoints.motion import WaypointMotion, waypoint_motion
from tauhat.excitation.waypoints.moves import JointMove, LineMove, Move, Zone
from tauhat.excitation.waypoints.settings import WaypointSettings
from tauhat.robots.kinematics import forward_kinematics

_PART_STEP = 0.02  # of a zone's part: whole steps of every controller's own
_NEAREST = 1e-3  # [rad or m] of any joint: a nearer point is left out
_PACE_GENES = 3  # speed, acceleration, zone
_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProgramSpace:
    """All programs of a stage; genes from 0 to 1 pick one.

    Speeds and accelerations are whole per cent and zones whole steps, which every controller's language can say.

    reach : the region, as far as the arm reaches it
    planning : limits, ramps, tool; motions return to their start
    """

    stage: TaskStage
    reach: Reach
    planning: WaypointSettings

    @property
    def n_genes(self) -> int:
        """Genes of a whole program."""
        return self.stage.points * (self.reach.region.n_genes + _PACE_GENES)

    def moves(self, genes: FloatArray) -> tuple[Move, ...]:
        """Return the moves that genes pick, (n_genes,) from 0 to 1, and the way home at the stage's largest pace."""
        of_points = genes.reshape(self.stage.points, -1)
        targets, paces = [self.reach.home], []
        for target, pace in zip(self.reach.positions(of_points[:, :-_PACE_GENES]), of_points, strict=True):
            if np.abs(target - targets[-1]).max() > _NEAREST:
                targets.append(target)
                paces.append(pace[-_PACE_GENES:])
        zones = self._zones(np.array(targets), np.array([pace[2] for pace in paces]))
        speed, acceleration = (_paced(bounds, 1.0) for bounds in (self.stage.speed, self.stage.acceleration))
        back = JointMove(target=self.reach.home, speed=speed, acceleration=acceleration)
        return (*map(self._move, targets[1:], paces, zones), back)

    def motion(self, genes: FloatArray) -> WaypointMotion:
        """Return the planned motion of a program, which returns to home and may be repeated.

        Raises
        ------
        ExcitationError
            when it cannot be planned: names the move.
        """
        return waypoint_motion(self.reach.robot, self.reach.home, self.moves(genes), settings=self.planning)

    def _move(self, target: FloatArray, pace: FloatArray, zone: Zone | None) -> Move:
        stage = self.stage
        kind = LineMove if stage.moves == "line" else JointMove
        dwell = stage.dwell if zone is None else 0.0
        speed, acceleration = _paced(stage.speed, pace[0]), _paced(stage.acceleration, pace[1])
        return kind(target=target, speed=speed, acceleration=acceleration, zone=zone, dwell=dwell)

    def _zones(self, targets: FloatArray, shares: FloatArray) -> list[Zone | None]:
        """Return the zone of each target after the first, which is home; a share of 1 asks for the largest."""
        parts = self.stage.zone * shares
        if self.stage.moves == "line":
            parts[-1:] = 0.0  # the way home is no line, and some languages size a zone between two kinds twice
        if self.stage.radius is None:
            return [_part_zone(part) for part in parts]
        places = forward_kinematics(self.reach.robot, targets, frame=self.reach.frame).translation
        lengths = np.linalg.norm(np.diff(places, axis=0, append=places[:1]), axis=1)
        nearest = np.minimum(lengths[:-1], lengths[1:])
        return [_ball_zone(min(part * length, share * self.stage.radius)) for part, length, share in zip(
            parts, nearest, shares, strict=True
        )]  # fmt: skip


def _paced(bounds: Range, share: float) -> float:
    """Return a whole per cent inside bounds, evenly in the logarithm: slow speeds are as many as fast ones."""
    low, high = bounds
    least = math.ceil(100.0 * low - _ROUNDING)
    most = max(least, math.floor(100.0 * high + _ROUNDING))
    return min(max(round(100.0 * low * math.pow(high / low, share)), least), most) / 100.0


def _part_zone(part: float) -> Zone | None:
    steps = math.floor(part / _PART_STEP + _ROUNDING)
    return Zone(part=round(steps * _PART_STEP, 2)) if steps else None


def _ball_zone(radius: float) -> Zone | None:
    """Return a zone of whole millimetres."""
    steps = math.floor(radius / LEAST_RADIUS + _ROUNDING)
    return Zone(radius=round(steps * LEAST_RADIUS, 3)) if steps else None
