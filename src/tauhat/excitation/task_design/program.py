"""From genes to a program of moves: via-points in the region, speeds, accelerations, zones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.excitation.task_design.reach import Reach
from tauhat.excitation.task_design.stages import TaskStage
from tauhat.excitation.waypoints.motion import WaypointMotion, waypoint_motion
from tauhat.excitation.waypoints.moves import JointMove, LineMove, Move, Zone
from tauhat.excitation.waypoints.settings import WaypointSettings

_LEAST_ZONE = 0.02  # part of a way: a smaller zone is a stop
_NEAREST = 1e-3  # [rad or m] of any joint: a nearer point is left out
_PACE_GENES = 3  # speed, acceleration, zone


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProgramSpace:
    """All programs of a stage; genes from 0 to 1 pick one.

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
        """Return the moves that genes pick, (n_genes,) from 0 to 1."""
        of_points = genes.reshape(self.stage.points, -1)
        targets = self.reach.positions(of_points[:, :-_PACE_GENES])
        moves: list[Move] = []
        last = self.reach.home
        for target, pace in zip(targets, of_points[:, -_PACE_GENES:], strict=True):
            if np.abs(target - last).max() > _NEAREST:
                moves.append(self._move(target, pace))
                last = target
        return tuple(moves)

    def motion(self, genes: FloatArray) -> WaypointMotion:
        """Return the planned motion of a program, which returns to home and may be repeated.

        Raises
        ------
        ExcitationError
            when it cannot be planned: names the move.
        """
        return waypoint_motion(self.reach.robot, self.reach.home, self.moves(genes), settings=self.planning)

    def _move(self, target: FloatArray, pace: FloatArray) -> Move:
        stage = self.stage
        speed, acceleration = (
            float(low * (high / low) ** share)  # evenly in the logarithm: slow speeds are as many as fast ones
            for (low, high), share in zip((stage.speed, stage.acceleration), pace[:2], strict=True)
        )
        part = float(pace[2] * stage.zone)
        zone = None if part < _LEAST_ZONE else Zone(part=part)
        kind = LineMove if stage.moves == "line" else JointMove
        dwell = stage.dwell if zone is None else 0.0
        return kind(target=target, speed=speed, acceleration=acceleration, zone=zone, dwell=dwell)
