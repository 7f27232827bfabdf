"""A program of moves as an industrial controller runs it: joint moves, lines, zones, dwells."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import ExcitationError
from tauhat.excitation.trajectory import MotionSamples
from tauhat.excitation.waypoints.moves import SAME, JointMove, Move, move_from_dict, move_to_dict
from tauhat.excitation.waypoints.route import route
from tauhat.excitation.waypoints.schedule import Piece
from tauhat.excitation.waypoints.settings import WaypointSettings
from tauhat.excitation.waypoints.slowing import Slowed, slow_down
from tauhat.recordings.recording import Recording
from tauhat.robots.robot import Robot

_SCHEMA = 1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WaypointMotion:
    """A program of moves with its course in time; `waypoint_motion` plans one.

    Positions and velocities are continuous, accelerations too with `JerkLimited`; dq and ddq are the derivatives of q.

    start : (n_v,) where it begins [rad or m]
    moves : as given; the way back that `ending="return"` adds is not among them
    pieces : curves and when they are passed, one after the other
    slowed : moves that a limit of a joint made slower than they ask for
    """

    robot: Robot
    start: FloatArray
    moves: tuple[Move, ...]
    settings: WaypointSettings
    pieces: tuple[Piece, ...]
    slowed: tuple[Slowed, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", frozen("start", self.start, (self.robot.n_v,), where="waypoints"))

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return self.robot.n_v

    @property
    def duration(self) -> float:
        """Time from start to end [s]."""
        return float(sum(piece.law.duration for piece in self.pieces))

    @property
    def begins(self) -> FloatArray:
        """When each piece begins, (n_pieces,) [s]."""
        lengths = [piece.law.duration for piece in self.pieces]
        return np.concatenate([[0.0], np.cumsum(lengths)[:-1]])

    @property
    def passing_times(self) -> FloatArray:
        """When the target of each move is reached, or passed in the middle of its corner, (n_moves,) [s]."""
        times = np.zeros(len(self.moves))
        for begin, piece in zip(self.begins, self.pieces, strict=True):
            share = {"way": 1.0, "corner": 0.5, "stand": 0.0}[piece.place]
            if piece.move < len(self.moves):
                times[piece.move] = begin + share * piece.law.duration
        return times

    def sample(self, t: FloatArray) -> MotionSamples:
        """Return the motion at the times t, (n_t,) [s].

        Before its start and after its end it stands there; with `ending="return"` it repeats.
        """
        t = frozen("t", t, (None,))
        duration, begins = self.duration, self.begins
        repeats = self.settings.ending == "return"
        inside = np.mod(t, duration) if repeats else np.clip(t, 0.0, duration)
        index = np.clip(np.searchsorted(begins, inside, side="right") - 1, 0, len(self.pieces) - 1)
        q, dq, ddq = np.empty((3, t.size, self.n_v))
        for k in np.unique(index):
            rows, piece = index == k, self.pieces[k]
            local = np.clip(inside[rows] - begins[k], 0.0, piece.law.duration)
            q[rows], dq[rows], ddq[rows] = piece.curve.state(piece.law.course(local))
        if not repeats:
            resting = (t < 0.0) | (t >= duration)
            dq[resting] = ddq[resting] = 0.0
        return MotionSamples(t=t, q=q, dq=dq, ddq=ddq)

    def recording(self, *, rate: float, name: str = "motion", repeats: int = 1) -> Recording:
        """Return the motion run `repeats` times, sampled `rate` times a second, from rest to rest, without torque.

        `write_recording` makes it the motion file that `tauhat simulate --motion` and `motion_for` read.

        Raises
        ------
        ExcitationError
            when a motion that does not return to its start is to be repeated.
        """
        if repeats < 1 or (repeats > 1 and self.settings.ending != "return"):
            raise ExcitationError("repeats of a motion that ends elsewhere", expected="1", got=repeats)
        whole = repeats * self.duration
        count = int(np.ceil(whole * rate - SAME)) + 1
        t = np.arange(count) / rate
        samples = self.sample(np.minimum(t, np.nextafter(whole, 0.0)))
        still = (t >= whole)[:, None]
        dq, ddq = (np.where(still, 0.0, part) for part in (samples.dq, samples.ddq))
        return Recording(t=t, q=samples.q, dq=dq, ddq=ddq, joint_names=self.robot.joint_names, name=name)

    def to_dict(self) -> dict[str, Any]:
        """Return the program as plain data that JSON can hold; `from_dict` plans the same motion from it."""
        return {
            "schema": _SCHEMA,
            "robot": self.robot.to_dict(),
            "start": self.start.tolist(),
            "moves": [move_to_dict(move) for move in self.moves],
            "settings": self.settings.to_dict(),
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> WaypointMotion:
        """Return the motion that `to_dict` described.

        Raises
        ------
        ExcitationError
            when a field is missing or of the wrong kind, or the file is of a later version.
        """
        try:
            schema, robot, start = data["schema"], Robot.from_dict(data["robot"]), data["start"]
            moves = [move_from_dict(move) for move in data["moves"]]
            settings = WaypointSettings.from_dict(data["settings"])
        except (KeyError, TypeError) as error:
            raise ExcitationError(
                "data of a waypoint motion is damaged", got=f"{type(error).__name__}: {error}"
            ) from error
        if schema != _SCHEMA:
            raise ExcitationError("waypoint motion of another version", expected=_SCHEMA, got=schema)
        return waypoint_motion(robot, start, moves, settings=settings)


def waypoint_motion(
    robot: Robot, start: FloatArray, moves: Sequence[Move], *, settings: WaypointSettings | None = None
) -> WaypointMotion:
    """Return the motion of a program as an industrial controller runs it, with every limit of the joints kept.

    Joint moves are straight in joint space, line moves in the base frame; zones are passed without a stop, at constant
    pace. Speeds look ahead over all corners. A line or corner that asks more of a joint than its limits is slowed as a
    whole, and listed in `slowed`.

    Parameters
    ----------
    start : (n_v,) at rest [rad or m]
    moves : one or more

    Raises
    ------
    ExcitationError
        when a target is outside the limits, not reached, reached in another configuration, or a line passes a
        singularity: names the move.
    MissingExtraError
        when the ramps need Ruckig and it is not installed.
    """
    chosen = settings or WaypointSettings()
    begin = frozen("start", start, (robot.n_v,), where="waypoints")
    program = tuple(moves)
    if not program:
        raise ExcitationError("a program of moves", where="waypoints", expected="one move or more")
    way = route(robot, begin, _with_return(begin, program, chosen), chosen)
    pieces, slowed = slow_down(way, chosen.ramps, chosen.joint_limits(robot), robot.joint_names)
    return WaypointMotion(
        robot=robot, start=begin, moves=program, settings=chosen, pieces=pieces, slowed=slowed
    )  # fmt: skip


def _with_return(start: FloatArray, moves: tuple[Move, ...], settings: WaypointSettings) -> tuple[Move, ...]:
    """Return the moves with the way back to the start, where it is wanted and they do not end there."""
    last = moves[-1]
    there = last.target if isinstance(last, JointMove) and last.target.shape == start.shape else None
    at_start = there is not None and bool(np.abs(there - start).max() <= SAME)
    return moves if settings.ending == "stay" or at_start else (*moves, JointMove(target=start))
